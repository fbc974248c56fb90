// Polylines: the small sums that every stage asks for thousands of times.
#include "arrays.h"

namespace {

using Points = StridedMatrix<double>;  // (P, D): slices, reversed and read-only arrays, too
using Values = Vector<double>;

double step_length(const Points& points, Index from, Index to) {
    double square = 0.0;
    for (std::size_t d = 0; d < points.shape(1); ++d) {
        const double step = points(to, d) - points(from, d);
        square += step * step;
    }
    return std::sqrt(square);
}

auto steps(Points points, bool closed) {
    const Index count = points.shape(0);
    count_visits(count);
    std::vector<double> lengths(closed ? count : (count > 0 ? count - 1 : 0));
    for (Index i = 0; i < Index(lengths.size()); ++i) lengths[i] = step_length(points, i, i + 1 < count ? i + 1 : 0);
    return to_numpy(std::move(lengths));
}

auto arc_length(Points points) {
    count_visits(Index(points.shape(0)));
    std::vector<double> along(points.shape(0));
    for (Index i = 1; i < Index(along.size()); ++i) along[i] = along[i - 1] + step_length(points, i - 1, i);
    return to_numpy(std::move(along));
}

auto moving_mean(Points points, Index half_width) {
    const Index count = points.shape(0), dim = points.shape(1);
    count_visits(count);
    std::vector<double> total((count + 1) * dim), means(count * dim);
    for (Index i = 0; i < count; ++i) {
        for (Index d = 0; d < dim; ++d) total[(i + 1) * dim + d] = total[i * dim + d] + points(i, d);
    }
    for (Index i = 0; i < count; ++i) {
        const Index width = least(least(i, count - 1 - i), half_width);
        for (Index d = 0; d < dim; ++d) {
            means[i * dim + d] = (total[(i + width + 1) * dim + d] - total[(i - width) * dim + d]) / double(2 * width + 1);
        }
    }
    return to_numpy(std::move(means), count, dim);
}

auto unit_rows(Points vectors) {
    const Index count = vectors.shape(0), dim = vectors.shape(1);
    count_visits(count);
    std::vector<double> units(count * dim);
    for (Index n = 0; n < count; ++n) {
        double square = 0.0;
        for (Index d = 0; d < dim; ++d) square += vectors(n, d) * vectors(n, d);
        if (square > 0) {
            const double norm = std::sqrt(square);
            for (Index d = 0; d < dim; ++d) units[n * dim + d] = vectors(n, d) / norm;
        }
    }
    return to_numpy(std::move(units), count, dim);
}

auto unit(Values vector) {
    const Index dim = vector.shape(0);
    std::vector<double> result(dim);
    double square = 0.0;
    for (Index d = 0; d < dim; ++d) square += vector(d) * vector(d);
    const double norm = std::sqrt(square);
    if (norm > 0) {
        for (Index d = 0; d < dim; ++d) result[d] = vector(d) / norm;
    }
    return to_numpy(std::move(result));
}

}  // namespace

void bind_polyline(nb::module_& m) {
    m.def("steps", &steps, "points"_a.noconvert(), "closed"_a = false);
    m.def("arc_length", &arc_length, "points"_a.noconvert());
    m.def("moving_mean", &moving_mean, "points"_a.noconvert(), "half_width"_a);
    m.def("unit_rows", &unit_rows, "vectors"_a.noconvert());
    m.def("unit", &unit, "vector"_a.noconvert());
}
