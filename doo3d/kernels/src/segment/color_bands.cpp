#include "mask_runs.h"

#include <array>

namespace {

constexpr std::array<float, 3> BLUR = {0.49915f, 0.22851f, 0.02192f};  // Gaussian of 0.8 px: the pixel, and those 1 and 2 away

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

constexpr Index TILE = 8, REACH = 2, WIDE = TILE + 2 * REACH;  // px; the blur and the rule for edges reach so far
constexpr Index ROOT_STEPS = 2048;

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
            const double v = double(i) / 255;
            const float linear = float(v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92);
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

struct Thresholds {
    float grow, seed, seed_share, shadow_light, edge_share;
};

// The tiles that were evaluated, each with the squared contrast of its pixels, in deviations; 0 beyond the image.
class Bands {
   public:
    Bands(const Volume<Byte>& color, const Volume<float>& around, const float* deviation, const Thresholds& limits)
        : color(color), around(around), limits(limits), height(color.shape(0)), width(color.shape(1)),
          rows((height + TILE - 1) / TILE), columns((width + TILE - 1) / TILE), slots(rows * columns, 0), state(height, width),
          seeds(height, width) {
        for (Index k = 0; k < CHANNELS; ++k) scale[k] = 1.0f / deviation[k];
        along = positions(width, around.shape(1));
        down = positions(height, around.shape(0));
    }

    void grow(const Matrix<bool>& places) {
        const double per_row = double(height) / places.shape(0), per_column = double(width) / places.shape(1);
        for_each_set(places, [&](Index i) {
            const double v = i / places.shape(1) + 0.5, u = i % places.shape(1) + 0.5;
            for (const double dv : {-0.6, 0.6}) {
                for (const double du : {-0.6, 0.6}) {
                    const auto y = Index((v + dv) * per_row), x = Index((u + du) * per_column);
                    if (y >= 0 && x >= 0 && y < height && x < width) queue_tile(y / TILE, x / TILE);
                }
            }
        });
        for (std::size_t next = 0; next < queue.size(); ++next) {
            evaluate(queue[next]);
            const Index row = queue[next] / columns, column = queue[next] % columns;
            for (Index dy = -1; dy <= 1; ++dy) {  // a band goes on in the next tile
                for (Index dx = -1; dx <= 1; ++dx) {
                    if (differs_beside(row, column, dy, dx)) queue_tile(row + dy, column + dx);
                }
            }
        }
    }

    // Return the 8-connected parts, without faint edges, of which enough pixels are well above the surface.
    std::vector<Part> parts() const {
        BitImage told(height, width);
        for (const Index tile : queue) cut_edges(tile, told);
        std::vector<Part> parts = parts_of(told);
        const auto is_faint = [&](const Part& part) {
            Index above = 0;
            for (const Run& run : part.runs) {
                for (Index x = run.start; x < run.end; ++x) above += seeds.has(run.row, x);
            }
            return float(above) < limits.seed_share * float(part.size);
        };
        parts.erase(std::remove_if(parts.begin(), parts.end(), is_faint), parts.end());
        return parts;
    }

    // Return the pixels of `mask` that do not differ from the surface, in tiles within `reach` pixels of those with parts. Tiles
    // beside those with parts are evaluated for that; what is not evaluated looks like the surface.
    std::vector<std::int64_t> like_surface(const std::vector<Part>& parts, const Matrix<bool>& mask, Index reach) {
        std::vector<Byte> near(rows * columns, 0);
        const Index around_tile = std::max<Index>((reach + TILE - 1) / TILE, 1);
        std::vector<Index> tiles;
        for (const Part& part : parts) {
            for (const Run& run : part.runs) {
                for (Index column = run.start / TILE; column <= (run.end - 1) / TILE; ++column) {
                    const Index tile = run.row / TILE * columns + column;
                    if (near[tile] < 3) tiles.push_back(tile);
                    near[tile] = 3;
                }
            }
        }
        for (const Index tile : tiles) mark_around(tile, around_tile, near);
        std::vector<std::int64_t> found;
        for (Index tile = 0; tile < rows * columns; ++tile) {
            if (near[tile]) collect(tile, mask, near[tile] > 1, found);
        }
        return found;
    }

