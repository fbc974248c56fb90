#include "find_nearest.h"

namespace {

// Fill in the nearest target of each of some rows of the points that has one within `reach`; return the other rows. `row` gives the row
// of a point of the cells.
template <class Row>
std::vector<Index> find_within(const NearestSearch& search, Cells& cells, double reach, Row row) {
    cells.start();
    if (cells.size > 0) cells.offer(search.targets, search.size, reach);
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
// left for the search in the whole reach, which takes four times as long. More targets than points stand close together: most points
// have one within a small part of the reach, which is that of the thickest strand. Points without a target in the whole reach are
// compared with all targets, unless the search is limited.
void NearestOfPoints::find(const NearestSearch& search, double reach, bool limited) {
    if (search.size == 0 || count == 0) return;
    const Index dim = dim_;
    double within = count > search.size ? reach / 2 : reach / 16;
    if (!cells_) cells_.emplace(points, count, dim, within / CELLS_PER_REACH, 4.0);  // strands far apart leave most cells empty
    std::vector<Index> rows = find_within(search, *cells_, within, [](Index n) { return n; });
    while (within < reach && !rows.empty()) {
        within *= 2;
        std::vector<double> left;
        for (const Index n : rows) left.insert(left.end(), points + n * dim, points + (n + 1) * dim);
        Cells cells(left.data(), Index(rows.size()), dim, within / CELLS_PER_REACH, 4.0);
        rows = find_within(search, cells, within, [&](Index k) { return rows[k]; });
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

// Without a branch for a point, so that compilers can vectorize.
WITH_AVX2 void Cells::offer(const double* targets, Index count, double reach) {
    for (Index s = 0; s < count; ++s) {
        const double *target = targets + s * dim_, u = target[0], v = target[1], w = dim_ == 3 ? target[2] : 0.0;
        Index first[2], last[2];
        find_around(target, reach, first, last);
        for (Index row = first[0]; row < last[0] && first[1] < last[1]; ++row) {
            const Index end = start_[row * shape_[1] + last[1]], begin = start_[row * shape_[1] + first[1]];
            visits_.count += end - begin;
            const double *__restrict x = position_.data() + begin, *__restrict y = x + size, *__restrict z = y + size;
            double* __restrict best = square.data() + begin;
            Index* __restrict whose = owner.data() + begin;
            for (Index k = 0; k < end - begin; ++k) {
                const double dx = x[k] - u, dy = y[k] - v, dz = z[k] - w, between = dx * dx + dy * dy + dz * dz;
                const Index nearer = -Index(between < best[k]);  // all bits or none
                best[k] = std::min(best[k], between);
                whose[k] ^= (whose[k] ^ s) & nearer;
            }
        }
    }
}
