// Bands that differ in color from the surface around them: evaluated tile by tile, only where a smaller image shows one.
#include "arrays.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>

namespace {

constexpr Index TILE = 8, REACH = 2, WIDE = TILE + 2 * REACH, CHANNELS = 3;  // px; the blur and the rule for edges reach so far
constexpr std::array<float, REACH + 1> BLUR = {0.49915f, 0.22851f, 0.02192f};  // Gaussian of 0.8 px
constexpr Index ROOT_STEPS = 2048;
constexpr Byte DIFFERS = 1, BAND = 2;

// 8-bit sRGB to CIELAB in OpenCV's 8-bit scale of lightness, with the color axes around 128.
struct ToLab {
    std::array<float, 256> linear;
    std::array<float, ROOT_STEPS + 2> root;

    ToLab() {
        for (std::size_t i = 0; i < linear.size(); ++i) {
            const double v = double(i) / (linear.size() - 1);
            linear[i] = float(v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92);
        }
        for (std::size_t i = 0; i < root.size(); ++i) {
            const double t = double(i) / ROOT_STEPS;
            root[i] = float(t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0);
        }
    }
    float cube_root(float t) const {
        const float at = std::min(std::max(t, 0.0f), 1.0f) * ROOT_STEPS;
        const int i = int(at);
        return root[i] + (at - float(i)) * (root[i + 1] - root[i]);
    }
    // Convert the pixels of a row of a tile, channel by channel.
    void operator()(const Byte (&rgb)[WIDE * CHANNELS], float (&lab)[CHANNELS][WIDE]) const {
        float r[CHANNELS][WIDE];
        for (Index x = 0; x < WIDE; ++x) {
            const float red = linear[rgb[3 * x]], green = linear[rgb[3 * x + 1]], blue = linear[rgb[3 * x + 2]];
            r[0][x] = (0.412453f * red + 0.357580f * green + 0.180423f * blue) * (1 / 0.950456f);
            r[1][x] = 0.212671f * red + 0.715160f * green + 0.072169f * blue;
            r[2][x] = (0.019334f * red + 0.119193f * green + 0.950227f * blue) * (1 / 1.088754f);
        }
        for (Index k = 0; k < CHANNELS; ++k) {
            for (Index x = 0; x < WIDE; ++x) r[k][x] = cube_root(r[k][x]);
        }
        for (Index x = 0; x < WIDE; ++x) {
            lab[0][x] = 2.55f * (116.0f * r[1][x] - 16.0f);
            lab[1][x] = 500.0f * (r[0][x] - r[1][x]) + 128.0f;
            lab[2][x] = 200.0f * (r[1][x] - r[2][x]) + 128.0f;
        }
    }
};

// Two pixels of a smaller image, and the share of the second one.
struct Between {
    Index first, second;
    float share;
};

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

struct Thresholds {
    float grow, seed, seed_share, shadow_light, edge_share;
};

class Bands {
   public:
    Bands(const Volume<Byte>& color, const Volume<float>& around, const float* deviation, const Thresholds& limits)
        : color(color), around(around), limits(limits), height(color.shape(0)), width(color.shape(1)),
          rows((height + TILE - 1) / TILE), columns((width + TILE - 1) / TILE), contrast(static_cast<float*>(std::calloc(height * width, sizeof(float)))),
          state(new bool[height * width]()), done(rows * columns, 0), seen(height * width, 0) {
        count_bytes(3 * height * width);  // state, seen and the result
        for (Index k = 0; k < CHANNELS; ++k) scale[k] = 1.0f / deviation[k];
        along = positions(width, around.shape(1));
        down = positions(height, around.shape(0));
    }
    ~Bands() { std::free(contrast); }

    void grow(const Matrix<bool>& seeds) {
        const double per_row = double(height) / seeds.shape(0), per_column = double(width) / seeds.shape(1);
        for_each_set(seeds, [&](Index i) {
            const double v = i / seeds.shape(1) + 0.5, u = i % seeds.shape(1) + 0.5;
            for (const double dv : {-0.6, 0.6}) {
                for (const double du : {-0.6, 0.6}) queue_pixel(Index((v + dv) * per_row), Index((u + du) * per_column));
            }
        });
        for (std::size_t next = 0; next < queue.size(); ++next) {
            const Index row = queue[next] / columns, column = queue[next] % columns;
            evaluate(queue[next]);
            const Index top = row * TILE, left = column * TILE, bottom = std::min(top + TILE, height) - 1;
            const Index right = std::min(left + TILE, width) - 1;
            for (Index x = left; x <= right; ++x) {  // a band goes on in the next tile
                if (differs(top, x)) around_pixel(top, x);
                if (differs(bottom, x)) around_pixel(bottom, x);
            }
            for (Index y = top; y <= bottom; ++y) {
                if (differs(y, left)) around_pixel(y, left);
                if (differs(y, right)) around_pixel(y, right);
            }
        }
        cut_edges();
        keep_seeded();
    }

