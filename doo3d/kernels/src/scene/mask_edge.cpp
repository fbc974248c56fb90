// The edge of a mask, and where the colors of the image say that it is: on bits and on the runs of rows near the mask only.
#include "appearance.h"
#include "image.h"
#include "mask_runs.h"

namespace {

// Return half the widths of the pixels within a chamfer distance of one, in its row and in the rows above and below.
std::vector<Index> chamfer_ball(double px) {
    std::vector<Index> half_widths;
    for (Index row = 0; row * STRAIGHT <= px; ++row) {
        Index column = 0;
        while (std::min(row, column + 1) * DIAGONAL + std::abs(row - column - 1) * STRAIGHT <= px) ++column;
        half_widths.push_back(column);
    }
    return half_widths;
}

// All is in the box of the mask and its ring: distances are dilations of bits, samples are steps through runs, and log-odds are
// looked up and smoothed in the rows near the band, seven at a time.
class MaskEdge {
   public:
    MaskEdge(Matrix<bool> mask, double band_px, double ring_px) : height(mask.shape(0)), width(mask.shape(1)) {
        require(band_px >= 0 && ring_px >= band_px && std::isfinite(ring_px), "band_px and ring_px are no distances in this order");
        const Index margin = std::max<Index>(Index(ring_px), 1);
        Crop crop = cropped(mask, margin);
        part = std::move(crop.bits);
        top = crop.top;
        left = crop.left;
        room = margin - Index(band_px / STRAIGHT);
        band = part.dilated(chamfer_ball(band_px));
        surround = ~band;
        surround &= ring = part.dilated(chamfer_ball(ring_px));
        found = part;
    }

    auto inside() const {
        const BitImage core = found.eroded(SQUARE);
        return pixels_of(core.any() ? core : found, 1);
    }

    auto around(Index most) const {
        require(most > 0, "no pixel is wanted");
        std::vector<std::int64_t> pixels = pixels_of(surround, std::max<Index>(1, surround.count() / most));
        return pixels;
    }

    void move(Volume<Byte> color, Vector<float> log_odds, Vector<float> kernel) {
        const Index reach = Index(kernel.shape(0)) / 2;
        require(Index(color.shape(0)) == height && Index(color.shape(1)) == width && color.shape(2) == CHANNELS, "color is not (H, W, 3)");
        require(Index(log_odds.shape(0)) == color_cells(), "log_odds has to have a value for each cell of colors");
        require(kernel.shape(0) % 2 == 1 && reach <= room, "the kernel has no middle, or is wider than the ring");
        const BitImage rows = band.dilated(std::vector<Index>(reach + 1, 0));
        BitImage likely(found.height, found.width);
        std::vector<std::vector<float>> lines(2 * reach + 1, std::vector<float>(found.width));  // the last rows, smoothed along
        std::vector<float> odds, sums(found.width);
        for (Index next = 0; next < found.height + reach; ++next) {
            const auto smooth_next = [&](Index start, Index end) {
                count_visits((end - start) * Index(kernel.shape(0)));
                read_odds(color, log_odds, next, start - reach, end + reach, odds);
                smooth_along(odds, kernel, &lines[next % lines.size()][start], end - start);
            };
            if (next < found.height) rows.for_each_run_of(next, smooth_next);
            const Index row = next - reach;
            if (row < 0) continue;
            band.for_each_run_of(row, [&](Index start, Index end) {
                count_visits((end - start) * Index(kernel.shape(0)));
                smooth_across(lines, row, kernel, start, end, sums);
                for (Index x = start; x < end; ++x) {
                    if (sums[x - start] > 0) likely.set(row, x);
                }
            });
        }
        found = std::move(likely);
        surround = ~found.dilated(SQUARE);
        surround &= ring;
    }

    void restore_parts(double min_thickness, double min_elongation) {
        BitImage dropped = ~found;
        dropped &= part;
        for (const Part& lost : parts_of(dropped)) {
            if (double(lost.size) <= min_elongation * min_thickness * min_thickness) continue;
            const double thickest = thickness(lost, part.height, part.width);
            if (thickest <= min_thickness || double(lost.size) <= min_elongation * thickest * thickest) continue;
            for (const Run& run : lost.runs) found.set_run(run.row, run.start, run.end);
        }
    }

    double raggedness() const {
        BitImage beyond = ~part.dilated(CROSS), within = part.eroded(CROSS), border = (~part).dilated(SQUARE);
        beyond &= found;
        within &= ~found;
        border &= part;
        const Index edge = border.count();
        return edge ? double(beyond.count() + within.count()) / double(edge) : 0.0;
    }

    Array<Byte, 2, bool> mask() const {
        std::vector<Byte> pixels(height * width);
        found.for_each_run([&](Index row, Index start, Index end) {
            std::fill_n(pixels.data() + (row + top) * width + left + start, end - start, 1);
        });
        return {std::move(pixels), {std::size_t(height), std::size_t(width)}};
    }

