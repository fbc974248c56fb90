// A strand and what lies on both of its sides: whether the strand rises from these, and differs from them in color.
#include "image.h"
#include "lab.h"
#include "order_statistics.h"

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

// Samples along a strand in an image, and what is looked at: the strand itself or one of its sides.
struct Strand {
    const StridedMatrix<double>&view, &across;
    const Vector<double>& reach;
    const Matrix<bool>& mask;

    Index samples() const { return Index(reach.shape(0)); }
    // Call `visit` with the row-major index of each pixel at some radii to a side of a sample, within the image and not in the mask;
    // with a side of 0, on the strand, also of those in the mask.
    template <class Visit>
    void for_each(Index sample, const Vector<double>& radii, double side, Visit visit) const {
        for (std::size_t i = 0; i < radii.shape(0); ++i) {
            const double offset = side == 0 ? reach(sample) * radii(i) : side * (reach(sample) * radii(i) + SIDE_MARGIN_PX);
            const double u = view(sample, 0) + offset * across(sample, 0), v = view(sample, 1) + offset * across(sample, 1);
            const Index pixel = pixel_at(u, v, mask.shape(0), mask.shape(1));
            if (pixel >= 0 && (side == 0 || !bytes_of(mask)[pixel])) visit(pixel);
        }
    }
    // Call `measure` with each sample and a side, and compare what is found with the strand itself: return those that are finite of the lesser
    // of both differences.
    template <class Measure>
    std::vector<double> differences(Measure measure) const {
        std::vector<double> found;
        for (Index i = 0; i < samples(); ++i) {
            const auto own = measure(i, 0);
            const double left = measure(i, -1) - own, right = measure(i, 1) - own, difference = smaller(left, right);
            if (std::isfinite(difference)) found.push_back(difference);
        }
        return found;
    }
};

double middle_reading(const Strand& strand, const Matrix<float>& depth, Index sample, const Vector<double>& radii, double side) {
    std::vector<float> readings;
    strand.for_each(sample, radii, side, [&](Index pixel) {
        if (depth.data()[pixel] > 0) readings.push_back(depth.data()[pixel]);
    });
    return readings.empty() ? std::nan("") : value_at(readings, (readings.size() - 1) / 2);
}

// Return the medians of the values in windows of nearly one size.
std::vector<double> medians_in_windows(const std::vector<double>& values, Index size) {
    const Index count = Index(values.size()), parts = std::max<Index>(1, count / size);
    std::vector<double> medians;
    for (Index part = 0, first = 0; part < parts; ++part) {
        const Index last = first + count / parts + (part < count % parts);
        medians.push_back(median(std::vector<double>(values.begin() + first, values.begin() + last)));
        first = last;
    }
    return medians;
}

// Return by how much more than half of a strand does not rise from both sides, 0 to 1.
double flat_share(const Strand& strand, const Matrix<float>& depth, const Vector<double>& core, const Vector<double>& sides, double radius) {
    if (median(dense(strand.reach)) < MIN_FLAT_REACH_PX) return 0.0;
    const std::vector<double> rise =
        strand.differences([&](Index i, int side) { return middle_reading(strand, depth, i, side ? sides : core, side); });
    if (rise.empty()) return 0.0;
    std::vector<double> medians = medians_in_windows(rise, FLAT_WINDOW_SAMPLES);
    const auto low = std::count_if(medians.begin(), medians.end(), [&](double height) { return height < FLAT_RISE_RADII * radius; });
    const double share = double(low) / double(medians.size()), middle = median(medians);
    for (double& height : medians) height -= middle;
    const double noise = MAD_TO_DEVIATION * absolute_median(medians);
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

Color mean_color(const Strand& strand, const Volume<Byte>& color, Index sample, const Vector<double>& radii, double side) {
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
double low_contrast(const Strand& strand, const Volume<Byte>& color, const Vector<double>& core, const Vector<double>& sides) {
    std::vector<double> contrasts =
        strand.differences([&](Index i, int side) { return mean_color(strand, color, i, side ? sides : core, side); });
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
    require(view.shape(0) == samples && view.shape(1) == 2, "view is not (S, 2)");
    require(across.shape(0) == samples && across.shape(1) == 2, "across is not (S, 2)");
    const Strand strand{view, across, reach, mask};
    count_visits(Index(samples * (core.shape(0) + 2 * sides.shape(0) + 2 * color_sides.shape(0))));
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
    m.def("strand_sides", &strand_sides, "view"_array, "across"_array, "reach"_array, "radius"_a, "depth"_array, "color"_array,
          "mask"_array, "core"_array, "sides"_array, "color_sides"_array);
}
