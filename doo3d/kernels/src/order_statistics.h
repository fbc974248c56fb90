// Medians and other values at a rank.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

// Standard deviations per median absolute deviation of normally distributed errors: 1 / 0.6745, the upper quartile.
constexpr double MAD_TO_DEVIATION = 1.4826;

// Return the value at a rank, from 0 on; the values are reordered so that no lower one is behind it.
template <class T>
T value_at(std::vector<T>& values, std::size_t rank) {
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[rank];
}

// Return the median of values, at least one; of an even number the mean of the middle two, as NumPy takes it.
template <class T>
T median(std::vector<T> values) {
    const std::size_t half = values.size() / 2;
    const T upper = value_at(values, half);
    return values.size() % 2 ? upper : (*std::max_element(values.begin(), values.begin() + half) + upper) / 2;
}

// Return the median of the values that are finite, or another value where there are none.
inline double finite_median(std::vector<double> values, double otherwise) {
    values.erase(std::remove_if(values.begin(), values.end(), [](double value) { return !std::isfinite(value); }), values.end());
    return values.empty() ? otherwise : median(std::move(values));
}

// Return the value below which a share of the values lies, 0 to 1; between two values as NumPy's percentile.
template <class T>
T quantile(std::vector<T> values, double share) {
    const double at = share * double(values.size() - 1);
    const auto rank = std::size_t(at);
    const T first = value_at(values, rank);
    if (rank + 1 == values.size()) return first;
    return first + T(at - double(rank)) * (*std::min_element(values.begin() + rank + 1, values.end()) - first);
}

// Return the median of the absolute values, at least one.
inline double absolute_median(std::vector<double> values) {
    for (double& value : values) value = std::fabs(value);
    return median(std::move(values));
}
