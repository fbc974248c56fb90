// How much a place in an image looks like the middle of a horizontal ribbon: uniform along its length, and unlike both sides.
#include "arrays.h"

#include <algorithm>

namespace {

constexpr Index CHANNELS = 3, PLANES = CHANNELS + 1;  // the channels, and the sum of their squares

// Sums of the planes over the rows of a window, column by column; rows beyond the image repeat the outermost one.
struct RowWindow {
    const std::vector<float>& planes;
    Index height, width, count;
    Index first, last;  // rows of the window around row 0
    std::vector<float> sums;

    RowWindow(const std::vector<float>& planes, Index height, Index width, Index count, Index first, Index last)
        : planes(planes), height(height), width(width), count(count), first(first), last(last), sums(count * width, 0.0f) {
        for (Index row = first; row <= last; ++row) add(row, 1.0f);
    }
    void add(Index row, float sign) {
        const Index inside = std::min(std::max<Index>(row, 0), height - 1);
        for (Index p = 0; p < count; ++p) {
            const float* from = planes.data() + (p * height + inside) * width;
            float* to = sums.data() + p * width;
            for (Index x = 0; x < width; ++x) to[x] += sign * from[x];
        }
    }
    void move_down(Index row) {  // from around `row` to around the next
        add(row + first, -1.0f);
        add(row + last + 1, 1.0f);
    }
    float rows() const { return float(last - first + 1); }
};

// Fill `planes`, (PLANES + 1, H, W), with the means along a window of 2 half + 1 pixels of each row, and with the variance in it.
void average_along(const std::vector<float>& image, Index height, Index width, Index half, std::vector<float>& planes) {
    count_visits(height * width);
    const float share = 1.0f / float(2 * half + 1);
    for (Index row = 0; row < PLANES * height; ++row) {
        const float* from = image.data() + row * width;
        float* to = planes.data() + row * width;
        double sum = 0.0;
        for (Index x = -half; x <= half; ++x) sum += from[std::min(std::max<Index>(x, 0), width - 1)];
        for (Index x = 0; x < width; ++x) {
            to[x] = float(sum) * share;
            sum += double(from[std::min(x + half + 1, width - 1)]) - double(from[std::max<Index>(x - half, 0)]);
        }
    }
    const Index size = height * width;
    const float *a = planes.data(), *b = a + size, *c = b + size, *square = c + size;
    float* variance = planes.data() + PLANES * size;
    for (Index i = 0; i < size; ++i) variance[i] = std::max(square[i] - (a[i] * a[i] + b[i] * b[i] + c[i] * c[i]), 0.0f);
}

// The score of a pixel is the mean squared difference between the ribbon's color and the pixels of one side, of the side that
// differs less, over the variance along the ribbon plus `noise`.
auto ribbon_scores(Volume<float> image, Vector<double> widths, double noise, double length_widths, Index min_length) {
    const Index height = image.shape(0), width = image.shape(1), size = height * width;
    require(image.shape(2) == CHANNELS && size > 0, "the image is not (H, W, 3) with pixels");
    require(noise > 0 && widths.shape(0) > 0 && widths.shape(0) < 256, "noise is not over 0, or there are no widths");
    std::vector<float> source(PLANES * size), planes((PLANES + 1) * size), best(size, 0.0f);
    for (Index i = 0; i < size; ++i) {
        float square = 0.0f;
        for (Index k = 0; k < CHANNELS; ++k) {
            const float value = image.data()[i * CHANNELS + k];
            source[k * size + i] = value;
            square += value * value;
        }
        source[CHANNELS * size + i] = square;
    }
    std::vector<std::uint8_t> which(size, 0);
    const float floor = float(noise);
    count_visits(size * Index(1 + widths.shape(0)));
    Index last_half = -1;
    for (Index w = 0; w < Index(widths.shape(0)); ++w) {
        const double px = widths(w);
        const Index half = std::max<Index>(min_length, Index(std::lround(length_widths * px))) / 2;
        if (half != last_half) average_along(source, height, width, half, planes);
        last_half = half;
        const Index core = std::max<Index>(0, Index(std::lround(0.35 * px - 0.5)));  // rows on either side of the middle one
        const Index side = std::max<Index>(2, Index(std::lround(px / 4))), gap = Index(std::lround(px / 2 + 1));
        RowWindow inside(planes, height, width, PLANES + 1, -core, core);
        RowWindow above(planes, height, width, PLANES, -gap - side + 1, -gap), below(planes, height, width, PLANES, gap, gap + side - 1);
        const float in = 1.0f / inside.rows(), out = 1.0f / above.rows();
        for (Index row = 0; row < height; ++row) {
            const float *i0 = inside.sums.data(), *a0 = above.sums.data(), *b0 = below.sums.data();
            float* score = best.data() + row * width;
            std::uint8_t* index = which.data() + row * width;
            for (Index x = 0; x < width; ++x) {
                const float r = i0[x] * in, g = i0[x + width] * in, b = i0[x + 2 * width] * in, spread = i0[x + 4 * width] * in;
                const float own = r * r + g * g + b * b;
                const float up = a0[x + 3 * width] * out - 2 * out * (a0[x] * r + a0[x + width] * g + a0[x + 2 * width] * b) + own;
                const float down = b0[x + 3 * width] * out - 2 * out * (b0[x] * r + b0[x + width] * g + b0[x + 2 * width] * b) + own;
                const float value = std::min(up, down) / (std::max(spread, 0.0f) + floor);
                index[x] = value > score[x] ? std::uint8_t(w) : index[x];
                score[x] = std::max(value, score[x]);
            }
            inside.move_down(row);
            above.move_down(row);
            below.move_down(row);
        }
    }
    return nb::make_tuple(to_numpy(std::move(best), height, width), to_numpy(std::move(which), height, width));
}

}  // namespace

void bind_ribbons(nb::module_& m) {
    m.def("ribbon_scores", &ribbon_scores, "image"_a.noconvert(), "widths"_a.noconvert(), "noise"_a, "length_widths"_a, "min_length"_a);
}
