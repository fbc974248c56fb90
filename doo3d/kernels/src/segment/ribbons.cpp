// Scores of ribbons: the image is turned so that a direction is horizontal, strip by strip, and the scores are turned back.
#include "turned_image.h"

namespace {

// columns at a time; numbers of a row of sums: the planes and the spread along the window
constexpr Index STRIP = 128, BLOCK = STRIP / 8, KEPT = (PLANES + 1) * STRIP;
using Sum = std::uint32_t;  // of integers: what overflows cancels out in a difference

float difference(Sum last, Sum first) { return float(std::int32_t(last - first)); }

// Powers of two that make integers of channels, squares and spreads, so that the sums over all windows are exact.
struct Scales {
    float channel, square, spread;
};

// Add one row of a strip to the sums along it, plane by plane.
void sum_along(const std::int32_t* row, Index count, Sum* sums) {
    for (Index k = 0; k < PLANES; ++k, row += count, sums += count + 1) {
        Sum sum = 0;
        for (Index x = 0; x < count; ++x) {
            sums[x] = sum;
            sum += Sum(row[x]);
        }
        sums[count] = sum;
    }
}

// Make integers of the pixels of a row, channel by channel, and of the sum of their squares.
WITH_AVX2 void to_integers(const float* __restrict row, Index count, Scales to, Index stride, std::int32_t* __restrict planes) {
    const float back = 1 / to.channel;
    for (Index x = 0; x < count; ++x) {
        float square = 0.0f;
        for (Index k = 0; k < CHANNELS; ++k) {
            planes[k * stride + x] = std::int32_t(row[x * PLANES + k] * to.channel);
            const float kept = float(planes[k * stride + x]) * back;
            square += kept * kept;
        }
        planes[CHANNELS * stride + x] = std::int32_t(square * to.square + 0.5f);
    }
}

// Write the sums over the rows up to the next: of the variance in a window along the row, and of the planes.
WITH_AVX2 void add_row(const Sum* sums, Index stride, Index window, Scales to, const Sum* __restrict before, Sum* __restrict after) {
    const float channel = 1 / (to.channel * float(window)), squares = 1 / (to.square * float(window));
    const Sum *r = sums, *g = r + stride, *b = g + stride, *s = b + stride;
    for (Index x = 0; x < STRIP; ++x) {
        const Sum red = r[x + window] - r[x], green = g[x + window] - g[x], blue = b[x + window] - b[x], square = s[x + window] - s[x];
        const float p = difference(red, 0) * channel, q = difference(green, 0) * channel, t = difference(blue, 0) * channel;
        const float spread = difference(square, 0) * squares - (p * p + q * q + t * t);
        after[x] = before[x] + Sum(std::int32_t((spread > 0.0f ? spread : 0.0f) * to.spread));
        after[x + STRIP] = before[x + STRIP] + red;
        after[x + 2 * STRIP] = before[x + 2 * STRIP] + green;
        after[x + 3 * STRIP] = before[x + 3 * STRIP] + blue;
        after[x + 4 * STRIP] = before[x + 4 * STRIP] + square;
    }
}

// The sums above and below the rows of a window, and factors that make means of their differences.
struct Rows {
    const Sum *first, *last;

    Rows from(Index x) const { return {first + x, last + x}; }
};
struct Windows {
    Rows inside, above, below;
};
struct Factors {
    float inside, spread, side, square, noise;
};

// The score of a pixel is the mean squared difference between the ribbon's color and the pixels of one side, of the side that
// differs less, over the variance along the ribbon plus `noise`.
WITH_AVX2 void score_row(const Windows& rows, Index count, Factors to, std::int32_t index, float* __restrict best, std::int32_t* __restrict which) {
    const Rows i = rows.inside, a = rows.above, b = rows.below;
    const Index R = STRIP, G = 2 * STRIP, B = 3 * STRIP, S = 4 * STRIP;
    for (Index x = 0; x < count; ++x) {
        const float spread = difference(i.last[x], i.first[x]) * to.spread, red = difference(i.last[x + R], i.first[x + R]) * to.inside;
        const float green = difference(i.last[x + G], i.first[x + G]) * to.inside;
        const float blue = difference(i.last[x + B], i.first[x + B]) * to.inside;
        const float own = red * red + green * green + blue * blue, r = red * to.side, g = green * to.side, t = blue * to.side;
        const float up = difference(a.last[x + S], a.first[x + S]) * to.square + own -
                         (difference(a.last[x + R], a.first[x + R]) * r + difference(a.last[x + G], a.first[x + G]) * g +
                          difference(a.last[x + B], a.first[x + B]) * t);
        const float down = difference(b.last[x + S], b.first[x + S]) * to.square + own -
                           (difference(b.last[x + R], b.first[x + R]) * r + difference(b.last[x + G], b.first[x + G]) * g +
                            difference(b.last[x + B], b.first[x + B]) * t);
        const float value = (up < down ? up : down) / (spread + to.noise);
        which[x] = value > best[x] ? index : which[x];
        best[x] = value > best[x] ? value : best[x];
    }
}

// Sums of a strip over rows, of windows of one length along the rows, of the last rows; rows beyond the image repeat the outermost
// one.
struct SummedRows {
    Index half, held = 0;  // of the window along the row; rows that are kept
    std::vector<Sum> kept;

