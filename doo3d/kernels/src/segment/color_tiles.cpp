#include "color_tiles.h"

#include "lab.h"

namespace {

constexpr std::array<float, 3> BLUR = {0.49915f, 0.22851f, 0.02192f};  // Gaussian of 0.8 px: the pixel, and those 1 and 2 away
constexpr Index ROOT_STEPS = 2048;

// Return where the pixels of a row or column lie between those of one that is some times shorter.
std::vector<Between> positions(Index size, Index small) {
    std::vector<Between> result(size);
    for (Index i = 0; i < size; ++i) {
        const float at = std::min(std::max((i + 0.5f) * small / size - 0.5f, 0.0f), float(small - 1));
        const Index first = Index(at);
        result[i] = {first, std::min(first + 1, small - 1), at - float(first)};
    }
    return result;
}

// 8-bit sRGB to CIELAB in OpenCV's 8-bit scale of lightness, with the color axes around 128. Four numbers a pixel, for vector
// instructions: X, Y, Z, and one that nothing reads.
struct ToLab {
    struct Root {
        float value, step;  // to the next one
    };
    std::array<std::array<std::array<float, 4>, 256>, CHANNELS> part;  // of X, Y and Z, by channel and its 8-bit value
    std::array<Root, ROOT_STEPS + 1> root;

    ToLab() {
        const float shares[CHANNELS][4] = {
            {0.412453f, 0.212671f, 0.019334f, 0}, {0.357580f, 0.715160f, 0.119193f, 0}, {0.180423f, 0.072169f, 0.950227f, 0}};
        for (std::size_t i = 0; i < 256; ++i) {
            const float linear = float(linear_light(i));
            for (Index k = 0; k < CHANNELS; ++k) {
                for (Index d = 0; d < 4; ++d) part[k][i][d] = shares[k][d] * linear;
            }
        }
        for (std::size_t i = 0; i < root.size(); ++i) {
            const float value = root_of(double(i) / ROOT_STEPS);
            root[i] = {value, root_of(double(i + 1) / ROOT_STEPS) - value};
        }
    }
    static float root_of(double t) { return float(t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0); }

    // Convert the pixels of a row of a tile, channel by channel.
    WITH_AVX2 void operator()(const Byte (&rgb)[WIDE * CHANNELS], float (&lab)[CHANNELS][WIDE]) const {
        const float white[4] = {1 / 0.950456f, 1, 1 / 1.088754f, 1};
        float at[4 * WIDE], f[CHANNELS][WIDE];
        std::int32_t step[4 * WIDE];
        for (Index x = 0; x < WIDE; ++x) {
            const float *red = part[0][rgb[3 * x]].data(), *green = part[1][rgb[3 * x + 1]].data(), *blue = part[2][rgb[3 * x + 2]].data();
            for (Index k = 0; k < 4; ++k) at[4 * x + k] = (red[k] + green[k] + blue[k]) * white[k];
        }
        for (Index i = 0; i < 4 * WIDE; ++i) at[i] = (at[i] < 1.0f ? at[i] : 1.0f) * ROOT_STEPS;
        for (Index i = 0; i < 4 * WIDE; ++i) step[i] = std::int32_t(at[i]);
        for (Index i = 0; i < 4 * WIDE; ++i) at[i] -= float(step[i]);
        for (Index x = 0; x < WIDE; ++x) {
            for (Index k = 0; k < CHANNELS; ++k) f[k][x] = root[step[4 * x + k]].value + at[4 * x + k] * root[step[4 * x + k]].step;
        }
        for (Index x = 0; x < WIDE; ++x) {
            lab[0][x] = 2.55f * (116.0f * f[1][x] - 16.0f);
            lab[1][x] = 500.0f * (f[0][x] - f[1][x]) + 128.0f;
            lab[2][x] = 200.0f * (f[1][x] - f[2][x]) + 128.0f;
        }
    }
};

const ToLab& to_lab() {
    static const ToLab table;
    return table;
}

// Write the contrasts of a row of a tile that is blurred along five rows; return bits of the pixels that differ, and of those well above.
template <class Plane>
std::pair<int, int> compare_row(const Plane* rows, const Plane& base, const float* scale, const Thresholds& limits, float* contrast) {
    float lab[CHANNELS][TILE];
    for (Index k = 0; k < CHANNELS; ++k) {
        for (Index x = 0; x < TILE; ++x) {
            lab[k][x] = BLUR[0] * rows[2][k][x] + BLUR[1] * (rows[1][k][x] + rows[3][k][x]) + BLUR[2] * (rows[0][k][x] + rows[4][k][x]);
        }
    }
    const float most = limits.grow * limits.grow, well = limits.seed * limits.seed;
    bool differs[TILE], above[TILE];
    for (Index x = 0; x < TILE; ++x) {
        const float light = (lab[0][x] - base[0][x]) * scale[0];
        const float a = (lab[1][x] - base[1][x]) * scale[1], b = (lab[2][x] - base[2][x]) * scale[2];
        const float hue = a * a + b * b;
        contrast[x] = hue + light * light;
        const bool shadow = (light < 0) & (hue < most) & (lab[0][x] > limits.shadow_light * base[0][x]);
        differs[x] = (contrast[x] > most) & !shadow;
        above[x] = contrast[x] > well;
    }
    std::pair<int, int> bits{0, 0};
    for (Index x = 0; x < TILE; ++x) {
        bits.first |= differs[x] << x;
        bits.second |= above[x] << x;
    }
    return bits;
}

}  // namespace

