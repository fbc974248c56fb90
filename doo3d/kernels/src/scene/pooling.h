// Sums over neighboring samples of a path.
#pragma once

#include "arrays.h"

// Return at each sample the sum of the values at the sample and at up to `half` neighbors on either side on the same path.
inline std::vector<double> pooled(const double* values, const std::vector<Index>& path, Index half) {
    const Index size = Index(path.size());
    half = std::min(half, size);
    count_visits(size);
    std::vector<double> total(size + 1), sums(size);
    for (Index s = 0; s < size; ++s) total[s + 1] = total[s] + values[s];
    for (Index start = 0; start < size;) {
        Index end = start + 1;
        while (end < size && path[end] == path[start]) ++end;
        for (Index s = start; s < end; ++s) sums[s] = total[std::min(s + half + 1, end)] - total[std::max(s - half, start)];
        start = end;
    }
    return sums;
}
