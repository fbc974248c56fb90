#include "strand_smoothing.h"

#include "order_statistics.h"

namespace {

using Series = std::vector<double>;

// Return so many values that go on straight beyond the start of a curve, the nearest first.
Series beyond(const Series& start, Index half) {
    const Index third = std::max<Index>(1, half / 3), size = Index(start.size());
    const double near = median(Series(start.begin(), start.begin() + std::min(third, size)));
    const double far = median(Series(start.end() - std::min(third, size), start.end()));
    const double slope = (far - near) / double(std::max<Index>(1, size - third));
    Series line(half);
    for (Index i = 0; i < half; ++i) line[i] = near - slope * (double(i + 1) + double(third - 1) / 2);
    return line;
}

}  // namespace

std::vector<double> running_median(const std::vector<double>& values, Index half) {
    const Index count = Index(values.size());
    Series padded = beyond(Series(values.begin(), values.begin() + half), half);
    std::reverse(padded.begin(), padded.end());
    padded.insert(padded.end(), values.begin(), values.end());
    const Series after = beyond(Series(values.rbegin(), values.rbegin() + half), half);
    padded.insert(padded.end(), after.begin(), after.end());
    Series window(padded.begin(), padded.begin() + 2 * half + 1), medians(count);
    std::sort(window.begin(), window.end());
    for (Index i = 0; i < count; ++i) {
        medians[i] = window[half];
        if (i + 1 == count) break;
        window.erase(std::lower_bound(window.begin(), window.end(), padded[i]));
        const double next = padded[i + 2 * half + 1];
        window.insert(std::upper_bound(window.begin(), window.end(), next), next);
    }
    return medians;
}

std::vector<double> running_mean(const std::vector<double>& values, Index half) {
    const Index count = Index(values.size()), size = 2 * half + 1;
    const auto at = [&](Index i) { return values[std::min(std::max<Index>(i - half, 0), count - 1)]; };
    Series means(count);
    double sum = 0;
    for (Index i = 0; i < size; ++i) sum += at(i);
    for (Index i = 0; i < count; ++i) {
        if (i) sum += at(i + size - 1) - at(i - 1);
        means[i] = sum / double(size);
    }
    return means;
}
