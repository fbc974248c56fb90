#include "whittaker.h"

namespace {

// Solve banded, symmetric, positive definite equations by Cholesky's factorization within the band. band[i][k] is the entry in row i and
// column i - reach + k, and the factor takes its place, as the result that of the right side. Both begin `reach` rows early, with
// zeros but for a pivot of 1. A reach known to the compiler is three times as fast.
template <Index KnownReach>
void solve(double* band, double* right, Index size, Index given) {
    const Index reach = KnownReach ? KnownReach : given, stride = reach + 1;
    for (Index i = reach; i < size + reach; ++i) {
        double *row = band + i * stride, value = right[i], pivot = row[reach];
        UNROLLED
        for (Index a = 0; a < reach; ++a) {
            const double* other = band + (i - reach + a) * stride;
            double sum = row[a];
            UNROLLED
            for (Index b = 0; b < a; ++b) sum -= row[b] * other[b + reach - a];
            row[a] = sum / other[reach];
            value -= row[a] * right[i - reach + a];
        }
        for (Index k = 0; k < reach; ++k) pivot -= row[k] * row[k];
        require(pivot > 0, "the weights are too few to determine the result");
        row[reach] = std::sqrt(pivot);
        right[i] = value / row[reach];
    }
    for (Index i = size + reach - 1; i >= reach; --i) {
        const double* row = band + i * stride;
        right[i] /= row[reach];
        for (Index a = 0; a < reach; ++a) right[i - reach + a] -= row[a] * right[i];
    }
}

}  // namespace

std::vector<double> whittaker(const double* values, const double* weights, Index count, Index dim, double strength, Index order) {
    if (count <= order || !(strength > 0) || dim == 0) return {values, values + count * dim};
    const Index reach = order * dim, size = count * dim, stride = reach + 1;
    std::vector<double> difference(order + 1, 1.0);  // binomial coefficients with alternating signs
    for (Index k = 1; k <= order; ++k) difference[k] = -difference[k - 1] * double(order - k + 1) / double(k);
    std::vector<double> band((size + reach) * stride), result(size + reach);
    count_visits(size * stride);
    for (Index i = 0; i < reach; ++i) band[i * stride + reach] = 1.0;
    double* const rows = band.data() + reach * stride;
    for (Index a = order; a >= 0; --a) {
        for (Index b = 0; b <= a; ++b) {
            const double product = strength * difference[a] * difference[b];
            double* const to = rows + reach - (a - b) * dim;
            for (Index row = a * dim; row < (count - order + a) * dim; ++row) to[row * stride] += product;
        }
    }
    for (Index p = 0; p < count; ++p) {
        for (Index a = 0; a < dim; ++a) {
            double sum = 0.0;
            for (Index b = 0; b < dim; ++b) {
                const double weight = weights[(p * dim + a) * dim + b];
                sum += weight * values[p * dim + b];
                if (b <= a) rows[(p * dim + a) * stride + reach - (a - b)] += weight;
            }
            result[reach + p * dim + a] = sum;
        }
    }
    const auto solver = reach == 4 ? solve<4> : reach == 6 ? solve<6> : solve<0>;
    solver(band.data(), result.data(), size, reach);
    result.erase(result.begin(), result.begin() + reach);
    return result;
}

namespace {

auto whittaker_smooth(Matrix<double> values, Volume<double> weights, double strength, Index order) {
    const Index count = values.shape(0), dim = values.shape(1);
    require(order >= 1 && order <= 8, "order is not from 1 to 8");
    require(Index(weights.shape(0)) == count && Index(weights.shape(1)) == dim && Index(weights.shape(2)) == dim,
            "weights are not one matrix (D, D) per point");
    auto smooth = whittaker(values.data(), weights.data(), count, dim, strength, order);
    return shaped(std::move(smooth), count, dim);
}

}  // namespace

void bind_whittaker(Module& m) {
    // Smooth a sequence of points by Whittaker's smoother (Eilers, Analytical Chemistry 75, 2003), in time linear in the points.
    //
    // Parameters
    // ----------
    // values
    //     (P, D) float64, the P points
    // weights
    //     (P, D, D) float64, weight matrix of each point, symmetric and positive semidefinite
    // strength
    //     weight of smoothness, in the unit of the weights; 0 leaves the points as they are
    // order
    //     order of the differences that are kept small, 1 to 8
    //
    // Returns
    // -------
    // (P, D) float64; the given points if there are no more than `order`. A ValueError says if the weights are too few to determine
    // the result, such as all zero.
    m.def("whittaker_smooth", &whittaker_smooth, "values"_array, "weights"_array, "strength"_a, "order"_a);
}
