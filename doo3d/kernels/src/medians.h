// Medians.
#pragma once

#include <algorithm>
#include <vector>

// Of an even number of values the mean of the middle two, as NumPy takes it; the values, at least one, are reordered.
template <class T>
T median(std::vector<T>& values) {
    const auto middle = values.begin() + values.size() / 2;
    std::nth_element(values.begin(), middle, values.end());
    return values.size() % 2 ? *middle : (*std::max_element(values.begin(), middle) + *middle) / 2;
}