   private:
    Index height, width, top = 0, left = 0, room = 0;  // `left` and `top` of the box that the images of bits are of
    BitImage part, band, ring, found, surround;

    // Return every so manyth pixel of an image of bits as row-major indices of the whole image.
    std::vector<std::int64_t> pixels_of(const BitImage& image, Index every) const {
        std::vector<std::int64_t> pixels;
        Index ahead = 0;
        image.for_each_run([&](Index row, Index start, Index end) {
            for (; ahead < end - start; ahead += every) pixels.push_back((row + top) * width + left + start + ahead);
            ahead -= end - start;
        });
        return pixels;
    }

    // Read the log-odds of the colors in columns [start, end) of a row; beyond the box they are mirrored.
    void read_odds(const Volume<Byte>& color, const Vector<float>& log_odds, Index row, Index start, Index end,
                   std::vector<float>& odds) const {
        const Byte* line = color.data() + CHANNELS * ((row + top) * width + left);
        odds.resize(end - start);
        for (Index x = start; x < end; ++x) odds[x - start] = log_odds(color_cell(line + CHANNELS * mirrored(x, found.width)));
    }

    static void smooth_along(const std::vector<float>& odds, const Vector<float>& kernel, float* line, Index size) {
        std::fill(line, line + size, 0.0f);
        for (std::size_t k = 0; k < kernel.shape(0); ++k) {
            const float weight = kernel(k);
            for (Index x = 0; x < size; ++x) line[x] += weight * odds[x + k];
        }
    }

    void smooth_across(const std::vector<std::vector<float>>& lines, Index row, const Vector<float>& kernel, Index start, Index end,
                       std::vector<float>& sums) const {
        const Index reach = Index(kernel.shape(0)) / 2, size = end - start;
        const auto line = [&](Index y) { return &lines[mirrored(y, found.height) % Index(lines.size())][start]; };
        const float* middle = line(row);
        for (Index x = 0; x < size; ++x) sums[x] = kernel(reach) * middle[x];
        for (Index k = 1; k <= reach; ++k) {
            const float weight = kernel(reach + k), *above = line(row - k), *below = line(row + k);
            for (Index x = 0; x < size; ++x) sums[x] += weight * (below[x] + above[x]);
        }
    }
};

}  // namespace

void bind_mask_edge(Module& m) {
    // The edge of a mask that moves, within a band around the mask, to where the colors of an image say that it is.
    //
    // Distances are chamfer distances of OpenCV (DIST_L2, 3 x 3). Work and memory follow the pixels of the bounding box of mask and
    // ring at 1 bit each, and the colors of the band. Ten times as fast as OpenCV on arrays of the box (2.5 ms against 30 ms
    // for three moves in a frame of 1280 x 720).
    //
    // Parameters
    // ----------
    // mask
    //     (H, W) bool.
    // band_px, ring_px
    //     px, distances from the mask; the edge moves up to the first, and the surround is sampled up to the second, but not farther
    //     than this from the mask's bounding box along rows and columns.
    Class<MaskEdge>(m, "MaskEdge")
        .def(nb::init<Matrix<bool>, double, double>(), "mask"_array, "band_px"_a, "ring_px"_a)
        // Return the pixels within the edge whose eight neighbors are too; all pixels within the edge if there are none.
        //
        // Returns (N,) int64, row-major indices in the whole image.
        .def("inside", &MaskEdge::inside)
        // Return pixels of the ring: at first those beyond the band, after a move all that do not touch the edge.
        //
        // most : number of pixels; of twice, three times ... as many only every second, third ... is returned. Returns (N,) int64,
        // ascending row-major indices in the whole image.
        .def("around", &MaskEdge::around, "most"_a)
        // Move the edge to where the smoothed log-odds of the colors are 0: pixels of the band above 0 are within.
        //
        // Parameters
        // ----------
        // color
        //     (H, W, 3) uint8 RGB.
        // log_odds
        //     (4096,) float32, of each cell of colors, as `ColorOdds.log_odds` has them.
        // kernel
        //     (2 R + 1,) float32, symmetric weights by which the log-odds are smoothed along rows and columns; at the border of the
        //     image they are mirrored.
        .def("move", &MaskEdge::move, "color"_array, "log_odds"_array, "kernel"_array)
        // Restore the connected parts of the mask, now beyond the edge, that are as thick and long as a cable.
        //
        // min_thickness : px, half-width that such a part exceeds. min_elongation : area that it exceeds, in squares of that.
        .def("restore_parts", &MaskEdge::restore_parts, "min_thickness"_a, "min_elongation"_a)
        // Return the number of pixels that the edge moved by more than 1 px, per pixel of the mask's edge; 0 without an edge.
        .def("raggedness", &MaskEdge::raggedness)
        // Return the pixels (H, W) bool within the edge.
        .def("mask", &MaskEdge::mask);
}
