// Medians.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

// Standard deviations per median absolute deviation of normally distributed errors: 1 / 0.6745, the upper quartile.
constexpr double MAD_TO_DEVIATION = 1.4826;

// Find the value at a rank of many values, and at the rank before it, between two of 65 values drawn evenly, a sixth of them apart on
// either side of their median; return false where they do not lie there.
template <class T>
bool find_ranks(const std::vector<T>& values, std::size_t rank, T& before, T& at) {
    std::array<T, 65> some;
    for (std::size_t k = 0; k < some.size(); ++k) some[k] = values[k * (values.size() / some.size())];
    std::sort(some.begin(), some.end());
    const T low = some[some.size() / 3], high = some[some.size() - 1 - some.size() / 3];
    std::vector<T> between(values.size());
    std::size_t below = 0, count = 0;
    for (const T value : values) {  // without a branch: no processor foresees it
        between[count] = value;
        count += (value >= low) & (value <= high);
        below += value < low;
    }
    if (rank < below + 1 || rank >= below + count) return false;
    const auto middle = between.begin() + (rank - below);
    std::nth_element(between.begin(), middle, between.begin() + count);
    at = *middle;
    before = *std::max_element(between.begin(), middle);
    return true;
}

// Of an even number of values the mean of the middle two, as NumPy takes it; the values, at least one, may be reordered.
template <class T>
T median(std::vector<T>& values) {
    T before, at;
    if (values.size() >= 1024 && find_ranks(values, values.size() / 2, before, at)) return values.size() % 2 ? at : (before + at) / 2;
    const auto middle = values.begin() + values.size() / 2;
    std::nth_element(values.begin(), middle, values.end());
    return values.size() % 2 ? *middle : (*std::max_element(values.begin(), middle) + *middle) / 2;
}

// Tell whether the median of values, at least one, is nearer to 0 than a limit: mostly counting them is enough.
template <class T>
bool median_is_within(std::vector<T>& values, T limit) {
    std::size_t low = 0, high = 0;  // values below the limit, and above minus the limit
    for (const T value : values) {
        low += value < limit;
        high += value > -limit;
    }
    const std::size_t half = values.size() / 2;  // in ascending order values [half], of an even number [half - 1], too, are the middle
    if (low > half && high > half) return true;
    return low + half >= values.size() && high + half >= values.size() && std::fabs(median(values)) < limit;
}