   private:
    const Volume<Byte>& color;
    const Volume<float>& around;
    Thresholds limits;
    Index height, width, rows, columns;
    std::vector<std::int32_t> slots;  // of each tile: 0 not evaluated, -1 in the queue, k + 1 its place in `contrast`
    std::vector<std::array<float, TILE * TILE>> contrast;
    BitImage state, seeds;  // differs from the surface, and is well above it
    std::vector<Index> queue;
    float scale[CHANNELS];
    std::vector<Between> along, down;
    static const ToLab& to_lab() {
        static const ToLab table;
        return table;
    }

    void queue_tile(Index row, Index column) {
        if (row < 0 || column < 0 || row >= rows || column >= columns || slots[row * columns + column]) return;
        slots[row * columns + column] = -1;
        queue.push_back(row * columns + column);
    }

    // Tell whether a tile's pixels beside the next one in a direction differ.
    bool differs_beside(Index row, Index column, Index dy, Index dx) const {
        const Index top = row * TILE, bottom = std::min(top + TILE, height) - 1, right = std::min((column + 1) * TILE, width) - 1;
        const int bits = dx < 0 ? 1 : dx > 0 ? 1 << (right % TILE) : 0xFF;
        int any = 0;
        for (Index y = dy > 0 ? bottom : top; y <= (dy < 0 ? top : bottom); ++y) any |= state.eight(y, column) & bits;
        return any != 0;
    }

    void mark_around(Index tile, Index reach, std::vector<Byte>& near) const {
        const Index row = tile / columns, column = tile % columns;
        for (Index r = std::max<Index>(row - reach, 0); r <= std::min(row + reach, rows - 1); ++r) {
            for (Index c = std::max<Index>(column - reach, 0); c <= std::min(column + reach, columns - 1); ++c) {
                const Byte beside = std::abs(int(r - row)) <= 1 && std::abs(int(c - column)) <= 1 ? 2 : 1;
                near[r * columns + c] = std::max(near[r * columns + c], beside);
            }
        }
    }

    void collect(Index tile, const Matrix<bool>& mask, bool beside, std::vector<std::int64_t>& found) {
        const Index left = tile % columns * TILE, right = std::min(left + TILE, width), top = tile / columns * TILE;
        for (Index y = top; y < std::min(top + TILE, height); ++y) {
            const Byte* row = bytes_of(mask) + y * width;
            for (Index x = first_set(row, left, right); x < right; x = first_set(row, x + 1, right)) {
                if (beside && !slots[tile]) evaluate(tile);
                if (!state.has(y, x)) found.push_back(y * width + x);
            }
        }
    }

    WITH_AVX2 void evaluate(Index tile) {
        const Index top = tile / columns * TILE, left = tile % columns * TILE;
        const Index bottom = std::min(top + TILE, height), right = std::min(left + TILE, width);
        count_visits(WIDE * WIDE);
        contrast.emplace_back();
        slots[tile] = std::int32_t(contrast.size());
        contrast.back().fill(0.0f);
        float across[WIDE][CHANNELS][TILE];
        blur_along_rows(top, left, across);
        float surface[2][CHANNELS][TILE];  // along two rows of the smaller image
        Index held[2] = {-1, -1};
        for (Index y = top; y < bottom; ++y) {
            const auto* at = across + (y - top);
            float lab[CHANNELS][TILE], base[CHANNELS][TILE];
            for (const Index row : {down[y].first, down[y].second}) {
                if (held[row % 2] != row) surface_row(row, left, surface[row % 2]);
                held[row % 2] = row;
            }
            for (Index k = 0; k < CHANNELS; ++k) {
                for (Index x = 0; x < TILE; ++x) {
                    lab[k][x] = BLUR[0] * at[2][k][x] + BLUR[1] * (at[1][k][x] + at[3][k][x]) + BLUR[2] * (at[0][k][x] + at[4][k][x]);
                }
            }
            const auto &upper = surface[down[y].first % 2], &lower = surface[down[y].second % 2];
            for (Index k = 0; k < CHANNELS; ++k) {
                for (Index x = 0; x < TILE; ++x) base[k][x] = upper[k][x] + down[y].share * (lower[k][x] - upper[k][x]);
            }
            float* value = contrast.back().data() + (y - top) * TILE;
            const float most = limits.grow * limits.grow, well = limits.seed * limits.seed;
            bool differs[TILE], above[TILE];
            for (Index x = 0; x < TILE; ++x) {
                const float light = (lab[0][x] - base[0][x]) * scale[0];
                const float a = (lab[1][x] - base[1][x]) * scale[1], b = (lab[2][x] - base[2][x]) * scale[2];
                const float hue = a * a + b * b;
                value[x] = hue + light * light;
                const bool shadow = (light < 0) & (hue < most) & (lab[0][x] > limits.shadow_light * base[0][x]);
                differs[x] = (value[x] > most) & !shadow;
                above[x] = value[x] > well;
            }
            std::fill(value + (right - left), value + TILE, 0.0f);
            int differ = 0, well_above = 0;
            for (Index x = 0; x < right - left; ++x) differ |= differs[x] << x, well_above |= above[x] << x;
            state.add_eight(y, tile % columns, differ);
            seeds.add_eight(y, tile % columns, well_above);
        }
    }

