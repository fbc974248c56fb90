// Points in the cells of a sparse grid, and in columns: the two orders in which the neighbors of points are found.
#pragma once

#include "arrays.h"

// Write the lowest coordinate of points (N, D) along each axis, 0 for none; refuse coordinates that are not finite.
void lowest_corner(const double* points, Index count, Index dim, double* low);

// The M occupied cells of a box of cells around N points.
//
// The key of a cell is its row-major index in the box.
struct PointCells {
    std::vector<Index> keys;         // (M,) ascending
    std::vector<Index> shape;        // (D,) cells of the box along each axis
    std::vector<std::int32_t> cell;  // (N,) index in `keys` of the cell of each point
    double total = 0.0;              // cells of the box
    bool is_too_wide = false;        // for the limit: `keys` and `cell` are empty then

    // Sort points (N, D) into cells with the lower corner `origin`; the box ends `margin` cells beyond the last point. It has at most
    // as many cells as the limit, by default about half of those that 64 bits count.
    PointCells(const double* points, Index count, Index dim, const double* origin, double size, Index margin, double limit = 4e18);

    // Return where the points of each cell begin in `order`, (M + 1,), and the points cell by cell, in each in the order given.
    void group(std::vector<std::int32_t>& start, std::vector<std::int32_t>& order) const;

private:
    Index key_of(const double* point, Index dim, const double* origin, double size) const {
        Index key = 0;
        for (Index d = 0; d < dim; ++d) key = key * shape[d] + Index((point[d] - origin[d]) / size);
        return key;
    }
    void number_by_table(const double* points, Index count, Index dim, const double* origin, double size);
    template <class Key>
    void number(const double* points, Index count, Index dim, const double* origin, double size);
};

// Call `visit(i, j)` for the pairs of occupied cells i < j in a box (X, Y, Z) that are at most `reach` steps apart along each axis. The
// outer `reach` layers of the box must be empty.
template <class Visit>
void for_each_near_pair(const PointCells& cells, Index reach, Visit visit) {
    const std::vector<Index>& keys = cells.keys;
    for (Index x = 0; x <= reach; ++x) {
        for (Index y = x ? -reach : 0; y <= reach; ++y) {
            const Index row = (x * cells.shape[1] + y) * cells.shape[2], first = x || y ? row - reach : 1;
            for (std::size_t i = 0, j = 0; i < keys.size(); ++i) {
                while (j < keys.size() && keys[j] < keys[i] + first) ++j;
                for (std::size_t k = j; k < keys.size() && keys[k] <= keys[i] + row + reach; ++k) visit(Index(i), Index(k));
            }
        }
    }
}

// Points in columns: square cells across the two axes along which they extend farthest, so that a column holds few points.
class PointColumns {
public:
    PointColumns(const double* points, Index count);

    struct Near {
        double square;
        std::int32_t index;
        bool operator<(const Near& other) const { return square < other.square || (square == other.square && index < other.index); }
    };

    // Find the `k` points nearest to a position, k <= N, by ascending distance, of equal ones by index.
    void nearest(const double* at, Index k, std::vector<Near>& found) const;

    // Find the points no farther from a position than `reach`, in any order.
    void within(const double* at, double reach, std::vector<Near>& found) const;

private:
    struct Window {
        Index first[2], last[2];  // columns along both axes, both ends included
    };

    Index column_of(double value, Index k) const;
    Window around(const double* at, double reach) const;
    Index points_in(const Window& window) const;
    void collect(const Window& window, const double* at, std::vector<Near>& found) const;

    const double* points_;
    Index axis_[2] = {0, 1}, shape_[2] = {1, 1};
    double low_[2] = {0, 0}, edge_ = 1.0;
    std::vector<std::int32_t> start_, order_;
};
