// Medians.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

// Return the value at a rank of many values, and at the rank before it, which lie between two of them drawn evenly; false where they
// do not.
template <class T>
bool find_ranks(const std::vector<T>& values, std::size_t rank, T& before, T& at) {
    constexpr std::size_t drawn = 65, apart = 10;
    T some[drawn];
    for (std::size_t k = 0; k < drawn; ++k) some[k] = values[k * (values.size() / drawn)];
    std::sort(some, some + drawn);
    const T low = some[drawn / 2 - apart], high = some[drawn / 2 + apart];
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
