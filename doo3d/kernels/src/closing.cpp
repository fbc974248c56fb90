// Morphological closing of a sparse grid of cells, each given by its row-major index in a box.
#include "closing.h"

#include <algorithm>

namespace {

using Keys = std::vector<Index>;

// Return the ascending keys that are in `keys` or `stride` away from one of them.
Keys dilated(const Keys& keys, Index stride) {
    const std::size_t size = keys.size();
    count_visits(size);
    Keys result;
    result.reserve(3 * size);
    for (std::size_t below = 0, same = 0, above = 0; above < size;) {
        // the three sequences key - stride, key and key + stride; the last ends last
        Index least = keys[above] + stride;
        if (same < size) least = std::min(least, keys[same]);
        if (below < size) least = std::min(least, keys[below] - stride);
        result.push_back(least);
        below += below < size && keys[below] - stride == least;
        same += same < size && keys[same] == least;
        above += keys[above] + stride == least;
    }
    return result;
}

// Return the keys that have keys `stride` away on either side.
Keys eroded(const Keys& keys, Index stride) {
    const std::size_t size = keys.size();
    count_visits(size);
    Keys result;
    for (std::size_t i = 0, below = 0, above = 0; i < size; ++i) {
        while (keys[below] < keys[i] - stride) ++below;
        while (above < size && keys[above] < keys[i] + stride) ++above;
        if (above < size && keys[below] == keys[i] - stride && keys[above] == keys[i] + stride) result.push_back(keys[i]);
    }
    return result;
}

}  // namespace

std::vector<Index> close_cells(const std::vector<Index>& keys, const std::vector<Index>& shape, Index iterations) {
    require(iterations >= 0 && iterations <= 1000, "iterations are not from 0 to 1000");
    if (iterations == 0 || keys.empty()) return keys;
    double cells = 1.0;  // of the box, and of the layers that the steps may reach beyond it
    for (const Index side : shape) cells *= double(side + iterations);
    require(cells < 9e18, "the box has more cells than 64 bits count");
    Keys closed = keys;
    for (const auto step : {dilated, eroded}) {
        Index stride = 1;
        for (std::size_t d = shape.size(); d-- > 0; stride *= shape[d]) {
            for (Index k = 0; k < iterations; ++k) closed = step(closed, stride);
        }
    }
    Keys result(closed.size() + keys.size());
    result.resize(std::set_union(closed.begin(), closed.end(), keys.begin(), keys.end(), result.begin()) - result.begin());
    return result;
}
