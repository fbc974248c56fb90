// What the kernels for colors share: places between the pixels of a smaller image, and the blur that removes the camera's noise.
#pragma once

#include "arrays.h"

#include <algorithm>
#include <array>

constexpr std::array<float, 3> BLUR = {0.49915f, 0.22851f, 0.02192f};  // Gaussian of 0.8 px: the pixel, and those 1 and 2 away

// Two pixels of a smaller image, and the share of the second one.
struct Between {
    Index first, second;
    float share;
};

// Return where the pixels of a row or column lie between those of one that is some times shorter.
inline std::vector<Between> positions(Index size, Index small) {
    std::vector<Between> result(size);
    for (Index i = 0; i < size; ++i) {
        const float at = std::min(std::max((i + 0.5f) * small / size - 0.5f, 0.0f), float(small - 1));
        const Index first = Index(at);
        result[i] = {first, std::min(first + 1, small - 1), at - float(first)};
    }
    return result;
}
