// The pixels near the pixels of a mask.
#include "frame_facts.h"

#include <algorithm>

namespace {

// The chamfer distance of a step on the grid, px: by sides and knight's moves, or by corners and knight's moves.
float chamfer_length(Index dx, Index dy) {
    const Index far = std::max(dx, dy), near = std::min(dx, dy);
    const Index knights = std::min(near, far - near);
    return float(double(knights) * double(KNIGHT) + double(near - knights) * double(CORNER) + double(far - near - knights) * double(SIDE));
}

// Every run is widened in its own row and in those above and below, in each as far as the disc reaches there.
auto near_mask(Matrix<bool> mask, double reach, bool inclusive) {
    const Index height = mask.shape(0), width = mask.shape(1);
    require(reach >= 0, "reach is negative");
    const Byte* bytes = bytes_of(mask);
    auto* image = new bool[std::max<Index>(height * width, 1)]();
    nb::capsule owner(image, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    {
        nb::gil_scoped_release released;
        const FrameFacts facts(bytes, height, width, 0);
        count_bytes(height * width);
        const auto is_near = [&](Index dx, Index dy) {
            const double length = chamfer_length(dx, dy);
            return inclusive ? length <= reach : length < reach;
        };
        const Index most_rows = std::min<Index>(height - 1, Index(std::min(reach, 1e9)) + 1);
        for (Index dy = 0; dy <= most_rows && is_near(0, dy); ++dy) {
            Index dx = 0;
            while (dx < width && is_near(dx + 1, dy)) ++dx;
            count_visits(2 * Index(facts.runs().size()));
            for (const Run& run : facts.runs()) {
                const Index start = std::max<Index>(0, run.start - dx), end = std::min(width, run.end + dx);
                for (const Index row : {run.row - dy, run.row + dy}) {
                    if (row >= 0 && row < height) std::fill(image + row * width + start, image + row * width + end, true);
                }
            }
        }
    }
    return MatrixResult<bool>(image, {std::size_t(height), std::size_t(width)}, owner);
}

}  // namespace

void bind_dilation(nb::module_& m) { m.def("near_mask", &near_mask, "mask"_a.noconvert(), "reach"_a, "inclusive"_a); }
