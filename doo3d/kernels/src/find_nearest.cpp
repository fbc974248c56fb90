#include "find_nearest.h"

namespace {

// Fill in the nearest target of each of some rows of the points that has one within `reach`; return the other rows. `row` gives the row
// of a point of the cells.
template <class Row>
std::vector<Index> find_within(const NearestSearch& search, Cells& cells, double reach, Row row) {
    cells.start();
    for (Index s = 0; s < search.size && cells.size > 0; ++s) cells.offer(search.targets + s * search.dim, s, reach);
    std::vector<Index> others;
    for (Index k = 0; k < cells.size; ++k) {
        const Index n = row(cells.order[k]);
        if (cells.square[k] <= reach * reach) {
            search.distance[n] = std::sqrt(cells.square[k]);
            search.index[n] = cells.owner[k];
        } else {
            others.push_back(n);
        }
    }
    return others;
}

}  // namespace

// A target within half the reach is the nearest of all, if there is one; where there are more points than targets, few points are
// left for the search in the whole reach, which takes four times as long. Those without a target there are compared with all
// targets, unless the search is limited.
void NearestOfPoints::find(const NearestSearch& search, double reach, bool limited) {
    if (search.size == 0 || count == 0) return;
    const Index dim = dim_;
    const double first = count > search.size ? reach / 2 : reach;
    if (!cells_) cells_.emplace(points, count, dim, first / CELLS_PER_REACH);
    std::vector<Index> rows = find_within(search, *cells_, first, [](Index n) { return n; });
    if (first < reach && !rows.empty()) {
        std::vector<double> left;
        for (const Index n : rows) left.insert(left.end(), points + n * dim, points + (n + 1) * dim);
        Cells cells(left.data(), Index(rows.size()), dim, reach / CELLS_PER_REACH, 4.0);
        rows = find_within(search, cells, reach, [&](Index k) { return rows[k]; });
    }
    for (std::size_t k = 0; k < rows.size() && !limited; ++k) {
        const Index n = rows[k];
        count_visits(search.size);
        double best = INFINITY;
        for (Index s = 0; s < search.size; ++s) {
            const double between = squared_distance(points + n * dim, search.targets + s * dim, dim);
            if (between < best) {
                best = between;
                search.index[n] = s;
            }
        }
        search.distance[n] = std::sqrt(best);
    }
}

// Of equally near targets the first stays the owner. Without a branch, so that compilers can vectorize.
WITH_AVX2 void Cells::offer_in_plane(const double* __restrict x, const double* __restrict y, Index count, const double* target, Index number,
                                     double* __restrict best, Index* __restrict whose) {
    const double u = target[0], v = target[1];
    for (Index k = 0; k < count; ++k) {
        const double dx = x[k] - u, dy = y[k] - v, between = dx * dx + dy * dy;
        const bool nearer = between < best[k];
        best[k] = nearer ? between : best[k];
        whose[k] = nearer ? number : whose[k];
    }
}

WITH_AVX2 void Cells::offer_in_space(const double* __restrict x, const double* __restrict y, const double* __restrict z, Index count,
                                     const double* target, Index number, double* __restrict best, Index* __restrict whose) {
    const double u = target[0], v = target[1], w = target[2];
    for (Index k = 0; k < count; ++k) {
        const double dx = x[k] - u, dy = y[k] - v, dz = z[k] - w, between = dx * dx + dy * dy + dz * dz;
        const bool nearer = between < best[k];
        best[k] = nearer ? between : best[k];
        whose[k] = nearer ? number : whose[k];
    }
}