    Sum* at(Index row) { return kept.data() + (row + held) % held * KEPT; }  // sums over the rows before this one
    Rows window(Index first, Index last) { return {at(first), at(last + 1)}; }
};

struct Width {
    std::size_t summed;     // which rows it looks at
    Index core, gap, side;  // rows on either side of the middle one; rows to the sides, and rows of a side
};

using Blocks = std::vector<std::pair<Index, Index>>;  // the rows at which each block of a strip is looked at

class Ribbons {
   public:
    Ribbons(float square, const Vector<double>& widths, double noise, double length_widths, Index min_length) : noise(float(noise)) {
        for (std::size_t w = 0; w < widths.shape(0); ++w) add_width(widths(w), length_widths, min_length);
        for (SummedRows& rows : summed) {
            margin = std::max(margin, rows.half);
            rows.held = 2 * reach + 2;
            rows.kept.resize(rows.held * KEPT);
        }
        across = STRIP + 2 * margin;
        colors.resize(across * PLANES);
        pixels.resize(across * PLANES);
        along.resize((across + 1) * PLANES);
        choose_scales(square);
    }

    // Write the score of each pixel of a turned image that is looked at, and the width.
    void score(Turned& image, float* best, Byte* which) {
        const Index height = image.height, width = image.width;
        for (Index left = 0; left < width; left += STRIP) {
            Blocks blocks;
            Index first = height, last = 0;
            for (Index x = left; x < std::min(left + STRIP, width); ++x) {
                if (x % BLOCK == 0) blocks.emplace_back(height, 0);
                const auto rows = image.rows(x);
                if (rows.first >= rows.second) continue;
                blocks.back() = {std::min(blocks.back().first, rows.first), std::max(blocks.back().second, rows.second)};
                first = std::min(first, rows.first);
                last = std::max(last, rows.second);
            }
            if (first < last) score_strip(image, left, first, last, blocks, best + left, which + left);
        }
    }

   private:
    Index margin = 0, reach = 0, across = 0;
    float noise;
    Scales scales{};
    std::vector<float> colors;         // (across, PLANES), a row of a strip with a margin on either side, where the border is repeated
    std::vector<std::int32_t> pixels;  // (PLANES, across), the same as integers
    std::vector<Sum> along;            // (PLANES, across + 1), the sums along it
    std::vector<SummedRows> summed;
    std::vector<Width> ribbons;

    void add_width(double px, double length_widths, Index min_length) {
        const Index half = std::max<Index>(min_length, Index(std::lround(length_widths * px))) / 2;
        const Index core = std::max<Index>(0, Index(std::lround(0.35 * px - 0.5)));
        const Index side = std::max<Index>(2, Index(std::lround(px / 4))), gap = Index(std::lround(px / 2 + 1));
        if (summed.empty() || summed.back().half != half) {
            summed.emplace_back();
            summed.back().half = half;
        }
        reach = std::max({reach, gap + side, core + 1});
        ribbons.push_back({summed.size() - 1, core, gap, side});
    }

    void choose_scales(float square) {
        float inside = 1.0f, side = 1.0f, window = 1.0f;  // rows and pixels of the largest
        for (const Width& at : ribbons) {
            inside = std::max(inside, float(2 * at.core + 1));
            side = std::max(side, float(at.side));
        }
        for (const SummedRows& at : summed) window = std::max(window, float(2 * at.half + 1));
        const auto power = [](float limit) { return std::ldexp(1.0f, 31 - int(std::ceil(std::log2(1.01f * limit)))); };
        scales = {power(std::sqrt(square) * std::max(inside, side) * window), power(square * side * window), power(square * inside)};
    }

    void load_row(Turned& image, Index left, Index row) {
        const Index start = left - margin, first = std::max<Index>(start, 0), last = std::min(start + across, image.width);
        image.read(std::min(std::max<Index>(row, 0), image.height - 1), first, last, colors.data());
        to_integers(colors.data(), last - first, scales, across, pixels.data() + first - start);
        for (Index k = 0; k < PLANES; ++k) {
            std::int32_t* plane = pixels.data() + k * across;
            std::fill(plane, plane + first - start, plane[first - start]);
            std::fill(plane + last - start, plane + across, plane[last - start - 1]);
        }
        sum_along(pixels.data(), across, along.data());
        for (SummedRows& rows : summed) {
            add_row(along.data() + margin - rows.half, across + 1, 2 * rows.half + 1, scales, rows.at(row), rows.at(row + 1));
        }
    }

