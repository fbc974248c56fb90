// A part of the True pixels of a mask, evenly distributed.
#include "arrays.h"

namespace {

// The pixels of each column are counted first, so that the columns can be filled row by row.
auto lattice_pixels(Matrix<bool> mask, Index step, Index slope) {
    require(step > 0 && slope >= 0, "step is not positive, or slope is negative");
    const Index height = mask.shape(0), width = mask.shape(1);
    const Byte* bytes = bytes_of(mask);
    std::vector<Index> next(width + 1);
    const auto for_each_kept = [&](auto visit) {
        for (Index row = 0; row < height; ++row) {
            const Byte* pixels = bytes + row * width;
            const Index shift = slope % step * (row % step) % step;
            for (Index u = first_set(pixels, 0, width); u < width; u = first_set(pixels, u, width)) {
                for (; u < width && pixels[u]; ++u) {
                    if ((u + shift) % step == 0) visit(u, row);
                }
            }
        }
    };
    count_visits(height * width / 8);
    std::vector<double> found;
    {
        nb::gil_scoped_release released;
        for_each_kept([&](Index u, Index) { ++next[u + 1]; });
        for (Index u = 0; u < width; ++u) next[u + 1] += next[u];
        found.resize(2 * next[width]);
        for_each_kept([&](Index u, Index row) {
            double* pixel = found.data() + 2 * next[u]++;
            pixel[0] = double(u);
            pixel[1] = double(row);
        });
    }
    const std::size_t count = found.size() / 2;
    return to_numpy(std::move(found), count, 2);
}

}  // namespace

void bind_lattice_pixels(nb::module_& m) {
    m.def("lattice_pixels", &lattice_pixels, "mask"_a.noconvert(), "step"_a, "slope"_a);
}
