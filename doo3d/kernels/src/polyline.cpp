// Polylines: the small sums that every stage asks for thousands of times.
#include "polyline.h"

std::vector<double> tangents_along(const double* points, Index dim, const std::vector<Index>& bounds, const std::vector<Byte>& closed) {
    std::vector<double> tangents(bounds.back() * dim);
    count_visits(bounds.back());
    for (std::size_t c = 0; c < closed.size(); ++c) {
        const Index first = bounds[c], last = bounds[c + 1] - 1;
        for (Index i = first; i <= last; ++i) {
            const Index before = i > first ? i - 1 : (closed[c] ? last : first), after = i < last ? i + 1 : (closed[c] ? first : last);
            double square = 0.0;
            for (Index d = 0; d < dim; ++d) {
                const double step = points[after * dim + d] - points[before * dim + d];
                tangents[i * dim + d] = step;
                square += step * step;
            }
            const double norm = square > 0 ? std::sqrt(square) : 1.0;
            for (Index d = 0; d < dim; ++d) tangents[i * dim + d] /= norm;
        }
    }
    return tangents;
}
