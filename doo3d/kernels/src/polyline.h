// Polylines: the sums that other kernels ask for, too. Points are (P, D), one after the other.
#pragma once

#include "arrays.h"

// Return the arc length from the first of P >= 1 points to each.
inline std::vector<double> arc_lengths(const std::vector<double>& points, Index dim) {
    std::vector<double> along(points.size() / dim);
    count_visits(Index(along.size()));
    for (std::size_t i = 1; i < along.size(); ++i) {
        along[i] = along[i - 1] + std::sqrt(squared_distance(points.data() + i * dim, points.data() + (i - 1) * dim, dim));
    }
    return along;
}

// Return the unit tangents at the points by central differences; one-sided at the ends of a polyline that is not closed.
std::vector<double> tangents_along(const double* points, Index dim, const std::vector<Index>& bounds, const std::vector<Byte>& closed);

// Compute the place at an arc length: `points` gives a coordinate by (point, axis), `along` the arc lengths of points from the first on.
// Lengths below 0 or beyond the last of `along` give that point.
template <class Points>
void place_at(const Points& points, const std::vector<double>& along, double at, Index dim, double* place) {
    const Index i = std::upper_bound(along.begin(), along.end(), at) - along.begin() - 1;  // the last point not beyond
    const Index from = std::max<Index>(i, 0);
    const bool is_between = i >= 0 && i + 1 < Index(along.size()) && along[from] != at;
    for (Index d = 0; d < dim; ++d) {
        const double start = points(from, d);
        place[d] = start;
        if (is_between) place[d] = (points(i + 1, d) - start) / (along[i + 1] - along[i]) * (at - along[i]) + start;
    }
}

// Return the values at `known` positions of `count`, and straight lines between; level before the first and after the last.
template <class At>
std::vector<double> interpolated(const At& values, Index count, const std::vector<Index>& known) {
    std::vector<double> filled(count, values(known.back()));
    std::fill(filled.begin(), filled.begin() + known.front(), values(known.front()));
    for (std::size_t k = 0; k + 1 < known.size(); ++k) {
        const Index from = known[k], to = known[k + 1];
        const double slope = (values(to) - values(from)) / double(to - from);
        for (Index i = from; i < to; ++i) filled[i] = slope * double(i - from) + values(from);
    }
    return filled;
}

// Return the points in the opposite order.
inline std::vector<double> reversed(const std::vector<double>& points, Index dim) {
    std::vector<double> backwards(points.size());
    const Index count = Index(points.size()) / dim;
    for (Index i = 0; i < count; ++i) std::copy_n(points.data() + (count - 1 - i) * dim, dim, backwards.data() + i * dim);
    return backwards;
}

// Interpolate the values of polyline c linearly at a position counted in points, NaN beyond the ends of an open one.
inline void interpolate(const Matrix<double>& values, const Vector<Index>& bounds, bool closed, Index c, double at, double* result) {
    const Index count = bounds(c + 1) - bounds(c) - 1, width = values.shape(1);
    std::fill_n(result, width, std::nan(""));
    if (count < 1 || !std::isfinite(at)) return;
    if (closed) {
        at = std::fmod(at, double(count));
        if (at < 0) at += double(count);
    } else if (at < 0 || at > double(count)) {
        return;
    }
    const Index index = std::min(Index(at), count - 1);
    const double t = at - double(index), *first = values.data() + (bounds(c) + index) * width;
    for (Index k = 0; k < width; ++k) result[k] = first[k] * (1 - t) + first[width + k] * t;
}
