// Masks of one bit a pixel: morphology and counting take 64 pixels a step, and follow the runs of set pixels in the rows.
#pragma once

#include "frame_facts.h"

#if defined(_MSC_VER)
#include <intrin.h>
#endif

using Word = std::uint64_t;
constexpr Index word_bits() { return 8 * Index(sizeof(Word)); }

// Return the position of the lowest bit that is set; one must be.
inline Index lowest_bit(Word word) {
#if defined(_MSC_VER)
    unsigned long at;
    _BitScanForward64(&at, word);
    return Index(at);
#else
    return __builtin_ctzll(word);
#endif
}

// An image (height, width) of bits. Bits beyond the width are 0. What lies outside of the image has no say in any operation.
class BitImage {
   public:
    Index height = 0, width = 0, words = 0;

    BitImage() = default;
    BitImage(Index height, Index width)
        : height(height), width(width), words((width + word_bits() - 1) / word_bits()), bits(height * words, 0) {}

    Word* row(Index y) { return bits.data() + y * words; }
    const Word* row(Index y) const { return bits.data() + y * words; }
    bool any() const {
        return std::any_of(bits.begin(), bits.end(), [](Word word) { return word != 0; });
    }
    void set(Index y, Index x) { row(y)[x / word_bits()] |= Word(1) << x % word_bits(); }
    bool has(Index y, Index x) const { return row(y)[x / word_bits()] >> x % word_bits() & 1; }
    // The bits of eight columns, from column 8 * `byte` on.
    int eight(Index y, Index byte) const { return int(row(y)[8 * byte / word_bits()] >> 8 * byte % word_bits() & 0xFF); }
    void add_eight(Index y, Index byte, int set) { row(y)[8 * byte / word_bits()] |= Word(set) << 8 * byte % word_bits(); }
    void set_run(Index y, Index start, Index end) {
        while (start < end) {
            const Index stop = std::min(end, (start / word_bits() + 1) * word_bits());
            row(y)[start / word_bits()] |= ~Word(0) >> (word_bits() - (stop - start)) << start % word_bits();
            start = stop;
        }
    }
    // Call `visit(start, end)` with each run of set pixels [start, end) of a row, from left to right.
    template <class Visit>
    void for_each_run_of(Index y, Visit visit) const {
        for (Index start = next(y, 0, 0), end; start < width; start = next(y, end, 0)) {
            end = next(y, start, ~Word(0));
            visit(start, end);
        }
    }
    // Call `visit(row, start, end)` with each run of set pixels, in row-major order.
    template <class Visit>
    void for_each_run(Visit visit) const {
        count_visits(height * words);
        for (Index y = 0; y < height; ++y) {
            for_each_run_of(y, [&](Index start, Index end) { visit(y, start, end); });
        }
    }
    Index count() const {
        Index sum = 0;
        for_each_run([&](Index, Index start, Index end) { sum += end - start; });
        return sum;
    }
    BitImage operator~() const {
        BitImage result = *this;
        for (Word& word : result.bits) word = ~word;
        result.clear_beyond_width();
        return result;
    }
    BitImage& operator&=(const BitImage& other) {
        for (std::size_t i = 0; i < bits.size(); ++i) bits[i] &= other.bits[i];
        return *this;
    }
    // Dilate by a convex shape that is symmetric: half_widths[k] is half its width, k rows above and below its middle, and does not
    // increase with k. Each row is widened step by step, and added to the rows that are so far away that the shape is that wide there.
    BitImage dilated(const std::vector<Index>& half_widths) const {
        BitImage result(height, width);
        std::vector<Word> wide(words);
        for (Index y = 0; y < height; ++y) {
            std::copy(row(y), row(y) + words, wide.begin());
            if (std::none_of(wide.begin(), wide.end(), [](Word word) { return word != 0; })) continue;
            count_visits(words * (half_widths.front() + 2 * Index(half_widths.size())));
            Index reached = 0;
            for (Index k = Index(half_widths.size()) - 1; k >= 0; --k) {
                for (; reached < half_widths[k]; ++reached) widen(wide);
                if (y >= k) add(wide, result.row(y - k));
                if (k && y + k < height) add(wide, result.row(y + k));
            }
        }
        result.clear_beyond_width();
        return result;
    }
    BitImage eroded(const std::vector<Index>& half_widths) const { return ~(~*this).dilated(half_widths); }

   private:
    std::vector<Word> bits;

    // Return the first column from x on, or the width, at which the bit differs from those of `same`.
    Index next(Index y, Index x, Word same) const {
        const Word* line = row(y);
        for (Index word = x / word_bits(); word < words; ++word) {
            Word differ = line[word] ^ same;
            if (word == x / word_bits()) differ &= ~Word(0) << x % word_bits();
            if (differ) return std::min(width, word * word_bits() + lowest_bit(differ));
        }
        return width;
    }
    void clear_beyond_width() {
        if (width % word_bits() == 0) return;
        for (Index y = 0; y < height; ++y) row(y)[words - 1] &= ~(~Word(0) << width % word_bits());
    }
    static void widen(std::vector<Word>& line) {
        Word before = 0;
        for (std::size_t i = 0; i < line.size(); ++i) {
            const Word word = line[i], after = i + 1 < line.size() ? line[i + 1] : 0;
            line[i] = word | word << 1 | word >> 1 | before >> (word_bits() - 1) | after << (word_bits() - 1);
            before = word;
        }
    }
    static void add(const std::vector<Word>& line, Word* to) {
        for (std::size_t i = 0; i < line.size(); ++i) to[i] |= line[i];
    }
};

const std::vector<Index> SQUARE{1, 1}, CROSS{1, 0};  // shapes of 3 x 3 pixels: all eight neighbors, and the four beside

// The part of a mask (H, W) in the bounding box of its True pixels and `margin` px around it in the image, and where it lies.
struct Crop {
    BitImage bits;
    Index top = 0, left = 0;
};

inline Crop cropped(const Matrix<bool>& mask, Index margin) {
    const FrameFacts facts(bytes_of(mask), mask.shape(0), mask.shape(1), 0);
    if (facts.runs.empty()) return {};
    const Box& box = facts.box;
    const Index top = std::max<Index>(box.top - margin, 0), bottom = std::min(box.bottom + margin, facts.height);
    const Index left = std::max<Index>(box.left - margin, 0), right = std::min(box.right + margin, facts.width);
    Crop crop{{bottom - top, right - left}, top, left};
    for (const Run& run : facts.runs) crop.bits.set_run(run.row - top, run.start - left, run.end - left);
    return crop;
}

// A connected part of a mask as runs of its rows, and its number of pixels.
struct Part {
    std::vector<Run> runs;
    Index size = 0;
};

// Return the parts of runs, connected by sides or corners, in the order of their first runs: runs are joined with those of the row
// above that they touch.
inline std::vector<Part> parts_of(const std::vector<Run>& runs) {
    RunSets sets = connected(runs, 1);
    std::vector<Part> parts;
    std::vector<std::size_t> number(runs.size());
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const auto first = std::size_t(sets.root(std::int32_t(i)));
        if (first == i) {
            number[i] = parts.size();
            parts.emplace_back();
        }
        Part& part = parts[number[first]];
        part.runs.push_back(runs[i]);
        part.size += runs[i].size();
    }
    return parts;
}

inline std::vector<Part> parts_of(const BitImage& mask) {
    std::vector<Run> runs;
    mask.for_each_run([&](Index row, Index start, Index end) {
        runs.push_back({std::int32_t(row), std::int32_t(start), std::int32_t(end)});
    });
    return parts_of(runs);
}
