#include "parabola.h"

#include "order_statistics.h"

namespace {

// Return the coefficients of the least-squares parabola through the values that count, by Gauss elimination of its normal equations.
std::array<double, 3> fit_parabola(const std::vector<double>& at, const std::vector<double>& values, const std::vector<Byte>& good) {
    double a[3][4] = {{1e-6}, {0, 1e-6}, {0, 0, 1e-6}};
    for (std::size_t s = 0; s < at.size(); ++s) {
        if (!good[s]) continue;
        const double powers[4] = {1.0, at[s], at[s] * at[s], values[s]};
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 4; ++j) a[i][j] += powers[i] * powers[j];
        }
    }
    for (int i = 0; i < 3; ++i) {
        for (int k = i + 1; k < 3; ++k) {
            const double factor = a[k][i] / a[i][i];
            for (int j = i; j < 4; ++j) a[k][j] -= factor * a[i][j];
        }
    }
    std::array<double, 3> fit{};
    for (int i = 2; i >= 0; --i) {
        double rest = a[i][3];
        for (int j = i + 1; j < 3; ++j) rest -= a[i][j] * fit[j];
        fit[i] = rest / a[i][i];
    }
    return fit;
}

}  // namespace

double parabola_at_zero(const double* along, const std::vector<double>& values, double deviations, Index min_measured) {
    const std::size_t size = values.size();
    double most = 0.0, value = std::nan("");
    std::vector<double> at(along, along + size), residual(size);
    std::vector<Byte> good(size);
    for (const double each : at) most = std::max(most, std::fabs(each));
    for (std::size_t s = 0; s < size; ++s) {
        at[s] /= most;
        good[s] = std::isfinite(values[s]);
    }
    for (int round = 0; round < 2; ++round) {
        const auto fit = fit_parabola(at, values, good);
        value = fit[0];
        for (std::size_t s = 0; s < size; ++s) {
            residual[s] = good[s] ? std::fabs(fit[0] + at[s] * fit[1] + at[s] * at[s] * fit[2] - values[s]) : std::nan("");
        }
        const double median = finite_median(residual, NAN), limit = deviations * (median < 1e-9 ? 1e-9 : median);
        for (std::size_t s = 0; s < size; ++s) good[s] = good[s] && residual[s] <= limit;
    }
    Index before = 0, after = 0, measured = 0;
    for (std::size_t s = 0; s < size; ++s) {
        before += good[s] && along[s] < 0;
        after += good[s] && along[s] > 0;
        measured += good[s];
    }
    return before && after && measured >= min_measured ? value : std::nan("");
}
