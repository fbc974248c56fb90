// Morphological closing of a sparse grid of cells, each given by its row-major index in a box.
#include "arrays.h"

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

auto close_cells(Vector<Index> keys, Vector<Index> strides, Index iterations) {
    const Index size = keys.shape(0), axes = strides.shape(0);
    require(iterations >= 0 && iterations <= 1000, "iterations are not from 0 to 1000");
    Keys given(size);
    for (Index i = 0; i < size; ++i) {
        given[i] = keys(i);
        require(i == 0 || given[i] > given[i - 1], "keys are not ascending");
    }
    double farthest = size ? double(given.back()) : 0.0;
    for (Index d = 0; d < axes; ++d) {
        require(strides(d) > 0, "a stride is not positive");
        farthest += double(iterations) * double(strides(d));
    }
    require(size == 0 || given.front() >= 0, "a key is negative");
    require(farthest < 9e18, "keys and strides are too large for 64 bits");
    if (iterations == 0) return to_numpy(std::move(given));
    Keys closed = given;
    for (Index d = 0; d < axes; ++d) {
        for (Index k = 0; k < iterations; ++k) closed = dilated(closed, strides(d));
    }
    for (Index d = 0; d < axes; ++d) {
        for (Index k = 0; k < iterations; ++k) closed = eroded(closed, strides(d));
    }
    Keys result(closed.size() + given.size());
    result.resize(std::set_union(closed.begin(), closed.end(), given.begin(), given.end(), result.begin()) - result.begin());
    return to_numpy(std::move(result));
}

}  // namespace

void bind_closing(nb::module_& m) {
    m.def("close_cells", &close_cells, "keys"_a.noconvert(), "strides"_a.noconvert(), "iterations"_a);
}
