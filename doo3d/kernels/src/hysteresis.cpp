// Hysteresis threshold of an image.
#include "arrays.h"

#include <algorithm>

namespace {

auto hysteresis(Matrix<float> image, float low, float high) {
    require(low <= high, "low is above high");
    const Index height = image.shape(0), width = image.shape(1);
    const float* values = image.data();
    auto* selected = new bool[std::max<Index>(height * width, 1)]();
    nb::capsule owner(selected, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    std::vector<Index> stack;
    for (Index seed = 0; seed < height * width; ++seed) {
        if (!(values[seed] > high) || selected[seed]) continue;
        selected[seed] = true;
        stack.push_back(seed);
        while (!stack.empty()) {
            const Index pixel = stack.back(), row = pixel / width, column = pixel % width;
            stack.pop_back();
            for (Index r = std::max<Index>(row - 1, 0); r < std::min(row + 2, height); ++r) {
                for (Index c = std::max<Index>(column - 1, 0); c < std::min(column + 2, width); ++c) {
                    const Index neighbor = r * width + c;
                    if (!selected[neighbor] && values[neighbor] > low) {
                        selected[neighbor] = true;
                        stack.push_back(neighbor);
                    }
                }
            }
        }
    }
    return MatrixResult<bool>(selected, {std::size_t(height), std::size_t(width)}, owner);
}

}  // namespace

void bind_hysteresis(nb::module_& m) { m.def("hysteresis", &hysteresis, "image"_a.noconvert(), "low"_a, "high"_a); }
