// Points sorted into square cells, to find those near a position.
#pragma once

#include "arrays.h"

#include <algorithm>

// Cells per `reach` along each axis, in which the points are sorted.
inline constexpr double CELLS_PER_REACH = 3.0;

// The points sorted into square cells along the two axes in which they extend farthest: coordinates cell by cell, with the least
// squared distance so far and whose it is. The edge of the cells is doubled until their number is in proportion to the points.
class Cells {
public:
    Cells(const double* points, Index count, Index dim, double edge, double cells_per_point = 1)
        : Cells(points, count, dim, edge, [](const double*) { return true; }, cells_per_point) {}

    // The same cells, without the points of which `is_wanted` is false.
    template <class IsWanted>
    Cells(const double* points, Index count, Index dim, double edge, IsWanted is_wanted, double cells_per_point = 1) : dim_(dim) {
        visits_.count = 2 * count;
        double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}, extent[3] = {0, 0, 0};
        if (dim == 2) {
            bound<2>(points, count, low, high);
        } else {
            bound<3>(points, count, low, high);
        }
        for (Index d = 0; d < dim; ++d) extent[d] = high[d] - low[d];
        const Index shortest = dim == 2 ? 2 : Index(std::min_element(extent, extent + 3) - extent);
        for (Index d = 0, k = 0; d < dim; ++d) {
            if (d != shortest) axis_[k++] = d;
        }
        const double rows = extent[axis_[0]], columns = extent[axis_[1]];
        while ((std::floor(rows / edge) + 1) * (std::floor(columns / edge) + 1) > cells_per_point * double(count) + 4096.0) edge *= 2;
        per_unit_ = 1 / edge;
        for (Index k = 0; k < 2; ++k) {
            low_[k] = low[axis_[k]];
            shape_[k] = Index(extent[axis_[k]] * per_unit_) + 1;
        }
        start_.assign(shape_[0] * shape_[1] + 2, 0);
        std::vector<std::int32_t> cell(count, -1);
        for (Index n = 0; n < count; ++n) {
            const double* p = points + n * dim;
            if (!finite(p) || !is_wanted(p)) continue;
            cell[n] = std::int32_t(Index((p[axis_[0]] - low_[0]) * per_unit_) * shape_[1] + Index((p[axis_[1]] - low_[1]) * per_unit_));
            ++start_[cell[n] + 2];
        }
        for (std::size_t c = 2; c < start_.size(); ++c) start_[c] += start_[c - 1];
        size = start_.back();
        order.resize(size);
        position_.resize(size * 3);
        for (Index n = 0; n < count; ++n) {
            if (cell[n] < 0) continue;
            const Index k = start_[cell[n] + 1]++;
            order[k] = std::int32_t(n);
            for (Index d = 0; d < dim; ++d) position_[d * size + k] = points[n * dim + d];
        }
    }

    // Start a competition of targets for the points.
    void start() {
        square.assign(size, INFINITY);
        owner.assign(size, 0);
    }

    // Let each of some targets compete for the points in the cells within `reach` of it; of equally near ones the first wins.
    void offer(const double* targets, Index count, double reach);

    // Call `visit` with each sorted point in the cells within `reach` of a position.
    template <class Visit>
    void for_each_around(const double* at, double reach, Visit visit) const {
        for_each_run(at, reach, [&](Index begin, Index end) {
            for (Index k = begin; k < end; ++k) visit(k);
        });
    }

    // Call `visit` with the first and one more than the last point of each row of cells within `reach` of a position.
    template <class Visit>
    void for_each_run(const double* position, double reach, Visit visit) const {
        Index first[2], last[2];
        find_around(position, reach, first, last);
        for (Index row = first[0]; row < last[0] && first[1] < last[1]; ++row) {
            const Index begin = start_[row * shape_[1] + first[1]], end = start_[row * shape_[1] + last[1]];
            visits_.count += end - begin;
            visit(begin, end);
        }
    }

    // Write the offset from a position in space to a sorted point.
    void offset(Index k, const double* from, double* result) const {
        for (Index d = 0; d < 3; ++d) result[d] = position_[d * size + k] - from[d];
    }

    Index size = 0;                    // number of sorted points; those that are not finite are left out
    std::vector<std::int32_t> order;   // the index of each
    std::vector<double> square;        // least squared distance from a target so far
    std::vector<Index> owner;          // whose it is

private:
    // Find the first and one more than the last of the rows and columns of cells within `reach` of a position.
    void find_around(const double* position, double reach, Index* first, Index* last) const {
        for (Index k = 0; k < 2; ++k) {
            const double cells = double(shape_[k]), at = position[axis_[k]] - low_[k];
            const double from = (at - reach) * per_unit_, to = (at + reach) * per_unit_;
            first[k] = Index(std::min(std::max(from, 0.0), cells));
            last[k] = to >= 0.0 ? std::min(Index(std::min(to, cells)) + 1, shape_[k]) : 0;
        }
    }

    bool finite(const double* p) const { return (p[0] - p[0]) + (p[1] - p[1]) + (dim_ == 3 ? p[2] - p[2] : 0.0) == 0.0; }

    // Find the lowest and the highest coordinates of finite points; of none both stay.
    template <int D>
    void bound(const double* points, Index count, double* low, double* high) const {
        double least[D], most[D];
        std::fill(least, least + D, INFINITY);
        std::fill(most, most + D, -INFINITY);
        for (const double* p = points; p != points + count * D; p += D) {
            if (!finite(p)) continue;
            for (int d = 0; d < D; ++d) {
                least[d] = p[d] < least[d] ? p[d] : least[d];
                most[d] = p[d] > most[d] ? p[d] : most[d];
            }
        }
        if (!(least[0] <= most[0])) return;
        std::copy(least, least + D, low);
        std::copy(most, most + D, high);
    }

    Index dim_;
    double per_unit_ = 1.0;
    Index axis_[2] = {0, 1};
    double low_[2] = {0, 0};
    Index shape_[2] = {1, 1};
    std::vector<std::int32_t> start_;  // of each cell, the first of its points
    std::vector<double> position_;     // axis by axis; in the plane the third is 0
    mutable Visits visits_;
};