ColorTiles::ColorTiles(const Volume<Byte>& color, const Volume<float>& around, const Vector<double>& deviation, const Thresholds& limits)
    : limits(limits), height(color.shape(0)), width(color.shape(1)), rows((height + TILE - 1) / TILE), columns((width + TILE - 1) / TILE),
      differing(height, width), seeds(height, width), color_(color), around_(around), pitch_(columns * TILE + 2 * REACH),
      contrast_((rows * TILE + 2 * REACH) * pitch_), is_evaluated_(rows * columns), along_(positions(width, around.shape(1))),
      down_(positions(height, around.shape(0))) {
    for (Index k = 0; k < CHANNELS; ++k) scale_[k] = 1.0f / float(deviation(k));
}

ColorTiles::~ColorTiles() {
    for (Index row = 0; row < rows * TILE; ++row) {
        float* line = contrast_.data() + (row + REACH) * pitch_ + REACH;
        for (Index column = 0; column < columns; ++column) {
            if (is_evaluated(row / TILE * columns + column)) std::fill_n(line + column * TILE, TILE, 0.0f);
        }
    }
}

WITH_AVX2 void ColorTiles::evaluate(Index tile) {
    const Index top = tile / columns * TILE, left = tile % columns * TILE;
    const Index bottom = std::min(top + TILE, height), size = std::min(TILE, width - left);
    count_visits(WIDE * WIDE);
    is_evaluated_[tile] = 1;
    Plane across[WIDE], surface[2];  // the latter along two rows of the smaller image
    blur_along_rows(top, left, across);
    Index held[2] = {-1, -1};
    for (Index y = top; y < bottom; ++y) {
        for (const Index row : {down_[y].first, down_[y].second}) {
            if (held[row % 2] != row) surface_row(row, left, surface[row % 2]);
            held[row % 2] = row;
        }
        Plane base;
        const Plane &upper = surface[down_[y].first % 2], &lower = surface[down_[y].second % 2];
        for (Index k = 0; k < CHANNELS; ++k) {
            for (Index x = 0; x < TILE; ++x) base[k][x] = upper[k][x] + down_[y].share * (lower[k][x] - upper[k][x]);
        }
        float* contrast = contrast_.data() + (y + REACH) * pitch_ + left + REACH;
        const auto [differ, above] = compare_row(across + (y - top), base, scale_, limits, contrast);
        std::fill(contrast + size, contrast + TILE, 0.0f);
        const int inside = (1 << size) - 1;
        differing.add_eight(y, tile % columns, differ & inside);
        seeds.add_eight(y, tile % columns, above & inside);
    }
}

// Convert the rows of a tile, with those around it, and blur them along the row; the image's border is repeated beyond it.
void ColorTiles::blur_along_rows(Index top, Index left, Plane (&across)[WIDE]) const {
    for (Index i = 0; i < WIDE; ++i) {
        const Byte* row = color_.data() + std::clamp<Index>(top - REACH + i, 0, height - 1) * width * CHANNELS;
        Byte padded[WIDE * CHANNELS];
        if (left >= REACH && left + TILE + REACH <= width) {
            std::memcpy(padded, row + (left - REACH) * CHANNELS, sizeof(padded));
        } else {
            for (Index x = 0; x < WIDE; ++x) {
                std::memcpy(padded + x * CHANNELS, row + std::clamp<Index>(left - REACH + x, 0, width - 1) * CHANNELS, CHANNELS);
            }
        }
        float plane[CHANNELS][WIDE];
        to_lab()(padded, plane);
        for (Index k = 0; k < CHANNELS; ++k) {
            const float* p = plane[k];
            for (Index x = 0; x < TILE; ++x) {
                across[i][k][x] = BLUR[0] * p[x + 2] + BLUR[1] * (p[x + 1] + p[x + 3]) + BLUR[2] * (p[x] + p[x + 4]);
            }
        }
    }
}

// Interpolate the surface's color along a row of the smaller image at the columns of a tile.
void ColorTiles::surface_row(Index row, Index left, Plane& base) const {
    const float* from = around_.data() + row * around_.shape(1) * CHANNELS;
    for (Index x = 0; x < TILE; ++x) {
        const Between& u = along_[std::min(left + x, width - 1)];
        const float *first = from + u.first * CHANNELS, *second = from + u.second * CHANNELS;
        for (Index k = 0; k < CHANNELS; ++k) base[k][x] = first[k] + u.share * (second[k] - first[k]);
    }
}