    // Evaluate also the tiles with pixels of `mask` beside tiles with bands: what is not evaluated looks like the surface.
    void evaluate_beside(const Matrix<bool>& mask) {
        std::vector<Byte> beside(rows * columns, 0);
        for (const Index pixel : kept) {
            const Index row = pixel / width / TILE, column = pixel % width / TILE;
            if (beside[row * columns + column] == 2) continue;
            for (Index r = std::max<Index>(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
                for (Index c = std::max<Index>(column - 1, 0); c <= std::min(column + 1, columns - 1); ++c) {
                    beside[r * columns + c] = std::max<Byte>(beside[r * columns + c], 1);
                }
            }
            beside[row * columns + column] = 2;
        }
        for (Index tile = 0; tile < rows * columns; ++tile) {
            if (!beside[tile] || done[tile]) continue;
            const Index left = tile % columns * TILE, right = std::min(left + TILE, width);
            for (Index y = tile / columns * TILE; y < std::min((tile / columns + 1) * TILE, height); ++y) {
                if (first_set(bytes_of(mask) + y * width, left, right) < right) {
                    evaluate(tile);
                    break;
                }
            }
        }
    }

    auto result() {
        auto* band = new bool[height * width]();
        for (const Index pixel : kept) band[pixel] = true;
        nb::capsule own_band(band, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
        nb::capsule own_state(state, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
        const auto shape = {std::size_t(height), std::size_t(width)};
        return std::make_pair(MatrixResult<bool>(band, shape, own_band), MatrixResult<bool>(state, shape, own_state));
    }

   private:
    const Volume<Byte>& color;
    const Volume<float>& around;
    Thresholds limits;
    Index height, width, rows, columns;
    float* contrast;  // squared, in deviations; 0 in tiles that are not evaluated
    bool* state;      // differs from the surface
    std::vector<Byte> done, seen;
    std::vector<Index> queue, told, kept;
    float scale[CHANNELS];
    std::vector<Between> along, down;
    static const ToLab& to_lab() {
        static const ToLab table;
        return table;
    }

    bool differs(Index y, Index x) const { return state[y * width + x]; }

    void queue_pixel(Index y, Index x) {
        if (y < 0 || x < 0 || y >= height || x >= width) return;
        const Index tile = y / TILE * columns + x / TILE;
        if (done[tile]) return;
        done[tile] = 1;
        queue.push_back(tile);
    }
    void around_pixel(Index y, Index x) {
        for (Index dy = -1; dy <= 1; ++dy) {
            for (Index dx = -1; dx <= 1; ++dx) queue_pixel(y + dy, x + dx);
        }
    }

    void evaluate(Index tile) {
        done[tile] = 2;
        count_visits(WIDE * WIDE);
        const Index top = tile / columns * TILE, left = tile % columns * TILE;
        const Index bottom = std::min(top + TILE, height), right = std::min(left + TILE, width);
        float across[WIDE][CHANNELS][TILE];
        for (Index i = 0; i < WIDE; ++i) {
            const Byte* row = color.data() + std::min(std::max<Index>(top - REACH + i, 0), height - 1) * width * CHANNELS;
            Byte padded[WIDE * CHANNELS];
            if (left >= REACH && left + TILE + REACH <= width) {
                std::memcpy(padded, row + (left - REACH) * CHANNELS, sizeof(padded));
            } else {
                for (Index x = 0; x < WIDE; ++x) {
                    std::memcpy(padded + x * CHANNELS, row + std::min(std::max<Index>(left - REACH + x, 0), width - 1) * CHANNELS, CHANNELS);
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
        for (Index y = top; y < bottom; ++y) {
            const auto* at = across + (y - top);
            float lab[CHANNELS][TILE], base[CHANNELS][TILE];
            for (Index k = 0; k < CHANNELS; ++k) {
                for (Index x = 0; x < TILE; ++x) {
                    lab[k][x] = BLUR[0] * at[2][k][x] + BLUR[1] * (at[1][k][x] + at[3][k][x]) + BLUR[2] * (at[0][k][x] + at[4][k][x]);
                }
            }
            surface_row(y, left, base);
            float value[TILE];
            bool differs[TILE];
            const float most = limits.grow * limits.grow;
            for (Index x = 0; x < TILE; ++x) {
                const float light = (lab[0][x] - base[0][x]) * scale[0];
                const float a = (lab[1][x] - base[1][x]) * scale[1], b = (lab[2][x] - base[2][x]) * scale[2];
                const float hue = a * a + b * b;
                value[x] = hue + light * light;
                const bool shadow = (light < 0) & (hue < most) & (lab[0][x] > limits.shadow_light * base[0][x]);
                differs[x] = (value[x] > most) & !shadow;
            }
            std::copy(value, value + (right - left), contrast + y * width + left);
            std::copy(differs, differs + (right - left), state + y * width + left);
        }
    }

    // Interpolate the surface's color, given on an image some times smaller, at the pixels of a row of a tile.
    void surface_row(Index y, Index left, float (&base)[CHANNELS][TILE]) const {
        const Between& v = down[y];
        const float *upper = around.data() + v.first * around.shape(1) * CHANNELS, *lower = around.data() + v.second * around.shape(1) * CHANNELS;
        for (Index x = 0; x < TILE; ++x) {
            const Between& u = along[std::min(left + x, width - 1)];
            const Index i = u.first * CHANNELS, j = u.second * CHANNELS;
            for (Index k = 0; k < CHANNELS; ++k) {
                const float a = upper[i + k] + u.share * (upper[j + k] - upper[i + k]);
                const float b = lower[i + k] + u.share * (lower[j + k] - lower[i + k]);
                base[k][x] = a + v.share * (b - a);
            }
        }
    }

    // Collect the pixels of bands without those at an edge that have little of the contrast beside them.
    void cut_edges() {
        std::sort(queue.begin(), queue.end());
        count_visits(Index(queue.size()) * TILE * TILE);
        for (const Index tile : queue) {
            const Index top = tile / columns * TILE, left = tile % columns * TILE, right = std::min(left + TILE, width);
            for (Index y = top; y < std::min(top + TILE, height); ++y) {
                const Byte* row = reinterpret_cast<const Byte*>(state) + y * width;
                for (Index x = first_set(row, left, right); x < right; x = first_set(row, x + 1, right)) {
                    if (!is_cut(y, x)) told.push_back(y * width + x);
                }
            }
        }
        for (const Index pixel : told) seen[pixel] = DIFFERS;
    }
    bool is_cut(Index y, Index x) const {
        const Index top = std::max<Index>(y - REACH, 0), bottom = std::min(y + REACH, height - 1);
        const Index left = std::max<Index>(x - REACH, 0), right = std::min(x + REACH, width - 1);
        bool edge = false;
        for (Index v = top; v <= bottom && !edge; ++v) {
            for (Index u = left; u <= right; ++u) edge |= !state[v * width + u];
        }
        if (!edge) return false;
        float peak = 0.0f;
        for (Index v = top; v <= bottom; ++v) {
            for (Index u = left; u <= right; ++u) peak = std::max(peak, contrast[v * width + u]);
        }
        return contrast[y * width + x] <= limits.edge_share * limits.edge_share * peak;
    }

    // Keep the 8-connected parts of which enough pixels are well above the surface.
    void keep_seeded() {
        count_visits(2 * Index(told.size()));
        std::vector<Index> part;
        for (const Index start : told) {
            if (seen[start] != DIFFERS) continue;
            seen[start] = BAND;
            part.assign(1, start);
            Index seeds = 0;
            for (std::size_t next = 0; next < part.size(); ++next) {
                const Index y = part[next] / width, x = part[next] % width;
                seeds += contrast[part[next]] > limits.seed * limits.seed;
                for (Index v = std::max<Index>(y - 1, 0); v <= std::min(y + 1, height - 1); ++v) {
                    for (Index u = std::max<Index>(x - 1, 0); u <= std::min(x + 1, width - 1); ++u) {
                        if (seen[v * width + u] != DIFFERS) continue;
                        seen[v * width + u] = BAND;
                        part.push_back(v * width + u);
                    }
                }
            }
            if (float(seeds) >= limits.seed_share * float(part.size())) kept.insert(kept.end(), part.begin(), part.end());
        }
    }
};

auto color_bands(Volume<Byte> color, Volume<float> around, Vector<double> deviation, Matrix<bool> seeds, Matrix<bool> beside,
                 Vector<double> limits) {
    require(color.shape(2) == CHANNELS && around.shape(2) == CHANNELS, "an image is not (H, W, 3)");
    require(color.shape(0) > 0 && color.shape(1) > 0 && around.shape(0) > 0 && around.shape(1) > 0, "an image has no pixels");
    require(seeds.shape(0) > 0 && seeds.shape(1) > 0, "there are no seeds' pixels");
    require(beside.shape(0) == color.shape(0) && beside.shape(1) == color.shape(1), "color and beside differ in size");
    require(deviation.shape(0) == CHANNELS && limits.shape(0) == 5, "deviation is not (3,), or limits not (5,)");
    float deviations[CHANNELS];
    for (Index k = 0; k < CHANNELS; ++k) {
        require(deviation(k) > 0, "a deviation is not over 0");
        deviations[k] = float(deviation(k));
    }
    Bands bands(color, around, deviations, {float(limits(0)), float(limits(1)), float(limits(2)), float(limits(3)), float(limits(4))});
    bands.grow(seeds);
    bands.evaluate_beside(beside);
    return bands.result();
}

constexpr float STRAIGHT = 0.955f, DIAGONAL = 1.3693f;  // the chamfer distance of 3 x 3 pixels

// Return the value at a share of sorted values, between neighbors as NumPy's percentile does.
float percentile(std::vector<float>& values, double share) {
    const double at = share * double(values.size() - 1);
    const auto low = std::size_t(at);
    std::nth_element(values.begin(), values.begin() + low, values.end());
    const float first = values[low];
    if (low + 1 == values.size()) return first;
    return first + float(at - double(low)) * (*std::min_element(values.begin() + low + 1, values.end()) - first);
}

auto mask_parts(Matrix<bool> mask, Index min_pixels) {
    const Index height = mask.shape(0), width = mask.shape(1), across = width + 2;
    // distance to the next pixel outside the mask; beyond the image nothing is known
    std::vector<float> inside((height + 2) * across, 0.0f);
    for (Index x = 0; x < across; ++x) inside[x] = inside[(height + 1) * across + x] = std::numeric_limits<float>::max();
    for (Index y = 0; y < height + 2; ++y) inside[y * across] = inside[y * across + width + 1] = std::numeric_limits<float>::max();
    std::vector<Index> set;
    for_each_set(mask, [&](Index i) {
        const Index at = (i / width + 1) * across + i % width + 1;
        set.push_back(at);
        inside[at] = std::min({inside[at - across - 1] + DIAGONAL, inside[at - across] + STRAIGHT, inside[at - across + 1] + DIAGONAL,
                               inside[at - 1] + STRAIGHT});
    });
    for (auto it = set.rbegin(); it != set.rend(); ++it) {
        const Index at = *it;
        inside[at] = std::min({inside[at], inside[at + across + 1] + DIAGONAL, inside[at + across] + STRAIGHT,
                               inside[at + across - 1] + DIAGONAL, inside[at + 1] + STRAIGHT});
    }
    std::vector<Byte> open(inside.size(), 0);
    count_bytes(Index(inside.size()) * 5);
    count_visits(2 * Index(set.size()));
    for (const Index at : set) open[at] = 1;
    for (Index x = 0; x < across; ++x) inside[x] = inside[(height + 1) * across + x] = 0.0f;
    for (Index y = 0; y < height + 2; ++y) inside[y * across] = inside[y * across + width + 1] = 0.0f;
    std::vector<std::int64_t> pixels, starts{0};
    std::vector<double> half;
    std::vector<Index> part;
    std::vector<float> middle;
    pixels.reserve(set.size());
    const Index around[] = {-across - 1, -across, -across + 1, -1, 1, across - 1, across, across + 1};
    for (const Index start : set) {
        if (!open[start]) continue;
        open[start] = 0;
        part.assign(1, start);
        middle.clear();
        for (std::size_t next = 0; next < part.size(); ++next) {
            const Index at = part[next];
            float most = 0.0f;
            for (const Index step : around) {
                most = std::max(most, inside[at + step]);
                if (!open[at + step]) continue;
                open[at + step] = 0;
                part.push_back(at + step);
            }
            if (inside[at] >= most - 1e-3f) middle.push_back(inside[at] - 0.5f);
            pixels.push_back((at / across - 1) * width + at % across - 1);
        }
        starts.push_back(std::int64_t(pixels.size()));
        const bool measured = Index(part.size()) >= min_pixels && !middle.empty();
        half.push_back(measured ? percentile(middle, 0.5) : 0.0);
        half.push_back(measured ? percentile(middle, 0.85) : 0.0);
    }
    const std::size_t parts = starts.size() - 1;
    return nb::make_tuple(to_numpy(std::move(pixels)), to_numpy(std::move(starts)), to_numpy(std::move(half), parts, 2));
}

}  // namespace

void bind_color_bands(nb::module_& m) {
    m.def("color_bands", &color_bands, "color"_a.noconvert(), "around"_a.noconvert(), "deviation"_a.noconvert(), "seeds"_a.noconvert(),
          "beside"_a.noconvert(), "limits"_a.noconvert());
    m.def("mask_parts", &mask_parts, "mask"_a.noconvert(), "min_pixels"_a);
}