    // Score the rows from `first` to before `last` of a strip.
    void score_strip(Turned& image, Index left, Index first, Index last, const Blocks& blocks, float* best, Byte* which) {
        for (SummedRows& rows : summed) std::fill_n(rows.at(first - reach), KEPT, 0);
        Index loaded = first - reach;
        for (Index row = first; row < last; ++row) {
            for (; loaded < row + reach; ++loaded) load_row(image, left, loaded);
            const auto looks = [&](const auto& block) { return block.first <= row && row < block.second; };
            const Index begin = BLOCK * (std::find_if(blocks.begin(), blocks.end(), looks) - blocks.begin());
            const Index end = BLOCK * (blocks.rend() - std::find_if(blocks.rbegin(), blocks.rend(), looks));
            if (begin >= end) continue;
            float highest[STRIP] = {};
            std::int32_t index[STRIP] = {};
            for (std::size_t w = 0; w < ribbons.size(); ++w) {
                const Width& at = ribbons[w];
                SummedRows& rows = summed[at.summed];
                const float inside = 1 / float((2 * at.core + 1)), window = 1 / float(2 * rows.half + 1), side = 1 / float(at.side);
                const Factors to{inside * window / scales.channel, inside / scales.spread, 2 * side * window / scales.channel,
                                 side * window / scales.square, noise};
                const Windows windows{rows.window(row - at.core, row + at.core).from(begin),
                                      rows.window(row - at.gap - at.side + 1, row - at.gap).from(begin),
                                      rows.window(row + at.gap, row + at.gap + at.side - 1).from(begin)};
                score_row(windows, end - begin, to, std::int32_t(w), highest, index);
            }
            const Index count = std::min(end, image.width - left) - begin;
            std::copy_n(highest, count, best + row * image.width + begin);
            std::copy_n(index, count, which + row * image.width + begin);
        }
    }
};

auto ribbon_scores(Volume<float> image, Index directions, Vector<double> widths, double noise, double length_widths, Index min_length) {
    const std::size_t height = image.shape(0), width = image.shape(1), size = height * width, count = std::size_t(directions);
    require(image.shape(2) == CHANNELS && size > 0, "the image is not (H, W, 3) with pixels");
    require(noise > 0 && widths.shape(0) > 0 && widths.shape(0) < 256, "noise is not over 0, or there are no widths");
    require(directions > 0, "directions are not over 0");
    count_visits(Index(size * count * (1 + widths.shape(0))));
    std::vector<float> scores(size * count);
    std::vector<Byte> best(size * count);
    const Centered centered(image);
    Ribbons ribbons(centered.square, widths, noise, length_widths, min_length);
    std::vector<float> score;
    std::vector<Byte> which;
    for (std::size_t direction = 0; direction < count; ++direction) {
        Turned turned(centered, PI * double(direction) / double(count));
        const std::size_t pixels = std::size_t(turned.height * turned.width);
        score.resize(std::max(score.size(), pixels));
        which.resize(std::max(which.size(), pixels));
        ribbons.score(turned, score.data(), which.data());
        turned.turn_back(score.data(), which.data(), scores.data() + direction * size, best.data() + direction * size);
    }
    return std::make_tuple(shaped(std::move(scores), count, height, width), shaped(std::move(best), count, height, width));
}

}  // namespace

void bind_ribbons(Module& m) {
    // Score how much each pixel looks like the middle of a ribbon in each direction.
    //
    // The score is the mean squared difference of a side's pixels from the ribbon's mean color, of the side that differs less,
    // divided by the variance along the ribbon plus `noise`. The middle 0.7 of a ribbon's width counts as inside; a side begins a
    // pixel beyond its edge and is a quarter as wide, 2 px at least. Pixels beyond the border repeat the outermost ones. Pixels and
    // scores are interpolated between those of the image turned so that the ribbon is horizontal.
    //
    // Parameters
    // ----------
    // image
    //     (H, W, 3) float32, at least one pixel.
    // directions
    //     number of directions D over half a turn, the first horizontal, the others from x to y.
    // widths
    //     (K,) px, widths of ribbons, K from 1 to 255.
    // noise
    //     squared unit of the image, over 0; variance that is noise.
    // length_widths, min_length
    //     length of the window along a ribbon, in its widths, and in px at least.
    //
    // Returns
    // -------
    // score : (D, H, W) float32, of the width that scores most.
    // width : (D, H, W) uint8, the index of that width.
    m.def("ribbon_scores", &ribbon_scores, "image"_array, "directions"_a, "widths"_array, "noise"_a, "length_widths"_a, "min_length"_a);
}
