// Closed gaps of a mask, and its long parts, on bits: 64 pixels a step.
#include "mask_closing.h"

std::vector<Index> checked_shape(const Vector<Index>& half_widths, double distance, Index height, Index width) {
    require(half_widths.shape(0) > 0, "half_widths is empty");
    std::vector<Index> shape(half_widths.shape(0));
    for (std::size_t k = 0; k < shape.size(); ++k) {
        shape[k] = half_widths(k);
        require(shape[k] >= 0 && shape[k] <= height + width && (!k || shape[k] <= shape[k - 1]), "half_widths increase, or are no widths");
    }
    require(distance >= 0 && distance <= double(height + width), "distance is negative, or longer than the image");
    return shape;
}

// The margin is twice as wide as the shape: what the shape adds has all that it takes away again around it.
ClosedMask closed_mask(const FrameFacts& facts, const std::vector<Index>& shape, double distance) {
    std::vector<Index> ball;
    for (Index dy = 0; chamfer_length(0, dy) <= distance; ++dy) {
        ball.push_back(0);
        while (chamfer_length(ball.back() + 1, dy) <= distance) ++ball.back();
    }
    Crop crop = cropped(facts, 2 * std::max(shape.front(), Index(shape.size())), false);
    crop.bits = crop.bits.dilated(shape).eroded(shape);
    const Index deep = crop.bits.eroded(ball).count();
    return {std::move(crop), deep};
}

namespace {

auto close_mask(Matrix<bool> mask, Vector<Index> half_widths, double distance) {
    const Index height = mask.shape(0), width = mask.shape(1);
    const std::vector<Index> shape = checked_shape(half_widths, distance, height, width);
    auto* closed = new bool[std::max<Index>(height * width, 1)]();
    nb::capsule owner(closed, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    Index deep = 0;
    {
        nb::gil_scoped_release release;
        const ClosedMask result = closed_mask(FrameFacts(bytes_of(mask), height, width, 0), shape, distance);
        const Crop& crop = result.crop;
        crop.bits.for_each_run([&](Index row, Index start, Index end) {
            std::fill(closed + (row + crop.top) * width + start + crop.left, closed + (row + crop.top) * width + end + crop.left, true);
        });
        deep = result.deep;
    }
    return std::make_pair(MatrixResult<bool>(closed, {std::size_t(height), std::size_t(width)}, owner), deep);
}

auto long_parts(Matrix<bool> mask, Index extent) {
    const Index height = mask.shape(0), width = mask.shape(1);
    auto* kept = new bool[std::max<Index>(height * width, 1)]();
    nb::capsule owner(kept, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    {
        nb::gil_scoped_release release;
        const Crop crop = cropped(mask, 0);
        for (const Part& part : parts_of(crop.bits)) {
            Index left = width, right = 0;
            for (const Run& run : part.runs) left = std::min<Index>(left, run.start), right = std::max<Index>(right, run.end);
            if (std::max<Index>(right - left, part.runs.back().row + 1 - part.runs.front().row) < extent) continue;
            for (const Run& run : part.runs) {
                bool* line = kept + (run.row + crop.top) * width + crop.left;
                std::fill(line + run.start, line + run.end, true);
            }
        }
    }
    return MatrixResult<bool>(kept, {std::size_t(height), std::size_t(width)}, owner);
}

}  // namespace

void bind_mask_closing(Module& m) {
    // Close the gaps of a mask: dilation and then erosion with a symmetric convex shape; nothing is added at the border.
    //
    // Parameters
    // ----------
    // mask
    //     (H, W) bool
    // half_widths
    //     (R,) half the widths of the shape, px, in its middle row and in the rows above and below; they do not increase
    // distance
    //     px
    //
    // Returns
    // -------
    // closed : (H, W) bool
    // deep : number of its pixels farther than `distance` from its outside, by the chamfer distance of `medial_axis`
    m.def("close_mask", &close_mask, "mask"_a.noconvert(), "half_widths"_a.noconvert(), "distance"_a);
    // Return the 8-connected parts of a mask that extend over so many rows or columns at least.
    //
    // mask : (H, W) bool. extent : px. Returns (H, W) bool.
    m.def("long_parts", &long_parts, "mask"_a.noconvert(), "extent"_a);
}
