// Nearest targets of many points that lie near them, and sums over the points of each target.
#include "cells.h"

namespace {

// Centers at most of which only the points near them are sorted.
constexpr Index FEW_CENTERS = 8;

void check_targets(const Matrix<double>& points, const Matrix<double>& targets, double reach) {
    const Index dim = points.shape(1);
    require(dim == 2 || dim == 3, "points are neither (N, 2) nor (N, 3)");
    require(Index(targets.shape(1)) == dim, "points and targets have different numbers of coordinates");
    require(reach > 0 && std::isfinite(reach), "reach is not positive and finite");
    for (std::size_t k = 0; k < targets.size(); ++k) require(std::isfinite(targets.data()[k]), "a target is not finite");
}

// Fill in the distance and the index of the target nearest to each point.
//
// Each target competes for the points in the cells around it, one after the other: there are far fewer targets than points, and
// the points of a cell lie one behind the other in memory. A point without a target within reach is compared with all targets,
// unless the search is limited.
void find_nearest(const double* points, Index count, const double* targets, Index size, Index dim, double reach, bool limited,
                  double* distance, Index* index) {
    if (size == 0 || count == 0) return;
    Cells cells(points, count, dim, reach / CELLS_PER_REACH);
    for (Index s = 0; s < size && cells.size > 0; ++s) cells.offer(targets + s * dim, s, reach);
    for (Index k = 0; k < cells.size; ++k) {
        const Index n = cells.order[k];
        double best = cells.square[k];
        Index owner = cells.owner[k];
        if (!(best <= reach * reach)) {
            if (limited) continue;
            best = INFINITY;
            count_visits(size);
            for (Index s = 0; s < size; ++s) {
                const double between = squared_distance(points + n * dim, targets + s * dim, dim);
                if (between < best) {
                    best = between;
                    owner = s;
                }
            }
        }
        distance[n] = std::sqrt(best);
        index[n] = owner;
    }
}

auto nearest(Matrix<double> points, Matrix<double> targets, double reach, bool limited) {
    check_targets(points, targets, reach);
    const Index count = points.shape(0), dim = points.shape(1);
    std::vector<double> distance(count, INFINITY);
    std::vector<Index> index(count);
    {
        nb::gil_scoped_release released;
        find_nearest(points.data(), count, targets.data(), targets.shape(0), dim, reach, limited, distance.data(), index.data());
    }
    return std::make_tuple(to_numpy(std::move(distance)), to_numpy(std::move(index)));
}

auto nearest_of_own(Matrix<double> points, Vector<Index> bounds, Matrix<double> targets, Vector<Index> target_bounds, double reach) {
    check_targets(points, targets, reach);
    check_bounds(bounds, points.shape(0));
    check_bounds(target_bounds, targets.shape(0));
    require(bounds.shape(0) == target_bounds.shape(0), "points and targets are of different numbers of paths");
    const Index dim = points.shape(1), paths = Index(bounds.shape(0)) - 1;
    std::vector<double> distance(points.shape(0));
    std::vector<Index> index(points.shape(0));
    for (Index p = 0; p < paths; ++p) {
        const Index first = bounds(p), target = target_bounds(p), size = target_bounds(p + 1) - target;
        require(size > 0 || bounds(p + 1) == first, "a path has points but no targets");
        find_nearest(points.data() + first * dim, bounds(p + 1) - first, targets.data() + target * dim, size, dim, reach, false,
                     distance.data() + first, index.data() + first);
        for (Index n = first; n < bounds(p + 1); ++n) index[n] += target;
    }
    return to_numpy(std::move(index));
}

void check_neighborhoods(const Matrix<double>& points, const Matrix<double>& centers, double reach) {
    require(points.shape(1) == 3 && centers.shape(1) == 3, "points and centers are not (., 3)");
    require(reach > 0 && std::isfinite(reach), "reach is not positive and finite");
    for (std::size_t k = 0; k < centers.size(); ++k) require(std::isfinite(centers.data()[k]), "a center is not finite");
}

// Call `visit` with the offset from a center to each point within reach of it.
template <class Visit>
void for_each_offset(const Cells& cells, const double* center, double reach, Visit visit) {
    cells.for_each_around(center, reach, [&](Index k) {
        double offset[3];
        cells.offset(k, center, offset);
        if (offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2] <= reach * reach) visit(offset);
    });
}

auto neighborhood_spreads(Matrix<double> points, Matrix<double> centers, double reach) {
    check_neighborhoods(points, centers, reach);
    const Index size = centers.shape(0);
    std::vector<Index> counts(size);
    std::vector<double> means(3 * size), covariances(9 * size);
    const bool few = size <= FEW_CENTERS;
    const Cells cells(points.data(), points.shape(0), 3, reach / CELLS_PER_REACH, [&](const double* p) {
        bool is_near = !few;
        for (Index s = 0; few && s < size; ++s) is_near |= squared_distance(p, centers.data() + 3 * s, 3) <= 1.01 * reach * reach;
        return is_near;
    });
    for (Index s = 0; s < size; ++s) {
        double *mean = means.data() + 3 * s, *covariance = covariances.data() + 9 * s;
        Index count = 0;
        double sum[3] = {0, 0, 0}, square[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};  // in registers
        for_each_offset(cells, centers.data() + 3 * s, reach, [&](const double* offset) {
            ++count;
            for (Index i = 0; i < 3; ++i) {
                sum[i] += offset[i];
                for (Index j = i; j < 3; ++j) square[3 * i + j] += offset[i] * offset[j];
            }
        });
        counts[s] = count;
        std::copy(sum, sum + 3, mean);
        std::copy(square, square + 9, covariance);
        const double number = double(std::max<Index>(counts[s], 1));
        for (Index i = 0; i < 3; ++i) mean[i] /= number;
        for (Index i = 0; i < 3; ++i) {
            for (Index j = i; j < 3; ++j) {
                covariance[3 * i + j] = covariance[3 * i + j] / number - mean[i] * mean[j];
                covariance[3 * j + i] = covariance[3 * i + j];
            }
        }
    }
    return std::make_tuple(to_numpy(std::move(counts)), to_numpy(std::move(means), size, 3), to_numpy(std::move(covariances), size, 9));
}