    // Convert the rows of a tile, with those around it, and blur them along the row; the image's border is repeated beyond it.
    void blur_along_rows(Index top, Index left, float (&across)[WIDE][CHANNELS][TILE]) const {
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
    }

    // Interpolate the surface's color along a row of the smaller image at the columns of a tile.
    void surface_row(Index row, Index left, float (&base)[CHANNELS][TILE]) const {
        const float* from = around.data() + row * around.shape(1) * CHANNELS;
        for (Index x = 0; x < TILE; ++x) {
            const Between& u = along[std::min(left + x, width - 1)];
            const float *first = from + u.first * CHANNELS, *second = from + u.second * CHANNELS;
            for (Index k = 0; k < CHANNELS; ++k) base[k][x] = first[k] + u.share * (second[k] - first[k]);
        }
    }

    // Add the pixels of a tile that differ, without those at an edge that have little of the contrast beside them.
    void cut_edges(Index tile, BitImage& told) const {
        const Index row = tile / columns, column = tile % columns, top = row * TILE, bottom = std::min(top + TILE, height);
        int across[WIDE], any = 0;  // bits of the rows with two pixels on either side; beyond the image nothing is an edge
        for (Index i = 0; i < WIDE; ++i) {
            const Index y = top - REACH + i;
            across[i] = y < 0 || y >= height ? 0xFFF : bits_around(y, column);
        }
        int inside[TILE];
        for (Index y = top; y < bottom; ++y) {
            const int* at = across + (y - top);
            const int all = at[0] & at[1] & at[2] & at[3] & at[4];
            inside[y - top] = all & (all >> 1) & (all >> 2) & (all >> 3) & (all >> 4);
            any |= state.eight(y, column) & ~inside[y - top];
        }
        float peak[TILE][TILE];
        if (any) peaks(row, column, peak);
        const float* own = contrast[slots[tile] - 1].data();
        for (Index y = top; y < bottom; ++y) {
            const int differs = state.eight(y, column);
            int kept = differs & inside[y - top];
            for (Index x = 0; x < TILE; ++x) {
                if (!((differs & ~kept) >> x & 1)) continue;
                const bool faint = own[(y - top) * TILE + x] <= limits.edge_share * limits.edge_share * peak[y - top][x];
                kept |= !faint << x;
            }
            told.add_eight(y, column, kept);
        }
    }
    int bits_around(Index y, Index column) const {
        const int before = column > 0 ? state.eight(y, column - 1) >> (TILE - REACH) : 3;
        const int after = column + 1 < columns ? state.eight(y, column + 1) & 3 : 3;
        int bits = before | state.eight(y, column) << REACH | after << (TILE + REACH);
        for (Index x = width - column * TILE; x < TILE + REACH; ++x) bits |= 1 << (x + REACH);
        return bits;
    }

