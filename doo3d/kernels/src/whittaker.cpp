#include "whittaker.h"

#include <algorithm>

// The normal equations are banded, symmetric and positive definite: they are solved by Cholesky's factorization within the band.
// band[i][k] is the entry in row i and column i - reach + k, and the factor takes its place.
std::vector<double> whittaker(const double* values, const double* weights, Index count, Index dim, double strength, Index order) {
    std::vector<double> result(values, values + count * dim);
    if (count <= order || !(strength > 0) || dim == 0) return result;
    const Index reach = order * dim, size = count * dim, stride = reach + 1;
    std::vector<double> difference(order + 1, 1.0);  // binomial coefficients with alternating signs
    for (Index k = 1; k <= order; ++k) difference[k] = -difference[k - 1] * double(order - k + 1) / double(k);
    std::vector<double> band(size * stride);
    count_visits(size * stride);
    for (Index first = 0; first + order < count; ++first) {
        for (Index a = 0; a <= order; ++a) {
            for (Index b = 0; b <= a; ++b) {
                const double product = strength * difference[a] * difference[b];
                for (Index d = 0; d < dim; ++d) band[((first + a) * dim + d) * stride + reach - (a - b) * dim] += product;
            }
        }
    }
    for (Index p = 0; p < count; ++p) {
        for (Index a = 0; a < dim; ++a) {
            double sum = 0.0;
            for (Index b = 0; b < dim; ++b) {
                const double weight = weights[(p * dim + a) * dim + b];
                sum += weight * values[p * dim + b];
                if (b <= a) band[(p * dim + a) * stride + reach - (a - b)] += weight;
            }
            result[p * dim + a] = sum;
        }
    }
    for (Index i = 0; i < size; ++i) {
        double* row = band.data() + i * stride;
        double right = result[i];
        for (Index j = std::max<Index>(i - reach, 0); j < i; ++j) {
            const double* other = band.data() + j * stride;
            double sum = row[j - i + reach];
            for (Index k = std::max<Index>(i - reach, 0); k < j; ++k) {
                if (k >= j - reach) sum -= row[k - i + reach] * other[k - j + reach];
            }
            row[j - i + reach] = sum / other[reach];
            right -= row[j - i + reach] * result[j];
        }
        double pivot = row[reach];
        for (Index k = 0; k < reach; ++k) pivot -= row[k] * row[k];
        require(pivot > 0, "the weights are too few to determine the result");
        row[reach] = std::sqrt(pivot);
        result[i] = right / row[reach];
    }
    for (Index i = size - 1; i >= 0; --i) {
        const double* row = band.data() + i * stride;
        result[i] /= row[reach];
        for (Index j = std::max<Index>(i - reach, 0); j < i; ++j) result[j] -= row[j - i + reach] * result[i];
    }
    return result;
}

namespace {

auto whittaker_smooth(Matrix<double> values, Volume<double> weights, double strength, Index order) {
    const Index count = values.shape(0), dim = values.shape(1);
    require(order >= 1 && order <= 8, "order is not from 1 to 8");
    require(Index(weights.shape(0)) == count && Index(weights.shape(1)) == dim && Index(weights.shape(2)) == dim,
            "weights are not one matrix (D, D) per point");
    return to_numpy(whittaker(values.data(), weights.data(), count, dim, strength, order), count, dim);
}

}  // namespace

void bind_whittaker(nb::module_& m) {
    m.def("whittaker_smooth", &whittaker_smooth, "values"_a.noconvert(), "weights"_a.noconvert(), "strength"_a, "order"_a);
}