// The cells that are occupied are kept in a hash table with open addressing, until it is decided whether they are more than wanted.
auto fill_cells(Matrix<double> points, Matrix<double> centers, double reach, Matrix<double> origins, Matrix<double> axes,
                    double edge, double wanted) {
    check_neighborhoods(points, centers, reach);
    const Index size = centers.shape(0);
    require(Index(origins.shape(0)) == size && origins.shape(1) == 3, "origins are not (S, 3)");
    require(Index(axes.shape(0)) == size && axes.shape(1) == 6, "axes are not (S, 6)");
    require(edge > 0 && reach / edge < 1e9, "edge is not positive, or too small for the reach");
    for (std::size_t k = 0; k < origins.size(); ++k) require(std::fabs(origins.data()[k]) <= 10 * reach, "an origin is far away");
    for (std::size_t k = 0; k < axes.size(); ++k) require(std::fabs(axes.data()[k]) <= 1.001, "an axis is not a unit vector");
    std::vector<Index> table;
    std::vector<Byte> is_filled(size);
    constexpr Index EMPTY = INT64_MIN;
    std::vector<double> near;
    const Cells cells(points.data(), points.shape(0), 3, reach / CELLS_PER_REACH);
    for (Index s = 0; s < size; ++s) {
        const double *origin = origins.data() + 3 * s, *axis = axes.data() + 6 * s;
        near.clear();
        for_each_offset(cells, centers.data() + 3 * s, reach, [&](const double* offset) { near.insert(near.end(), offset, offset + 3); });
        std::size_t slots = 16;
        int shift = 60;
        for (; slots < near.size(); --shift) slots *= 2;
        table.assign(slots, EMPTY);
        double occupied = 0.0, left = double(near.size() / 3);
        for (std::size_t n = 0; occupied <= wanted && occupied + left > wanted; n += 3) {
            Index key = 0;
            for (Index k = 0; k < 2; ++k) {
                double along = 0.0;
                for (Index d = 0; d < 3; ++d) along += (near[n + d] - origin[d]) * axis[3 * k + d];
                const Index cell = Index(along / edge);
                key = key * (Index(1) << 31) + (cell - (along / edge < double(cell))) % (Index(1) << 30);
            }
            std::size_t slot = (std::uint64_t(key) * 0x9E3779B97F4A7C15u) >> shift;
            while (table[slot] != EMPTY && table[slot] != key) slot = (slot + 1) & (slots - 1);
            occupied += table[slot] == EMPTY;
            left -= 1;
            table[slot] = key;
        }
        is_filled[s] = occupied > wanted;
    }
    return to_numpy_bool(is_filled);
}

auto lateral_sums(Matrix<double> points, Vector<double> distance, Vector<Index> index, Matrix<double> samples, Matrix<double> normals,
                  Vector<double> reach) {
    const Index count = points.shape(0), size = samples.shape(0);
    require(points.shape(1) == 2 && samples.shape(1) == 2 && normals.shape(1) == 2, "points, samples and normals are not (., 2)");
    require(Index(distance.shape(0)) == count && Index(index.shape(0)) == count, "distance and index are not one per point");
    require(Index(normals.shape(0)) == size && Index(reach.shape(0)) == size, "normals and reach are not one per sample");
    count_visits(count);
    std::vector<double> counts(size), totals(size);
    for (Index n = 0; n < count; ++n) {
        const Index s = index(n);
        require(s >= 0 && s < std::max<Index>(size, 1), "an index lies outside the samples");
        if (size > 0 && distance(n) < reach(s)) {
            counts[s] += 1;
            totals[s] += (points(n, 0) - samples(s, 0)) * normals(s, 0) + (points(n, 1) - samples(s, 1)) * normals(s, 1);
        }
    }
    return std::make_tuple(to_numpy(std::move(counts)), to_numpy(std::move(totals)));
}

}  // namespace

void bind_nearest(nb::module_& m) {
    m.def("nearest", &nearest, "points"_a.noconvert(), "targets"_a.noconvert(), "reach"_a, "limited"_a);
    m.def("nearest_of_own", &nearest_of_own, "points"_a.noconvert(), "bounds"_a.noconvert(), "targets"_a.noconvert(),
          "target_bounds"_a.noconvert(), "reach"_a);
    m.def("lateral_sums", &lateral_sums, "points"_a.noconvert(), "distance"_a.noconvert(), "index"_a.noconvert(),
          "samples"_a.noconvert(), "normals"_a.noconvert(), "reach"_a.noconvert());
    m.def("neighborhood_spreads", &neighborhood_spreads, "points"_a.noconvert(), "centers"_a.noconvert(), "reach"_a);
    m.def("fill_cells", &fill_cells, "points"_a.noconvert(), "centers"_a.noconvert(), "reach"_a, "origins"_a.noconvert(),
          "axes"_a.noconvert(), "edge"_a, "cells"_a);
}
