// Masks as runs of pixels in rows: what is done with them costs what the pixels cost, and not the image.
#pragma once

#include "arrays.h"

// px: chamfer distance of OpenCV (DIST_L2, 3 x 3) between pixels side by side, and across a corner.
constexpr double STRAIGHT = 0.955, DIAGONAL = 1.3693;

// The True pixels [start, end) of a row.
struct Run {
    std::int32_t row, start, end;

    Index size() const { return end - start; }
};

// Return the runs of a mask (height, width), row by row, each from the left.
inline std::vector<Run> runs_of(const Byte* mask, Index height, Index width) {
    count_bytes(height * width);
    std::vector<Run> runs;
    for (Index row = 0; row < height; ++row) {
        const Byte* pixels = mask + row * width;
        for (Index start = first_set(pixels, 0, width); start < width;) {
            Index end = start;
            while (end < width && pixels[end]) ++end;
            runs.push_back({std::int32_t(row), std::int32_t(start), std::int32_t(end)});
            start = first_set(pixels, end, width);
        }
    }
    return runs;
}

// Runs in disjoint sets; the least of a set stands for it.
class RunSets {
public:
    explicit RunSets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }

    std::int32_t root(std::int32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }

    void unite(std::int32_t i, std::int32_t j) {
        const std::int32_t a = root(i), b = root(j);
        if (a != b) parent_[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<std::int32_t> parent_;
};

// Unite the runs of neighboring rows that share a column, or whose columns are at most `reach` apart. One walk along both rows.
inline RunSets connected(const std::vector<Run>& runs, std::int32_t reach) {
    RunSets sets(runs.size());
    std::size_t above = 0, start = 0;  // first runs of the row above, and of the row
    for (std::size_t stop = 0; start < runs.size(); above = start, start = stop) {
        while (stop < runs.size() && runs[stop].row == runs[start].row) ++stop;
        if (above == start || runs[above].row + 1 != runs[start].row) continue;
        for (std::size_t a = above, b = start; a < start && b < stop;) {
            if (runs[a].start < runs[b].end + reach && runs[b].start < runs[a].end + reach) {
                sets.unite(std::int32_t(a), std::int32_t(b));
            }
            runs[a].end < runs[b].end ? ++a : ++b;
        }
    }
    return sets;
}
