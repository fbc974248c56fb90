// Parts of masks and their half-widths from the runs of their rows: what they cost follows their pixels, not the image.
#pragma once

#include "bit_image.h"

// Parts with their half-widths, for Python: row-major indices of the pixels, part by part; where each part begins among them; the
// half-widths, two a part; and whether a part holds pixels that it was asked for.
struct MeasuredParts {
    std::vector<std::int64_t> pixels, starts{0};
    std::vector<double> half;
    std::vector<Byte> holds;

    auto to_python() {
        return std::make_tuple(std::move(pixels), std::move(starts), rows_of(std::move(half), 2),
                               flags(std::move(holds)));
    }
};

// Measure the parts of at least `min_pixels` pixels that hold none of `asked`; the half-widths of the others are 0.
MeasuredParts measure(const std::vector<Part>& parts, Index height, Index width, Index min_pixels, const BitImage& asked);

// Return the largest chamfer distance of the pixels of a part from those that are not in it, px; beyond an image (height, width) there are
// none.
double thickness(const Part& part, Index height, Index width);
