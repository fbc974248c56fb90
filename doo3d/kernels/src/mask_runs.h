// Parts of masks from the runs of their rows: what they cost follows their pixels, not the image.
#pragma once

#include "runs.h"

#include <algorithm>

// A mask of one bit per pixel; each row begins with a new byte, so that a byte is a row of a tile of 8 pixels.
struct BitMask {
    Index height, width, stride;
    std::vector<Byte> bytes;

    BitMask(Index height, Index width) : height(height), width(width), stride((width + 7) / 8), bytes(height * stride, 0) {}
    Byte& at(Index row, Index column) { return bytes[row * stride + column]; }  // the byte of eight columns
    Byte at(Index row, Index column) const { return bytes[row * stride + column]; }
    bool has(Index y, Index x) const { return (bytes[y * stride + x / 8] >> (x % 8)) & 1; }
    void set(Index y, Index x) { bytes[y * stride + x / 8] |= Byte(1 << (x % 8)); }
};

inline std::vector<Run> runs_of(const BitMask& mask) {
    std::vector<Run> runs;
    for (Index row = 0; row < mask.height; ++row) {
        const Byte* bytes = mask.bytes.data() + row * mask.stride;
        for (Index x = 0; x < mask.width;) {
            if (x % 8 == 0) x = 8 * first_set(bytes, x / 8, mask.stride);
            if (x >= mask.width) break;
            const Index start = x;
            while (x < mask.width && mask.has(row, x)) ++x;
            if (x > start) {
                runs.push_back({std::int32_t(row), std::int32_t(start), std::int32_t(x)});
            } else {
                ++x;
            }
        }
    }
    return runs;
}

// The 8-connected parts of a mask, in the order of their first pixels; the runs of part k are runs[starts[k]] to runs[starts[k + 1]],
// in the order of rows.
struct Parts {
    std::vector<Run> runs;
    std::vector<Index> starts;
    std::vector<Index> sizes;  // pixels

    explicit Parts(const std::vector<Run>& all);
    Index count() const { return Index(sizes.size()); }
};

inline Parts::Parts(const std::vector<Run>& all) : runs(all.size()) {
    const auto count = std::int32_t(all.size());
    RunSets sets = connected(all, 1);
    std::vector<Index> part(count);
    for (std::int32_t k = 0; k < count; ++k) {
        const std::int32_t first = sets.root(k);
        part[k] = first == k ? Index(sizes.size()) : part[first];
        if (first == k) sizes.push_back(0);
        sizes[part[k]] += all[k].end - all[k].start;
    }
    starts.assign(sizes.size() + 1, 0);
    for (const Index p : part) ++starts[p + 1];
    for (std::size_t p = 1; p < starts.size(); ++p) starts[p] += starts[p - 1];
    std::vector<Index> next(starts.begin(), starts.end() - 1);
    for (std::int32_t k = 0; k < count; ++k) runs[next[part[k]]++] = all[k];
}

// Parts with their half-widths, for Python: row-major indices of the pixels, part by part; where each part begins among them; the
// half-widths, two a part; and whether a part holds pixels that it was asked for.
struct MeasuredParts {
    std::vector<std::int64_t> pixels, starts{0};
    std::vector<double> half;
    std::vector<Byte> holds;

    nb::tuple to_python() {
        return nb::make_tuple(to_numpy(std::move(pixels)), to_numpy(std::move(starts)), to_numpy(std::move(half), holds.size(), 2),
                              to_numpy_bool(holds));
    }
};

// Measure the parts of at least `min_pixels` pixels that hold none of `asked`; the half-widths of the others are 0.
MeasuredParts measure(const Parts& parts, Index height, Index width, Index min_pixels, const BitMask& asked);

// Half-widths of parts: the percentiles 50 and 85 along the middle of each.
class HalfWidths {
   public:
    HalfWidths(Index height, Index width) : height(height), width(width), values(3 * (width + 2), 0.0f) {}
    std::pair<double, double> operator()(const Parts& parts, Index part);

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
