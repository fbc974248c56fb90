#include "color_tiles.h"
#include "mask_runs.h"

namespace {

// Bands grow from tile to tile as far as their pixels differ.
class Bands {
   public:
    explicit Bands(ColorTiles& tiles) : tiles(tiles), height(tiles.height), width(tiles.width), rows(tiles.rows), columns(tiles.columns) {}

    void grow(const Matrix<bool>& places) {
        const double per_row = double(height) / places.shape(0), per_column = double(width) / places.shape(1);
        std::vector<Byte> is_queued(rows * columns);
        const auto add = [&](Index row, Index column) {
            if (row < 0 || column < 0 || row >= rows || column >= columns || is_queued[row * columns + column]) return;
            is_queued[row * columns + column] = 1;
            queue.push_back(row * columns + column);
        };
        for_each_set(places, [&](Index i) {
            const double v = i / places.shape(1) + 0.5, u = i % places.shape(1) + 0.5;
            for (Index corner = 0; corner < 4; ++corner) {
                const double dv = corner < 2 ? -0.6 : 0.6, du = corner % 2 ? 0.6 : -0.6;
                const auto y = Index((v + dv) * per_row), x = Index((u + du) * per_column);
                if (y >= 0 && x >= 0 && y < height && x < width) add(y / TILE, x / TILE);
            }
        });
        for (std::size_t next = 0; next < queue.size(); ++next) {
            tiles.evaluate(queue[next]);
            const Index row = queue[next] / columns, column = queue[next] % columns;
            for (Index beside = 0; beside < 9; ++beside) {  // a band goes on in the next tile
                const Index dy = beside / 3 - 1, dx = beside % 3 - 1;
                if (differs_beside(row, column, dy, dx)) add(row + dy, column + dx);
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
                for (Index x = run.start; x < run.end; ++x) above += tiles.seeds.has(run.row, x);
            }
            return float(above) < tiles.limits.seed_share * float(part.size);
        };
        parts.erase(std::remove_if(parts.begin(), parts.end(), is_faint), parts.end());
        return parts;
    }

    // Return the pixels of `mask` that do not differ from the surface, in tiles within `reach` pixels of those with parts. Tiles
    // beside those with parts are evaluated for that; what is not evaluated looks like the surface.
    std::vector<std::int64_t> like_surface(const std::vector<Part>& parts, const Matrix<bool>& mask, Index reach) {
        enum : Byte { FAR, NEAR, BESIDE, WITH_PARTS };
        std::vector<Byte> near(rows * columns, FAR);
        const Index around = std::max<Index>((reach + TILE - 1) / TILE, 1);
        std::vector<Index> with_parts;
        const auto add = [&](const Run& run) {
            for (Index column = run.start / TILE; column <= (run.end - 1) / TILE; ++column) {
                const Index tile = run.row / TILE * columns + column;
                if (near[tile] != WITH_PARTS) with_parts.push_back(tile);
                near[tile] = WITH_PARTS;
            }
        };
        for (const Part& part : parts) std::for_each(part.runs.begin(), part.runs.end(), add);
        for (const Index tile : with_parts) {
            mark_around(tile, around, NEAR, near);
            mark_around(tile, 1, BESIDE, near);
        }
        std::vector<std::int64_t> found;
        for (Index tile = 0; tile < rows * columns; ++tile) {
            if (near[tile]) collect(tile, mask, near[tile] >= BESIDE, found);
        }
        return found;
    }

   private:
    ColorTiles& tiles;
    const Index height, width, rows, columns;
    std::vector<Index> queue;

    // Tell whether a tile's pixels beside the next one in a direction differ.
    bool differs_beside(Index row, Index column, Index dy, Index dx) const {
        const Index top = row * TILE, bottom = std::min(top + TILE, height) - 1, right = std::min((column + 1) * TILE, width) - 1;
        const int bits = dx < 0 ? 1 : dx > 0 ? 1 << (right % TILE) : 0xFF;
        int any = 0;
        for (Index y = dy > 0 ? bottom : top; y <= (dy < 0 ? top : bottom); ++y) any |= tiles.differing.eight(y, column) & bits;
        return any != 0;
    }

