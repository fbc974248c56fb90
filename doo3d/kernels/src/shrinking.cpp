#include "shrinking.h"

namespace {

// The pixels [first, first + weights.size()) along a side that a smaller pixel covers, and their shares.
struct Cover {
    Index first;
    std::vector<float> weights;
};

std::vector<Cover> covers(Index size, Index small) {
    std::vector<Cover> result(small);
    const double scale = double(size) / double(small);
    for (Index i = 0; i < small; ++i) {
        const double start = double(i) * scale, end = start + scale, length = std::min(scale, double(size) - start);
        const Index last = std::min(Index(std::floor(end)), size - 1), first = std::min(Index(std::ceil(start)), last);
        const bool before = double(first) - start > 1e-3, after = end - double(last) > 1e-3;
        result[i].first = first - before;
        if (before) result[i].weights.push_back(float((double(first) - start) / length));
        result[i].weights.insert(result[i].weights.end(), last - first, float(1.0 / length));
        if (after) result[i].weights.push_back(float(std::min({end - double(last), 1.0, length}) / length));
    }
    return result;
}

// Add the four pixels of each square of two rows at all columns; every other one is of the smaller image.
WITH_AVX2 void add_squares(const Byte* __restrict upper, const Byte* __restrict lower, Index count, std::uint16_t* __restrict means) {
    for (Index i = 0; i < count; ++i) means[i] = std::uint16_t((upper[i] + upper[i + CHANNELS] + lower[i] + lower[i + CHANNELS] + 2) >> 2);
}

WITH_AVX2 void add_means(const std::uint16_t* __restrict upper, const std::uint16_t* __restrict lower, Index count, Byte* __restrict means) {
    const Index beside = 2 * CHANNELS;
    for (Index i = 0; i < count; ++i) means[i] = Byte((upper[i] + upper[i + beside] + lower[i] + lower[i + beside] + 2) >> 2);
}

void add_squares_of(const Byte* image, Colors& small) {
    const Index row_bytes = 2 * small.width * CHANNELS, count = row_bytes - CHANNELS;
    std::vector<std::uint16_t> means(count);
    count_visits(small.height * small.width);
    for (Index row = 0; row < small.height; ++row) {
        const Byte* from = image + 2 * row * row_bytes;
        add_squares(from, from + row_bytes, count, means.data());
        Byte* to = small.at(row, 0);
        for (Index x = 0; x < small.width; ++x) {
            for (Index k = 0; k < CHANNELS; ++k) *to++ = Byte(means[2 * CHANNELS * x + k]);
        }
    }
}

}  // namespace

Colors halved(const Byte* image, Index height, Index width) {
    Colors small(std::max<Index>(height / 2, 1), std::max<Index>(width / 2, 1));
    if (height % 2 == 0 && width % 2 == 0) {
        add_squares_of(image, small);
        return small;
    }
    const std::vector<Cover> down = covers(height, small.height), along = covers(width, small.width);
    std::vector<float> sums(small.width * CHANNELS);
    count_visits(small.height * small.width);
    for (Index row = 0; row < small.height; ++row) {
        std::fill(sums.begin(), sums.end(), 0.0f);
        for (std::size_t j = 0; j < down[row].weights.size(); ++j) {
            const Byte* from = image + (down[row].first + Index(j)) * width * CHANNELS;
            const float share = down[row].weights[j];
            float* sum = sums.data();
            for (const Cover& cover : along) {
                float mean[CHANNELS] = {};
                const Byte* pixel = from + cover.first * CHANNELS;
                for (const float weight : cover.weights) {
                    for (Index k = 0; k < CHANNELS; ++k) mean[k] += float(*pixel++) * weight;
                }
                for (Index k = 0; k < CHANNELS; ++k) *sum++ += share * mean[k];
            }
        }
        Byte* to = small.at(row, 0);
        for (Index i = 0; i < small.width * CHANNELS; ++i) to[i] = Byte(std::nearbyint(sums[i]));
    }
    return small;
}

Colors quartered(const Byte* image, Index height, Index width) {
    if (height % 4 || width % 4) {
        Colors half = halved(image, height, width);
        return halved(half.bytes.data(), half.height, half.width);
    }
    Colors small(height / 4, width / 4);
    const Index row_bytes = width * CHANNELS, squares = row_bytes - CHANNELS, count = squares - 2 * CHANNELS;
    std::vector<std::uint16_t> upper(squares), lower(squares);
    std::vector<Byte> means(count);
    count_visits(small.height * small.width);
    for (Index row = 0; row < small.height; ++row) {
        const Byte* from = image + 4 * row * row_bytes;
        add_squares(from, from + row_bytes, squares, upper.data());
        add_squares(from + 2 * row_bytes, from + 3 * row_bytes, squares, lower.data());
        add_means(upper.data(), lower.data(), count, means.data());
        Byte* to = small.at(row, 0);
        for (Index x = 0; x < small.width; ++x, to += CHANNELS) {
            for (Index k = 0; k < CHANNELS; ++k) to[k] = means[4 * CHANNELS * x + k];
        }
    }
    return small;
}
