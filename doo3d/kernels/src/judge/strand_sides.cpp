// A strand and what lies on both of its sides: whether the strand rises from these, and differs from them in color.
#include "lab.h"
#include "order_statistics.h"

#include <algorithm>

namespace {

constexpr double SIDE_MARGIN_PX = 2.0;  // px by which a side is farther away: a stereo camera's foreground is wider
// Radius in the view below which depth does not show whether a strand rises: the windows of a stereo camera are wider.
constexpr double MIN_FLAT_REACH_PX = 2.0;
// Radii by which the strand is nearer than both sides at least. A cable on a table rises by two, and is seen at 0.65 of its height at
// worst; a flat mark, or the edge of a step, by none on one side at least.
constexpr double FLAT_RISE_RADII = 0.4;
// Samples, each half a radius long, over whose median the rise is taken, and the standard deviation of these medians in radii above
// which depth does not tell a flat strand from one that rises: a cable on a table rises by 1.3 to 2 radii.
constexpr Index FLAT_WINDOW_SAMPLES = 16;
constexpr double MAX_RISE_NOISE_RADII = 1.0;
// Share of the samples whose contrast may be lower than the one returned.
constexpr double LOW_CONTRAST_SHARE = 0.2;

double smaller(double a, double b) { return std::isnan(a) || std::isnan(b) ? std::nan("") : std::min(a, b); }

// Samples along a strand in an image: its pixels at lateral offsets.
struct Lateral {
    const StridedMatrix<double>&view, &across;
    const Matrix<bool>& mask;

    Lateral(const StridedMatrix<double>& view, const StridedMatrix<double>& across, const Matrix<bool>& mask, std::size_t samples)
        : view(view), across(across), mask(mask) {
        require(view.shape(0) == samples && view.shape(1) == 2, "view is not (S, 2)");
        require(across.shape(0) == samples && across.shape(1) == 2, "across is not (S, 2)");
    }
    // Return the row-major index of the pixel at an offset of a sample, in px; -1 beyond the image.
    Index pixel(Index sample, double offset) const {
        const Index height = mask.shape(0), width = mask.shape(1);
        const double u = std::nearbyint(view(sample, 0) + offset * across(sample, 0));
        const double v = std::nearbyint(view(sample, 1) + offset * across(sample, 1));
        return u >= 0 && v >= 0 && u < double(width) && v < double(height) ? Index(v) * width + Index(u) : -1;
    }
    bool beside(Index pixel) const { return pixel >= 0 && !bytes_of(mask)[pixel]; }
};

// The pixels across each sample of a strand, at multiples of its radius there.
struct Across : Lateral {
    const Vector<double>& reach;