    void mark_around(Index tile, Index reach, Byte mark, std::vector<Byte>& near) const {
        const Index row = tile / columns, column = tile % columns;
        for (Index r = std::max<Index>(row - reach, 0); r <= std::min(row + reach, rows - 1); ++r) {
            for (Index c = std::max<Index>(column - reach, 0); c <= std::min(column + reach, columns - 1); ++c) {
                near[r * columns + c] = std::max(near[r * columns + c], mark);
            }
        }
    }

    void collect(Index tile, const Matrix<bool>& mask, bool beside, std::vector<std::int64_t>& found) {
        const Index left = tile % columns * TILE, right = std::min(left + TILE, width), top = tile / columns * TILE;
        for (Index y = top; y < std::min(top + TILE, height); ++y) {
            const Byte* row = bytes_of(mask) + y * width;
            for (Index x = first_set(row, left, right); x < right; x = first_set(row, x + 1, right)) {
                if (beside && !tiles.is_evaluated(tile)) tiles.evaluate(tile);
                if (!tiles.differing.has(y, x)) found.push_back(y * width + x);
            }
        }
    }

    // Add the pixels of a tile that differ, without those at an edge that have little of the contrast beside them.
    void cut_edges(Index tile, BitImage& told) const {
        const Index column = tile % columns, top = tile / columns * TILE, bottom = std::min(top + TILE, height);
        int across[WIDE];  // bits of the rows with two pixels on either side; beyond the image nothing is an edge
        for (Index i = 0; i < WIDE; ++i) {
            const Index y = top - REACH + i;
            across[i] = y < 0 || y >= height ? 0xFFF : bits_around(y, column);
        }
        for (Index y = top; y < bottom; ++y) {
            const int *at = across + (y - top), all = at[0] & at[1] & at[2] & at[3] & at[4];
            const int differs = tiles.differing.eight(y, column), inside = all & (all >> 1) & (all >> 2) & (all >> 3) & (all >> 4);
            int kept = differs & inside;
            for (Index x = 0; x < TILE; ++x) {
                if ((differs & ~inside) >> x & 1) kept |= !is_faint(y, column * TILE + x) << x;
            }
            told.add_eight(y, column, kept);
        }
    }
    int bits_around(Index y, Index column) const {
        const int before = column > 0 ? tiles.differing.eight(y, column - 1) >> (TILE - REACH) : 3;
        const int after = column + 1 < columns ? tiles.differing.eight(y, column + 1) & 3 : 3;
        int bits = before | tiles.differing.eight(y, column) << REACH | after << (TILE + REACH);
        for (Index x = width - column * TILE; x < TILE + REACH; ++x) bits |= 1 << (x + REACH);
        return bits;
    }

    // Tell whether a pixel has little of the highest contrast within REACH of it.
    bool is_faint(Index row, Index column) const {
        float peak = 0.0f;
        for (Index y = row - REACH; y <= row + REACH; ++y) {
            const float* line = tiles.contrast(y, column - REACH);
            peak = std::max(peak, *std::max_element(line, line + 2 * REACH + 1));
        }
        return *tiles.contrast(row, column) <= tiles.limits.edge_share * tiles.limits.edge_share * peak;
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
    for (Index k = 0; k < CHANNELS; ++k) require(deviation(k) > 0, "a deviation is not over 0");
    ColorTiles tiles(color, around, deviation, {float(limits(0)), float(limits(1)), float(limits(2)), float(limits(3)), float(limits(4))});
    Bands bands(tiles);
    bands.grow(seeds);
    const std::vector<Part> parts = bands.parts();
    std::vector<std::int64_t> surface = bands.like_surface(parts, beside, reach);
    MeasuredParts found = measure(parts, height, width, min_pixels, BitImage(height, width));
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
    m.def("color_bands", &color_bands, "color"_array, "around"_array, "deviation"_array, "seeds"_array, "beside"_array, "reach"_a,
          "min_pixels"_a, "limits"_array);
}
