#include "turned_image.h"

namespace {

// Find the pixels of the positions along a line; positions beyond the border of the image are moved there.
WITH_AVX2 void find_pixels(PositionLine line, Index count, std::int32_t* __restrict pixel, float* __restrict along, float* __restrict down) {
    for (std::int32_t x = 0; x < std::int32_t(count); ++x) {
        float u = line.start.u + line.step.u * float(x), v = line.start.v + line.step.v * float(x);
        u = u > 0.0f ? u : 0.0f;
        v = v > 0.0f ? v : 0.0f;
        u = u < line.last.u ? u : line.last.u;
        v = v < line.last.v ? v : line.last.v;
        const std::int32_t left = std::int32_t(u), above = std::int32_t(v);
        pixel[x] = above * line.stride + left;
        along[x] = u - float(left);
        down[x] = v - float(above);
    }
}

WITH_AVX2 void read_between(const float* __restrict image, Index below, const BetweenPixels& at, Index count, float* __restrict pixels) {
    for (Index x = 0; x < count; ++x) {
        const float *over = image + Index(at.pixel[x]) * PLANES, *under = over + below, along = at.along[x], down = at.down[x];
        for (Index k = 0; k < PLANES; ++k) {
            const float upper = over[k] + along * (over[k + PLANES] - over[k]), lower = under[k] + along * (under[k + PLANES] - under[k]);
            pixels[x * PLANES + k] = upper + down * (lower - upper);
        }
    }
}

WITH_AVX2 void read_scores(const float* __restrict scores, Index below, const BetweenPixels& at, Index count, float* __restrict read) {
    const std::int32_t* pixel = at.pixel.data();
    const float *along = at.along.data(), *down = at.down.data(), *under = scores + below;
    for (Index x = 0; x < count; ++x) {
        const float upper = scores[pixel[x]] + along[x] * (scores[pixel[x] + 1] - scores[pixel[x]]);
        const float lower = under[pixel[x]] + along[x] * (under[pixel[x] + 1] - under[pixel[x]]);
        read[x] = upper + down[x] * (lower - upper);
    }
}

}  // namespace

Centered::Centered(const Volume<float>& image)
    : height(image.shape(0)), width(image.shape(1)), values((height + 1) * (width + 1) * PLANES) {
    double mean[CHANNELS] = {};
    for (Index i = 0; i < height * width; ++i) {
        for (Index k = 0; k < CHANNELS; ++k) mean[k] += double(image.data()[i * CHANNELS + k]);
    }
    for (double& sum : mean) sum /= double(height * width);
    for (Index row = 0; row <= height; ++row) {
        for (Index x = 0; x <= width; ++x) {
            const float* from = image.data() + (std::min(row, height - 1) * width + std::min(x, width - 1)) * CHANNELS;
            float* to = values.data() + (row * (width + 1) + x) * PLANES;
            for (Index k = 0; k < CHANNELS; ++k) to[k] = from[k] - float(mean[k]);
            square = std::max(square, to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
        }
    }
}

Turned::Turned(const Centered& image, double angle) : image(image), cos(std::cos(angle)), sin(std::sin(angle)) {
    const double across = double(image.width), down = double(image.height), c = std::fabs(cos), s = std::fabs(sin);
    width = Index(across * c + down * s + 2);
    height = Index(across * s + down * c + 2);
    u0 = (across - 1) / 2 - cos * double(width - 1) / 2 + sin * double(height - 1) / 2;
    v0 = (down - 1) / 2 - sin * double(width - 1) / 2 - cos * double(height - 1) / 2;
}

std::pair<Index, Index> Turned::rows(Index column) const {
    const double margin = 3.0;  // px: what an interpolation reads beside the image
    double first = 0, last = double(height);
    const auto cut = [&](double at, double step, Index size) {
        const double low = -margin - at, high = double(size) + margin - at;
        if (std::fabs(step) < 1e-9) {
            if (low > 0 || high < 0) last = 0;
            return;
        }
        first = std::max(first, std::min(low / step, high / step));
        last = std::min(last, std::max(low / step, high / step) + 1);
    };
    cut(u0 + cos * double(column), -sin, image.width);
    cut(v0 + sin * double(column), cos, image.height);
    return {Index(first), std::max(std::min(Index(last), height), Index(first))};
}

void Turned::read(Index row, Index first, Index last, float* pixels) {
    const double v = double(row), u = double(first);
    place(last - first, {{float(u0 - sin * v + cos * u), float(v0 + cos * v + sin * u)}, {float(cos), float(sin)},
                         {float(image.width - 1), float(image.height - 1)}, std::int32_t(image.width + 1)});
    read_between(image.values.data(), PLANES * (image.width + 1), between, last - first, pixels);
}

void Turned::turn_back(const float* scores, const Byte* widths, float* score, Byte* which) {
    const double u = -(cos * u0 + sin * v0), v = sin * u0 - cos * v0;
    for (Index row = 0; row < image.height; ++row, score += image.width, which += image.width) {
        place(image.width, {{float(u + sin * double(row)), float(v + cos * double(row))}, {float(cos), float(-sin)},
                            {float(width - 1), float(height - 1)}, std::int32_t(width)});
        read_scores(scores, width, between, image.width, score);
        for (Index x = 0; x < image.width; ++x) {
            which[x] = widths[between.pixel[x] + (between.down[x] > 0.5f ? width : 0) + (between.along[x] > 0.5f ? 1 : 0)];
        }
    }
}

void Turned::place(Index count, const PositionLine& line) {
    between.pixel.resize(std::max(between.pixel.size(), std::size_t(count)));
    between.along.resize(between.pixel.size());
    between.down.resize(between.pixel.size());
    find_pixels(line, count, between.pixel.data(), between.along.data(), between.down.data());
}