    // Return the highest contrast within REACH of each pixel of a tile.
    void peaks(Index row, Index column, float (&peak)[TILE][TILE]) const {
        float window[WIDE][WIDE];
        for (Index i = 0; i < WIDE; ++i) {
            const Index y = row * TILE - REACH + i, r = y < 0 ? -1 : y / TILE;
            for (Index dx = -1; dx <= 1; ++dx) {
                const Index c = column + dx, from = dx < 0 ? TILE - REACH : 0, count = dx ? REACH : TILE;
                float* to = window[i] + (dx < 0 ? 0 : dx ? REACH + TILE : REACH);
                const std::int32_t slot = r < 0 || r >= rows || c < 0 || c >= columns ? 0 : slots[r * columns + c];
                if (slot <= 0) std::fill(to, to + count, 0.0f);
                else std::copy_n(contrast[slot - 1].data() + y % TILE * TILE + from, count, to);
            }
        }
        float along_row[WIDE][TILE];
        for (Index i = 0; i < WIDE; ++i) {
            const float* w = window[i];
            for (Index x = 0; x < TILE; ++x) {
                along_row[i][x] = std::max(std::max(std::max(w[x], w[x + 1]), std::max(w[x + 2], w[x + 3])), w[x + 4]);
            }
        }
        for (Index i = 0; i < TILE; ++i) {
            const auto* w = along_row + i;
            for (Index x = 0; x < TILE; ++x) {
                peak[i][x] = std::max(std::max(std::max(w[0][x], w[1][x]), std::max(w[2][x], w[3][x])), w[4][x]);
            }
        }
    }
};

auto color_bands(Volume<Byte> color, Volume<float> around, Vector<double> deviation, Matrix<bool> seeds, Matrix<bool> beside, Index reach,
                 Index min_pixels, Vector<double> limits) {
    const Index height = color.shape(0), width = color.shape(1);
    require(color.shape(2) == CHANNELS && around.shape(2) == CHANNELS, "an image is not (H, W, 3)");
    require(height > 0 && width > 0 && around.shape(0) > 0 && around.shape(1) > 0, "an image has no pixels");
    require(seeds.shape(0) > 0 && seeds.shape(1) > 0, "there are no seeds' pixels");
    require(Index(beside.shape(0)) == height && Index(beside.shape(1)) == width, "color and beside differ in size");
    require(deviation.shape(0) == CHANNELS && limits.shape(0) == 5, "deviation is not (3,), or limits not (5,)");
    float deviations[CHANNELS];
    for (Index k = 0; k < CHANNELS; ++k) {
        require(deviation(k) > 0, "a deviation is not over 0");
        deviations[k] = float(deviation(k));
    }
    const Thresholds thresholds{float(limits(0)), float(limits(1)), float(limits(2)), float(limits(3)), float(limits(4))};
    MeasuredParts found;
    std::vector<std::int64_t> surface;
    Bands bands(color, around, deviations, thresholds);
    bands.grow(seeds);
    const std::vector<Part> parts = bands.parts();
    surface = bands.like_surface(parts, beside, reach);
    found = measure(parts, height, width, min_pixels, BitImage(height, width));
    return std::tuple_cat(found.to_python(), std::make_tuple(std::move(surface)));
}

}  // namespace

void bind_color_bands(Module& m) {
    // Return the bands of an image that differ in color from the surface around them, and pixels beside them that do not.
    //
    // The image, in CIELAB blurred by a Gaussian of 0.8 px, is evaluated in tiles of 8 px, only at the seeds and on from there as
    // far as it differs. A pixel differs whose contrast is above a threshold, and that is no shadow: darker, without another color.
    //
    // Parameters
    // ----------
    // color
    //     (H, W, 3) uint8 RGB.
    // around
    //     (h, w, 3) float32, the surface's color in OpenCV's 8-bit CIELAB, of a smaller image.
    // deviation
    //     (3,) over 0, deviations of the surface's color: the unit of contrast.
    // seeds
    //     (r, c) bool, the pixels of a smaller image at which bands are looked for.
    // beside
    //     (H, W) bool; tiles with such pixels beside those with bands are evaluated too.
    // reach
    //     px from a tile with bands within which pixels of `beside` are looked at.
    // min_pixels
    //     pixels of a band below which its widths are not measured.
    // limits
    //     (5,) the contrast from which a pixel differs; the one that a band's share of pixels, limits[2], has at least; the share of
    //     lightness that a shadow leaves at least; the share of the contrast within 2 px that a band's edge has at least.
    //
    // Returns
    // -------
    // pixels, starts, half_widths, holds : the 8-connected bands without their faint edges, as `mask_parts` returns parts; all of
    //     `holds` are False.
    // surface : (N,) row-major indices of the pixels of `beside`, in tiles within `reach` of a band's, that do not differ; those in
    //     tiles that were not evaluated count as such.
    m.def("color_bands", &color_bands, "color"_array, "around"_array, "deviation"_array, "seeds"_array,
          "beside"_array, "reach"_a, "min_pixels"_a, "limits"_array);
}
