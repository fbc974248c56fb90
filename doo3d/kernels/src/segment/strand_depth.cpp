// Depth along one strand, smoothed over its length where it is torn or comes in waves.
//
// The depth of a stereo camera switches between the strand and what lies behind it, in stretches, and its noise comes in waves longer
// than the strand is wide. The inverse of depth has the same noise near and far. A running median over more than such a stretch gives
// a first curve; Whittaker's smoother then goes through the readings that do not contradict the curve before (Tukey's biweight), a
// few times.
//
// Where the median is behind the strand, the smoother starts from the chain of runs of readings of `depth_runs`.
//
// What the median starts is done as NumPy and SciPy do it, so that a curve is the same in its last bit.
#include "depth_runs.h"
#include "order_statistics.h"
#include "polyline.h"
#include "strand_smoothing.h"
#include "whittaker.h"

namespace {

using Series = std::vector<double>;

// Radii on either side over which the first curve is a median: longer than the stretches in which depth is torn.
constexpr double MEDIAN_RADII = 12.0;
// Weight of the first curve beside 1 of a reading: where there are none.
constexpr double FIRST_WEIGHT = 1e-3;

// What differs from frame to frame, or is not this kernel's alone.
struct Settings {
    double radius, focal;  // m, px
    double smoothing_radii, deviations, noise_radii;
    double max_in_front;  // share of the samples
    double max_slope;     // m along the line of sight per m across it
};

// Return the standard deviation that the median of the absolute values tells.
double deviation(Series values) { return MAD_TO_DEVIATION * absolute_median(std::move(values)); }

// One more curve: through the values that lie near the last one, with the first curve where there are none.
Series smoothed(const Series& filled, const std::vector<Byte>& measured, const Series& first, const Series& last, const Series& cut,
                double strength) {
    const Index count = Index(filled.size());
    Series target(count), weight(count);
    for (Index i = 0; i < count; ++i) {
        const double off = (filled[i] - last[i]) / cut[i], rest = std::max(0.0, 1 - off * off);
        const double inlier = rest * rest * double(measured[i]);
        weight[i] = inlier + FIRST_WEIGHT;
        target[i] = (inlier * filled[i] + FIRST_WEIGHT * first[i]) / weight[i];
    }
    return whittaker(target.data(), weight.data(), count, 1, strength, 2);
}

struct Curve {
    Series depth;                  // m
    double waves, in_front, torn;  // m, and shares of the samples
};

// Lay a smooth curve along a strand, from a first one on; only the samples that are `counted` pull at it.
Curve curve_from(const Series& first, const Strand& strand, const std::vector<Byte>& counted, const Settings& settings) {
    const Series& filled = strand.filled;
    const Index count = Index(filled.size());
    const std::vector<Index> known = samples_of(counted);
    const double per_meter = std::pow(median(first), 2.0);  // of depth, in inverse depth
    Series smooth = first, cut(count), residual(count);
    double least_deviation = INFINITY;
    for (Index round = 0; round < SMOOTHINGS; ++round) {
        for (Index i = 0; i < count; ++i) residual[i] = filled[i] - smooth[i];
        least_deviation = std::min(least_deviation, deviation(chosen(residual, known)));  // too smooth a curve looks noisy
        for (Index i = 0; i < count; ++i) {
            cut[i] = std::max(settings.deviations * least_deviation, TORN_RADII * settings.radius * (smooth[i] * smooth[i]));
        }
        const double noise = std::max(least_deviation / per_meter / settings.radius, settings.noise_radii);
        const double length = settings.smoothing_radii * strand.radius_px * std::sqrt(noise / settings.noise_radii);
        smooth = smoothed(filled, counted, first, smooth, cut, std::pow(length, 4.0));
    }
    Curve curve{Series(count), 0, 0, 0};
    Series behind(count);
    Index in_front = 0, torn = 0;
    for (Index i = 0; i < count; ++i) {
        curve.depth[i] = 1 / smooth[i];
        if (strand.measured[i]) torn += 1 / filled[i] - curve.depth[i] > TORN_RADII * settings.radius;
        if (!counted[i]) continue;
        behind[i] = 1 / filled[i] - curve.depth[i];
        in_front += filled[i] - smooth[i] > cut[i];
    }
    curve.in_front = double(in_front) / double(count);
    curve.torn = double(torn) / double(count);
    const Index half = std::max<Index>(1, Index(std::min(std::nearbyint(strand.radius_px), 1e9)));
    curve.waves = deviation(chosen(running_mean(behind, half), known));
    return curve;
}

// Lay a smooth curve from the runs of readings that are the strand.
Curve curve_of_runs(const Strand& strand, const std::vector<Index>& known, const Settings& settings) {
    const double middle = median(chosen(strand.filled, known)), per_radius = settings.radius * (middle * middle);
    const std::vector<Index> samples = strand_samples(strand, known, per_radius, settings.max_slope);
    const Index count = Index(strand.filled.size());
    const Series first = interpolated([&](Index i) { return strand.filled[i]; }, count, samples);
    const double reach = TORN_RADII * settings.radius * std::pow(median(first), 2.0);
    std::vector<Byte> counted(count);
    for (Index i = 0; i < count; ++i) counted[i] = strand.measured[i] && std::fabs(strand.filled[i] - first[i]) < reach;
    return curve_from(first, strand, counted, settings);
}

Curve smooth_depth(const Vector<double>& inverse, const Vector<bool>& is_measured, const Vector<double>& surface, const Settings& settings) {
    const Index count = inverse.shape(0);
    Strand strand;
    for (Index i = 0; i < count; ++i) strand.measured.push_back(is_measured(i));
    const std::vector<Index> known = samples_of(strand.measured);
    require(known.size() > 0, "nothing is measured");
    count_visits((SMOOTHINGS + 2) * count);
    require(count >= 4, "there are fewer than four samples");
    strand.filled = interpolated(inverse, count, known);
    for (Index i = 0; i < count; ++i) strand.surface.push_back(surface.shape(0) ? surface(i) : INFINITY);
    strand.radius_px = settings.radius * settings.focal * median(chosen(strand.filled, known));
    const double wanted = std::min(std::nearbyint(MEDIAN_RADII * strand.radius_px), 1e9);
    const Series first = running_median(strand.filled, std::min(std::max<Index>(2, Index(wanted)), count / 4));
    const Curve curve = curve_from(first, strand, strand.measured, settings);
    const bool is_wrong = curve.in_front > settings.max_in_front || curve.waves > TORN_RADII * settings.radius;
    return is_wrong ? curve_of_runs(strand, known, settings) : curve;
}

auto smooth_strand_depth(Vector<double> inverse, Vector<bool> measured, Vector<double> surface, double radius, double focal,
                         double smoothing_radii, double deviations, double noise_radii, double max_in_front, double max_slope) {
    require(inverse.shape(0) == measured.shape(0), "inverse and measured have different lengths");
    require(surface.shape(0) == 0 || surface.shape(0) == inverse.shape(0), "surface has another length than inverse");
    require(radius > 0 && focal > 0, "radius or focal is not positive");
    const Settings settings{radius, focal, smoothing_radii, deviations, noise_radii, max_in_front, max_slope};
    Curve curve = smooth_depth(inverse, measured, surface, settings);
    return std::make_tuple(std::move(curve.depth), curve.waves, curve.in_front, curve.torn);
}

}  // namespace

