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
        return std::make_tuple(to_numpy(std::move(pixels)), to_numpy(std::move(starts)), to_numpy(std::move(half), holds.size(), 2),
                               to_numpy_bool(holds));
    }
};

// Measure the parts of at least `min_pixels` pixels that hold none of `asked`; the half-widths of the others are 0.
MeasuredParts measure(const std::vector<Part>& parts, Index height, Index width, Index min_pixels, const BitImage& asked);

// Half-widths of parts: the percentiles 50 and 85 along the middle of each.
class MaskHalfWidths {
   public:
    MaskHalfWidths(Index height, Index width) : height(height), width(width), values(3 * (width + 2), 0.0f) {}
    std::pair<double, double> operator()(const Part& part);

   private:
    Index height, width;
    std::vector<float> values;    // three rows, with a column beyond the image on either side; 0 where the part has no pixel
    std::vector<float> distance;  // pixel by pixel, to the next pixel outside the part; beyond the image nothing is known
    std::vector<float> middle;

    float* row(Index y) { return values.data() + (y + 3) % 3 * (width + 2) + 1; }
    void beyond(Index y, float value) { row(y)[-1] = row(y)[width] = value; }
    void pass(const Run* first, const Run* last, bool forward);
    void find_middle(const Run* first, const Run* last);
};