    Index samples() const { return Index(reach.shape(0)); }
    // Call `visit` with the row-major index of each pixel at some radii to a side of a sample, within the image; with a side of 0
    // also of those in the mask.
    template <class Visit>
    void for_each(Index sample, const Vector<double>& radii, double side, Visit visit) const {
        for (std::size_t i = 0; i < radii.shape(0); ++i) {
            const double offset = side == 0 ? reach(sample) * radii(i) : side * (reach(sample) * radii(i) + SIDE_MARGIN_PX);
            const Index at = pixel(sample, offset);
            if (side == 0 ? at >= 0 : beside(at)) visit(at);
        }
    }
};

double middle_reading(const Across& strand, const Matrix<float>& depth, Index sample, const Vector<double>& radii, double side) {
    std::vector<float> readings;
    strand.for_each(sample, radii, side, [&](Index pixel) {
        if (depth.data()[pixel] > 0) readings.push_back(depth.data()[pixel]);
    });
    if (readings.empty()) return std::nan("");
    return value_at(readings, (readings.size() - 1) / 2);
}

// Return by how much more than half of a strand does not rise from both sides, 0 to 1.
double flat_share(const Across& strand, const Matrix<float>& depth, const Vector<double>& core, const Vector<double>& sides, double radius) {
    std::vector<double> reach(strand.samples()), rise;
    for (Index i = 0; i < strand.samples(); ++i) reach[i] = strand.reach(i);
    if (median(reach) < MIN_FLAT_REACH_PX) return 0.0;
    for (Index i = 0; i < strand.samples(); ++i) {
        const double beside = smaller(middle_reading(strand, depth, i, sides, -1), middle_reading(strand, depth, i, sides, 1));
        const double height = beside - middle_reading(strand, depth, i, core, 0);
        if (std::isfinite(height)) rise.push_back(height);
    }
    if (rise.empty()) return 0.0;
    const Index count = Index(rise.size()), parts = std::max<Index>(1, count / FLAT_WINDOW_SAMPLES);
    std::vector<double> of_window, away;
    for (Index part = 0, first = 0; part < parts; ++part) {
        const Index last = first + count / parts + (part < count % parts);
        std::vector<double> window(rise.begin() + first, rise.begin() + last);
        of_window.push_back(median(window));
        first = last;
    }
    Index low = 0;
    for (const double height : of_window) low += height < FLAT_RISE_RADII * radius;
    const double share = double(low) / double(parts), middle = median(of_window);
    for (const double height : of_window) away.push_back(std::fabs(height - middle));
    const double noise = MAD_TO_DEVIATION * median(away);
    return noise < MAX_RISE_NOISE_RADII * radius ? std::max(0.0, 2 * share - 1) : 0.0;
}

struct Color {
    double lab[CHANNELS];
    double operator-(const Color& other) const {
        double square = 0;
        for (Index k = 0; k < CHANNELS; ++k) square += (lab[k] - other.lab[k]) * (lab[k] - other.lab[k]);
        return std::sqrt(square);
    }
};

Color mean_color(const Across& strand, const Volume<Byte>& color, Index sample, const Vector<double>& radii, double side) {
    const LabTables& to_lab = lab_tables();
    int sums[CHANNELS] = {}, count = 0;
    strand.for_each(sample, radii, side, [&](Index pixel) {
        Byte lab[CHANNELS];
        to_lab(color.data() + pixel * CHANNELS, lab);
        for (Index k = 0; k < CHANNELS; ++k) sums[k] += lab[k];
        ++count;
    });
    Color mean;
    for (Index k = 0; k < CHANNELS; ++k) mean.lab[k] = count ? double(sums[k]) / count : std::nan("");
    return mean;
}

// Return the contrast of the strand with the more similar side that a share of the samples is below; infinite without pixels.
double low_contrast(const Across& strand, const Volume<Byte>& color, const Vector<double>& core, const Vector<double>& sides) {
    std::vector<double> contrasts;
    for (Index i = 0; i < strand.samples(); ++i) {
        const Color own = mean_color(strand, color, i, core, 0);
        const double contrast = smaller(own - mean_color(strand, color, i, sides, -1), own - mean_color(strand, color, i, sides, 1));
        if (std::isfinite(contrast)) contrasts.push_back(contrast);
    }
    if (contrasts.empty()) return INFINITY;
    return value_at(contrasts, std::size_t(LOW_CONTRAST_SHARE * double(contrasts.size() - 1)));
}

auto strand_sides(StridedMatrix<double> view, StridedMatrix<double> across, Vector<double> reach, double radius, Matrix<float> depth,
                  Volume<Byte> color, Matrix<bool> mask, Vector<double> core, Vector<double> sides, Vector<double> color_sides) {
    const std::size_t samples = reach.shape(0), height = mask.shape(0), width = mask.shape(1);
    require(depth.shape(0) * depth.shape(1) == 0 || (depth.shape(0) == height && depth.shape(1) == width), "depth and mask differ in size");
    const bool colored = color.shape(0) * color.shape(1) > 0;
    require(!colored || (color.shape(0) == height && color.shape(1) == width && color.shape(2) == CHANNELS), "color is not (H, W, 3)");
    require(samples > 0, "there are no samples");
    const Across strand{{view, across, mask, samples}, reach};
    count_visits(Index(samples * (core.shape(0) + 2 * sides.shape(0) + 2 * color_sides.shape(0))));
    nb::gil_scoped_release released;
    const double flat = depth.shape(0) * depth.shape(1) > 0 ? flat_share(strand, depth, core, sides, radius) : 0.0;
    return std::make_pair(flat, colored ? low_contrast(strand, color, core, color_sides) : INFINITY);
}

}  // namespace

void bind_strand_sides(Module& m) {
    // Compare a strand with what lies on both of its sides, at S samples along it.
    //
    // Parameters
    // ----------
    // view, across, reach
    //     (S, 2) px, (S, 2) unit and (S,) px: position of a sample in the view, direction across the strand, and radius there.
    // radius
    //     m, radius of the strand.
    // depth
    //     (H, W) float32 m, 0 = no reading; (0, 0) for none.
    // color
    //     (H, W, 3) uint8 RGB; (0, 0, 3) for none.
    // mask
    //     (H, W) bool; its pixels are no sides.
    // core, sides, color_sides
    //     radii from the axis at which the strand itself is looked at, and the depth and the color of a side.
    //
    // Returns
    // -------
    // flat : by how much more than half of the windows the strand does not rise from both sides, 0 to 1. The rise is the median in a
    //     window, the reading of a sample the lower median of its pixels. 0 where depth tells nothing.
    // contrast : difference of the strand's color to the more similar side at a sample that few are below, in 8-bit CIELAB;
    //     infinite without color.
    m.def("strand_sides", &strand_sides, "view"_a.noconvert(), "across"_a.noconvert(), "reach"_a.noconvert(), "radius"_a,
          "depth"_a.noconvert(), "color"_a.noconvert(), "mask"_a.noconvert(), "core"_a.noconvert(), "sides"_a.noconvert(),
          "color_sides"_a.noconvert());
}
