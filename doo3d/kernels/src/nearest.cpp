// Nearest targets of many points that lie near them, and sums over the points of each target.
#include "find_nearest.h"

namespace {

void check_targets(const Matrix<double>& points, const Matrix<double>& targets, double reach) {
    const Index dim = points.shape(1);
    require(dim == 2 || dim == 3, "points are neither (N, 2) nor (N, 3)");
    require(Index(targets.shape(1)) == dim, "points and targets have different numbers of coordinates");
    require(reach > 0 && std::isfinite(reach), "reach is not positive and finite");
    for (std::size_t k = 0; k < targets.size(); ++k) require(std::isfinite(targets.data()[k]), "a target is not finite");
}

auto nearest(Matrix<double> points, Matrix<double> targets, double reach, bool limited) {
    check_targets(points, targets, reach);
    const Index count = points.shape(0), dim = points.shape(1);
    std::vector<double> distance(count, INFINITY);
    std::vector<Index> index(count);
    {
        nb::gil_scoped_release released;
        const NearestSearch search{targets.data(), Index(targets.shape(0)), dim, distance.data(), index.data()};
        find_nearest(search, points.data(), count, reach, limited);
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
    ReleasedGil released;
    for (Index p = 0; p < paths; ++p) {
        const Index first = bounds(p), target = target_bounds(p), size = target_bounds(p + 1) - target;
        require(size > 0 || bounds(p + 1) == first, "a path has points but no targets");
        const NearestSearch search{targets.data() + target * dim, size, dim, distance.data() + first, index.data() + first};
        find_nearest(search, points.data() + first * dim, bounds(p + 1) - first, reach, false);
        for (Index n = first; n < bounds(p + 1); ++n) index[n] += target;
    }
    released.end();
    return to_numpy(std::move(index));
}

void check_neighborhoods(const Matrix<double>& points, const Matrix<double>& centers, double reach) {
    require(points.shape(1) == 3 && centers.shape(1) == 3, "points and centers are not (., 3)");
    require(reach > 0 && std::isfinite(reach), "reach is not positive and finite");
    for (std::size_t k = 0; k < centers.size(); ++k) require(std::isfinite(centers.data()[k]), "a center is not finite");
}

// Call `visit` with the offset from a center to each point within reach of it, until it returns false. About half of those in the cells are, and no processor
// foresees which: all are written down, each in the place of the one before if that is too far away.
template <class Visit>
void for_each_offset(const Cells& cells, const double* center, double reach, Visit visit) {
    std::vector<double> offsets;
    bool goes_on = true;
    cells.for_each_run(center, reach, [&](Index begin, Index end) {
        if (!goes_on) return;
        offsets.resize(std::max<std::size_t>(offsets.size(), 3 * (end - begin)));
        double* last = offsets.data();
        for (Index k = begin; k < end; ++k) {
            cells.offset(k, center, last);
            last += last[0] * last[0] + last[1] * last[1] + last[2] * last[2] <= reach * reach ? 3 : 0;
        }
        for (const double* offset = offsets.data(); goes_on && offset != last; offset += 3) goes_on = visit(offset);
    });
}

auto neighborhood_spreads(Matrix<double> points, Matrix<double> centers, double reach) {
    check_neighborhoods(points, centers, reach);
    const Index size = centers.shape(0);
    std::vector<Index> counts(size);
    std::vector<double> means(3 * size), covariances(9 * size);
    ReleasedGil released;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (Index k = 0; k < 3 * size; ++k) {
        low[k % 3] = std::min(low[k % 3], centers.data()[k] - 1.01 * reach);
        high[k % 3] = std::max(high[k % 3], centers.data()[k] + 1.01 * reach);
    }
    const Cells cells(points.data(), points.shape(0), 3, reach / CELLS_PER_REACH, [&](const double* p) {
        return p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1] && p[2] >= low[2] && p[2] <= high[2];
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
            return true;
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
    released.end();
    return std::make_tuple(to_numpy(std::move(counts)), to_numpy(std::move(means), size, 3), to_numpy(std::move(covariances), size, 9));
}

// The cells that are occupied are kept in a hash table with open addressing, until it is decided whether they are more than wanted.
auto fill_cells(Matrix<double> points, Matrix<double> centers, double reach, Vector<Index> counts, Matrix<double> origins,
                Matrix<double> axes, double edge, double wanted) {
    check_neighborhoods(points, centers, reach);
    const Index size = centers.shape(0);
    require(Index(counts.shape(0)) == size, "counts are not (S,)");
    for (Index s = 0; s < size; ++s) require(counts(s) <= Index(points.shape(0)), "a count is larger than the number of points");
    require(wanted >= 0, "cells are negative");
    require(Index(origins.shape(0)) == size && origins.shape(1) == 3, "origins are not (S, 3)");
    require(Index(axes.shape(0)) == size && axes.shape(1) == 6, "axes are not (S, 6)");
    require(edge > 0 && reach / edge < 1e9, "edge is not positive, or too small for the reach");
    for (std::size_t k = 0; k < origins.size(); ++k) require(std::fabs(origins.data()[k]) <= 10 * reach, "an origin is far away");
    for (std::size_t k = 0; k < axes.size(); ++k) require(std::fabs(axes.data()[k]) <= 1.001, "an axis is not a unit vector");
    ReleasedGil released;
    std::vector<Index> table;
    std::vector<Byte> is_filled(size);
    const Index empty = INT64_MIN;  // no key
    const Cells cells(points.data(), points.shape(0), 3, reach / CELLS_PER_REACH);
    for (Index s = 0; s < size; ++s) {
        const double *origin = origins.data() + 3 * s, *axis = axes.data() + 6 * s;
        double occupied = 0.0, left = double(counts(s));
        if (!(left > wanted)) continue;
        std::size_t slots = 16;
        int shift = 60;
        for (; double(slots) < 2 * left; --shift) slots *= 2;
        table.assign(slots, empty);
        for_each_offset(cells, centers.data() + 3 * s, reach, [&](const double* offset) {
            Index key = 0;
            for (Index k = 0; k < 2; ++k) {
                double along = 0.0;
                for (Index d = 0; d < 3; ++d) along += (offset[d] - origin[d]) * axis[3 * k + d];
                const Index cell = Index(along / edge);
                key = key * (Index(1) << 31) + (cell - (along / edge < double(cell))) % (Index(1) << 30);
            }
            std::size_t slot = (std::uint64_t(key) * 0x9E3779B97F4A7C15u) >> shift;
            while (table[slot] != empty && table[slot] != key) slot = (slot + 1) & (slots - 1);
            occupied += table[slot] == empty;
            left -= 1;
            table[slot] = key;
            return occupied <= wanted && occupied + left > wanted;
        });
        is_filled[s] = occupied > wanted;
    }
    released.end();
    return to_numpy_bool(is_filled);
}

// Square cells of which those are marked that hold one of the positions or touch such a cell; their edge is `reach`, or doubled until
// their number is in proportion to the points.
class MarkedCells {
public:
    MarkedCells(const Matrix<double>& positions, double reach, Index points) {
        const Index count = positions.shape(0);
        double most[2] = {-INFINITY, -INFINITY};
        for (Index k = 0; k < 2 * count; ++k) {
            low_[k % 2] = std::min(low_[k % 2], positions.data()[k]);
            most[k % 2] = std::max(most[k % 2], positions.data()[k]);
        }
        if (count == 0) return;
        double edge = reach * (1 + 1e-9);  // against rounding
        while (((most[0] - low_[0]) / edge + 3) * ((most[1] - low_[1]) / edge + 3) > double(points) + 4096.0) edge *= 2;
        per_unit_ = 1 / edge;
        for (Index d = 0; d < 2; ++d) {
            shape_[d] = Index((most[d] - low_[d]) * per_unit_) + 3;
            low_[d] -= edge;
        }
        is_marked_.resize(shape_[0] * shape_[1]);
        count_visits(count);
        for (const double* at = positions.data(); at != positions.data() + 2 * count; at += 2) {
            Byte* marked = &is_marked_[cell(at[0], 0) * shape_[1] + cell(at[1], 1)];
            for (Index row = -1; row <= 1; ++row) std::fill_n(marked + row * shape_[1] - 1, 3, Byte(1));
        }
    }

    bool has(const double* point) const {
        const double row = (point[0] - low_[0]) * per_unit_, column = (point[1] - low_[1]) * per_unit_;
        if (!(row >= 0 && column >= 0 && row < double(shape_[0]) && column < double(shape_[1]))) return false;
        return is_marked_[Index(row) * shape_[1] + Index(column)] != 0;
    }

private:
    // The cell of a position, which the outer cells surround.
    Index cell(double value, Index d) const { return std::min(std::max<Index>(Index((value - low_[d]) * per_unit_), 1), shape_[d] - 2); }

    double low_[2] = {INFINITY, INFINITY}, per_unit_ = 1.0;
    Index shape_[2] = {0, 0};
    std::vector<Byte> is_marked_;
};

auto points_around(Matrix<double> points, Matrix<double> positions, double reach) {
    check_targets(points, positions, reach);
    require(points.shape(1) == 2, "points are not (N, 2)");
    for (std::size_t k = 0; k < positions.size(); ++k) require(std::fabs(positions.data()[k]) < 1e150, "a position is too far away");
    const Index count = points.shape(0);
    std::vector<Index> rows;
    {
        nb::gil_scoped_release released;
        const MarkedCells cells(positions, reach, count);
        count_visits(count);
        for (Index n = 0; n < count; ++n) {
            if (cells.has(points.data() + 2 * n)) rows.push_back(n);
        }
    }
    return to_numpy(std::move(rows));
}

}  // namespace

void bind_nearest(Module& m) {
    // Find the nearest target of each point; of several equally near, the one with the lowest index.
    //
    // Parameters
    // ----------
    // points
    //     (N, D) float64, N points
    // targets
    //     (S, D) float64, S targets, finite, in the unit of the points
    // reach
    //     distance within which the search is quick, in the unit of the points, over 0
    // limited
    //     True leaves out points without a target within `reach`; False compares them with all targets, which is slow
    //
    // Returns
    // -------
    // distance : (N,) float64; infinite for a point that was left out, and for all points if there are no targets
    // index : (N,) int64, index of the nearest target; 0 where the distance is infinite
    //
    // Notes
    // -----
    // The points are sorted into cells, and each target competes for the points in the cells around it. Twenty times as fast as a
    // k-d tree on the pixels of masks.
    m.def("nearest", &nearest, "points"_a.noconvert(), "targets"_a.noconvert(), "reach"_a, "limited"_a);
    // Return the index of the target nearest to each point, of the targets of the same path; of equally near ones the first.
    //
    // Parameters
    // ----------
    // points, targets
    //     (N, D) and (S, D) float64, points and targets of P paths, one path after the other
    // bounds, target_bounds
    //     (P + 1,) int64; path p has points[bounds[p]:bounds[p + 1]], the last entry is N, and so for the targets
    // reach
    //     distance within which most targets are found; it only sets the time taken
    //
    // Returns
    // -------
    // (N,) int64, rows of `targets`. Points that are not finite get the first target of their path.
    m.def("nearest_of_own", &nearest_of_own, "points"_a.noconvert(), "bounds"_a.noconvert(), "targets"_a.noconvert(),
          "target_bounds"_a.noconvert(), "reach"_a);
    // Measure how the points within `reach` of each of several centers spread.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64; points that are not finite are near nothing
    // centers
    //     (S, 3) float64, finite, in the unit of the points
    // reach
    //     greatest distance, in the unit of the points, over 0
    //
    // Returns
    // -------
    // counts : (S,) int64, number of points within reach of each center
    // means : (S, 3) float64, their mean offset from the center; 0 where there are none
    // covariances : (S, 9) float64, their covariance matrix, row by row; 0 where there are none
    m.def("neighborhood_spreads", &neighborhood_spreads, "points"_a.noconvert(), "centers"_a.noconvert(), "reach"_a);
    // Return the points in the plane that may be within `reach` of one of several positions: all that are, and some farther away.
    //
    // Parameters
    // ----------
    // points
    //     (N, 2) float64; points that are not finite are near nothing
    // positions
    //     (P, 2) float64, finite, in the unit of the points
    // reach
    //     distance, in the unit of the points, over 0
    //
    // Returns
    // -------
    // (K,) int64, their indices, ascending; none is farther than 8 `reach` unless the positions spread over more than 64 `reach`
    m.def("points_around", &points_around, "points"_a.noconvert(), "positions"_a.noconvert(), "reach"_a);
    // Tell whether the points within `reach` of each center, projected to a plane, occupy more than so many square cells of it.
    //
    // Parameters
    // ----------
    // points, centers, reach
    //     as for `neighborhood_spreads`
    // counts
    //     (S,) int64, number of points within reach of each center
    // origins
    //     (S, 3) float64, offset from each center to a corner of the cells, at most 10 times `reach` along each axis
    // axes
    //     (S, 6) float64, two perpendicular unit vectors that span each plane, one after the other
    // edge
    //     edge of a cell, in the unit of the points, over 0
    // cells
    //     number of cells, not negative
    //
    // Returns
    // -------
    // (S,) bool
    m.def("fill_cells", &fill_cells, "points"_a.noconvert(), "centers"_a.noconvert(), "reach"_a, "counts"_a.noconvert(), "origins"_a.noconvert(),
          "axes"_a.noconvert(), "edge"_a, "cells"_a);
}
