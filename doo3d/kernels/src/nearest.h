// The nearest of some targets, found in a k-d tree.
#pragma once

#include "arrays.h"

// A k-d tree over targets (S, D), D = 2 or 3, which are finite: each node splits its targets at the middle one along the axis on
// which they extend farthest.
class NearestTarget {
public:
    NearestTarget(const double* targets, Index count, Index dim)
        : dim_(dim), index_(count), axis_(count), position_(targets, targets + count * dim) {
        std::iota(index_.begin(), index_.end(), 0);
        split(targets, 0, count);
        for (Index k = 0; k < count; ++k) std::copy_n(targets + index_[k] * dim, dim, &position_[k * dim]);
    }

    // A target, and the square of its distance.
    struct Near {
        double square;
        Index index;
    };

    // Return the wanted target that is nearest to a position and no farther than a given one, of equally near ones the first.
    template <class IsWanted>
    Near find(const double* at, Near near, IsWanted is_wanted) const {
        const Index count = Index(index_.size());
        dim_ == 2 ? search<2>(at, 0, count, near, is_wanted) : search<3>(at, 0, count, near, is_wanted);
        return near;
    }
    Near find(const double* at, Near near) const {
        return find(at, near, [](Index) { return true; });
    }

private:
    static constexpr Index LEAF = 8;  // targets that are compared one by one

    void split(const double* targets, Index first, Index last) {
        if (last - first <= LEAF) return;
        const auto along = [&](Index d) {
            return [=, dim = dim_](Index i, Index j) { return targets[i * dim + d] < targets[j * dim + d]; };
        };
        const auto begin = index_.begin() + first, end = index_.begin() + last, middle = begin + (last - first) / 2;
        double widest = -1.0;
        for (Index d = 0; d < dim_; ++d) {
            const auto [low, high] = std::minmax_element(begin, end, along(d));
            const double extent = targets[*high * dim_ + d] - targets[*low * dim_ + d];
            if (extent > widest) axis_[middle - index_.begin()] = d;
            widest = std::max(widest, extent);
        }
        std::nth_element(begin, middle, end, along(axis_[middle - index_.begin()]));
        split(targets, first, middle - index_.begin());
        split(targets, middle - index_.begin() + 1, last);
    }

    template <Index D, class IsWanted>
    void compare(const double* at, Index k, Near& near, IsWanted is_wanted) const {
        const double square = squared_distance(at, &position_[k * D], D);
        const bool is_nearer = square < near.square || (square == near.square && index_[k] < near.index);
        if (is_nearer && is_wanted(index_[k])) near = {square, index_[k]};
    }

    template <Index D, class IsWanted>
    void search(const double* at, Index first, Index last, Near& near, IsWanted is_wanted) const {
        while (last - first > LEAF) {
            const Index middle = first + (last - first) / 2;
            const double beyond = at[axis_[middle]] - position_[middle * D + axis_[middle]];
            compare<D>(at, middle, near, is_wanted);
            beyond < 0 ? search<D>(at, first, middle, near, is_wanted) : search<D>(at, middle + 1, last, near, is_wanted);
            if (!(beyond * beyond <= near.square)) return;
            beyond < 0 ? first = middle + 1 : last = middle;
        }
        for (Index k = first; k < last; ++k) compare<D>(at, k, near, is_wanted);
    }

    Index dim_;
    std::vector<Index> index_, axis_;  // of the targets in the order of the tree, and of the nodes in their middles
    std::vector<double> position_;
};

// Of each of N points, the distance and the index of the nearest target; infinite and 0 where none is near.
struct NearestOfPoints {
    std::vector<double> distance;
    std::vector<Index> index;

    // Find the targets within `reach` of the points. Points come row by row: the target of the one before is mostly near.
    NearestOfPoints(const double* points, Index count, const double* targets, Index size, Index dim, double reach)
        : distance(count, INFINITY), index(count) {
        const NearestTarget tree(targets, size, dim);
        count_visits(count + size);
        Index before = 0;
        for (Index n = 0; n < count && size > 0; ++n) {
            const double* at = points + n * dim;
            const double to_before = squared_distance(at, targets + before * dim, dim), limit = reach * reach;
            const auto [square, nearest] = to_before <= limit ? tree.find(at, {to_before, before}) : tree.find(at, {limit, size});
            if (!(nearest < size)) continue;
            distance[n] = std::sqrt(square);
            index[n] = before = nearest;
        }
    }
};