void bind_strand_depth(Module& m) {
    // Lay a smooth curve through the depth along one strand, by a robust Whittaker smoother.
    //
    // It starts from a running median or, where that is behind the strand, from the chain of runs of readings that costs least.
    //
    // Parameters
    // ----------
    // inverse
    //     (S,) 1/m, inverse depth at each of S >= 4 samples one pixel apart
    // measured
    //     (S,) bool, at least one; elsewhere the inverse depth is interpolated
    // surface
    //     (S,) 1/m, inverse depth of what is seen beside the strand; (0,) if that is not known
    // radius
    //     m, radius of the strand
    // focal
    //     px
    // smoothing_radii, noise_radii
    //     radii over which noise of so many radii is smoothed
    // deviations
    //     standard deviations by which a reading contradicts the curve
    // max_in_front
    //     share of samples in front of the curve beyond which the strand is looked for among the runs of readings, as it is where
    //     its waves are so large that they contradict the curve
    // max_slope
    //     m per m, from which on a step between two readings is a jump
    //
    // Returns
    // -------
    // depth : (S,) m, of the curve
    // waves : m, standard deviation of the readings behind the curve, averaged over a radius on either side
    // in_front, torn : shares of the samples in front of the curve by more than an outlier, and of those torn to what lies behind;
    //     once the strand was looked for among the runs, only its own readings count as in front
    //
    // Raises
    // ------
    // ValueError : lengths differ, nothing is measured, or there are fewer than four samples.
    m.def("smooth_strand_depth", &smooth_strand_depth, "inverse"_array, "measured"_array, "surface"_array, "radius"_a, "focal"_a,
          "smoothing_radii"_a, nb::kw_only(), "deviations"_a, "noise_radii"_a, "max_in_front"_a, "max_slope"_a);
}
