// The parts of a mask and their half-widths.
#include "mask_runs.h"

namespace {

auto mask_parts(Matrix<bool> mask, Index min_pixels, Vector<std::int64_t> asked_pixels) {
    const Index height = mask.shape(0), width = mask.shape(1);
    count_bytes(height * width);
    count_visits(Index(asked_pixels.shape(0)));
    BitImage asked(height, width);
    for (std::size_t i = 0; i < asked_pixels.shape(0); ++i) {
        require(asked_pixels(i) >= 0 && asked_pixels(i) < height * width, "a pixel asked for is not in the mask");
        asked.set(asked_pixels(i) / width, asked_pixels(i) % width);
    }
    return measure(parts_of(runs_of(bytes_of(mask), height, width)), height, width, min_pixels, asked).to_python();
}

}  // namespace

void bind_mask_parts(Module& m) {
    // Return the 8-connected parts of a mask, with their half-widths.
    //
    // Parameters
    // ----------
    // mask
    //     (H, W) bool.
    // min_pixels
    //     pixels of a part below which its widths are not measured.
    // asked
    //     (Q,) row-major indices of pixels; parts with one of them are not measured either.
    //
    // Returns
    // -------
    // pixels : (N,) row-major indices of the mask's pixels, part by part, ascending in each.
    // starts : (K + 1,) where each of the K parts begins in `pixels`, and N.
    // half_widths : (K, 2) px, distance from the middle to the edge, in the median and at the 85th percentile; 0 if not measured.
    // holds : (K,) bool, the parts with pixels of `asked`.
    m.def("mask_parts", &mask_parts, "mask"_array, "min_pixels"_a, "asked"_array);
}
