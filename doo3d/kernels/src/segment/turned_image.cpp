#include "turned_image.h"

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

WITH_AVX2 void Turned::read(Index row, Index first, Index last, float* __restrict pixels) {
    const double v = double(row), u = double(first);
    const Index count = last - first, below = PLANES * (image.width + 1);
    place(count, {float(u0 - sin * v + cos * u), float(v0 + cos * v + sin * u)}, {float(cos), float(sin)}, image.height, image.width,
          image.width + 1);
    for (Index x = 0; x < count; ++x) {
        const float* over = image.values.data() + Index(pixel[x]) * PLANES;
        const float* under = over + below;
        for (Index k = 0; k < PLANES; ++k) {
            const float upper = over[k] + along[x] * (over[k + PLANES] - over[k]);
            const float lower = under[k] + along[x] * (under[k + PLANES] - under[k]);
            pixels[x * PLANES + k] = upper + down[x] * (lower - upper);
        }
    }
}

WITH_AVX2 void Turned::turn_back(const float* __restrict scores, const Byte* __restrict widths, float* __restrict score,
                                 Byte* __restrict which) {
    const double u = -(cos * u0 + sin * v0), v = sin * u0 - cos * v0;
    for (Index row = 0; row < image.height; ++row, score += image.width, which += image.width) {
        place(image.width, {float(u + sin * double(row)), float(v + cos * double(row))}, {float(cos), float(-sin)}, height, width, width);
        for (Index x = 0; x < image.width; ++x) {
            const float *over = scores + pixel[x], *under = over + width;
            const float upper = over[0] + along[x] * (over[1] - over[0]), lower = under[0] + along[x] * (under[1] - under[0]);
            score[x] = upper + down[x] * (lower - upper);
        }
        for (Index x = 0; x < image.width; ++x) {
            which[x] = widths[pixel[x] + (down[x] > 0.5f ? width : 0) + (along[x] > 0.5f ? 1 : 0)];
        }
    }
}

// Find the pixels of positions along a line, in an image whose rows have `stride` pixels; positions beyond its border are moved there.
WITH_AVX2 void Turned::place(Index count, Position start, Position step, Index rows, Index columns, Index stride) {
    pixel.resize(std::max(pixel.size(), std::size_t(count)));
    along.resize(pixel.size());
    down.resize(pixel.size());
    std::int32_t* __restrict to = pixel.data();
    float *__restrict beside = along.data(), *__restrict below = down.data();
    const float right = float(columns - 1), bottom = float(rows - 1);
    for (std::int32_t x = 0; x < std::int32_t(count); ++x) {
        float u = start.u + step.u * float(x), v = start.v + step.v * float(x);
        u = u > 0.0f ? u : 0.0f;
        v = v > 0.0f ? v : 0.0f;
        u = u < right ? u : right;
        v = v < bottom ? v : bottom;
        const std::int32_t left = std::int32_t(u), above = std::int32_t(v);
        to[x] = above * std::int32_t(stride) + left;
        beside[x] = u - float(left);
        below[x] = v - float(above);
    }
}
