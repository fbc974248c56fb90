// Depth along one strand, smoothed over its length where it is torn or comes in waves.
//
// The depth of a stereo camera switches between the strand and what lies behind it, in stretches, and its noise comes in waves longer
// than the strand is wide. The inverse of depth has the same noise near and far. A running median over more than such a stretch gives
// a first curve; Whittaker's smoother then goes through the readings that do not contradict the curve before (Tukey's biweight), a
// few times.
//
// Where most of a strand reads the depth of what lies behind it, the median is behind it, too, and the strand's own readings lie in
// front of the curve, where nothing can be; where about half of it does, the curve lies between both, and its noise is as large as
// what lies behind is far. Then the strand is looked for among the runs of readings without jumps: by dynamic programming, a chain of
// runs is chosen that costs least. Going on in another run costs the square of the slope to it; the readings between two runs of the
// chain lie on the line between these, or off it, which costs per reading and per stretch: less where they are nearer to what is seen
// beside the strand, behind it (torn, as is usual), than to the line; more in front of it (the rim of an occluder: rare), and between
// it and what lies behind, where only the strand can be. The ends of the chain are level. Then the smoother starts from that chain.
//
// What the median starts is done as NumPy and SciPy do it, so that a curve is the same in its last bit.
#include "order_statistics.h"
#include "whittaker.h"

#include <algorithm>
#include <array>
#include <limits>

namespace {

using Values = std::vector<double>;

// Radii on either side over which the first curve is a median: longer than the stretches in which depth is torn.
constexpr double MEDIAN_RADII = 12.0;
// Radii behind the strand from which on a reading is of something else.
constexpr double TORN_RADII = 2.5;
// Times a curve is smoothed, each time without what the last curve says are outliers.
constexpr Index SMOOTHINGS = 4;
// Weight of the first curve beside 1 of a reading: where there are none.
constexpr double FIRST_WEIGHT = 1e-3;
// Costs of a reading of what lies behind a strand, of another one off the strand, and of a stretch of either, beside the square of the
// slope at which the strand goes on beyond them.
constexpr double BEHIND_COST = 0.3, UNUSUAL_COST = 0.8, STRETCH_COST = 5.0;

// What differs from frame to frame, or is not this kernel's alone.
struct Settings {
    double radius, focal;  // m, px
    double smoothing_radii, deviations, noise_radii;
    double max_in_front;  // share of the samples
    double max_slope;     // m along the line of sight per m across it
};

// Return the standard deviation that the median of the absolute values tells.
double deviation(Values values) {
    for (double& value : values) value = std::fabs(value);
    return MAD_TO_DEVIATION * median(std::move(values));
}

// Return the values at `known` positions, and straight lines between; level before the first and after the last.
template <class At>
Values interpolated(const At& values, Index count, const std::vector<Index>& known) {
    Values filled(count, values(known.back()));
    std::fill(filled.begin(), filled.begin() + known.front(), values(known.front()));
    for (std::size_t k = 0; k + 1 < known.size(); ++k) {
        const Index from = known[k], to = known[k + 1];
        const double slope = (values(to) - values(from)) / double(to - from);
        for (Index i = from; i < to; ++i) filled[i] = slope * double(i - from) + values(from);
    }
    return filled;
}

// Return so many values that go on straight beyond the start of a curve, the nearest first.
Values beyond(const Values& start, Index half) {
    const Index third = std::max<Index>(1, half / 3), size = Index(start.size());
    const double near = median(Values(start.begin(), start.begin() + std::min(third, size)));
    const double far = median(Values(start.end() - std::min(third, size), start.end()));
    const double slope = (far - near) / double(std::max<Index>(1, size - third));
    Values line(half);
    for (Index i = 0; i < half; ++i) line[i] = near - slope * (double(i + 1) + double(third - 1) / 2);
    return line;
}

// Return the median of so many values on either side, by a window that is kept sorted; beyond both ends the values go on straight.
Values running_median(const Values& values, Index half) {
    const Index count = Index(values.size());
    Values padded = beyond(Values(values.begin(), values.begin() + half), half);
    std::reverse(padded.begin(), padded.end());
    padded.insert(padded.end(), values.begin(), values.end());
    const Values after = beyond(Values(values.rbegin(), values.rbegin() + half), half);
    padded.insert(padded.end(), after.begin(), after.end());
    Values window(padded.begin(), padded.begin() + 2 * half + 1), medians(count);
    std::sort(window.begin(), window.end());
    for (Index i = 0; i < count; ++i) {
        medians[i] = window[half];
        if (i + 1 == count) break;
        window.erase(std::lower_bound(window.begin(), window.end(), padded[i]));
        const double next = padded[i + 2 * half + 1];
        window.insert(std::upper_bound(window.begin(), window.end(), next), next);
    }
    return medians;
}

// Return the means of so many values on either side, by a running sum; beyond both ends the last value goes on.
Values running_mean(const Values& values, Index half) {
    const Index count = Index(values.size()), size = 2 * half + 1;
    const auto at = [&](Index i) { return values[std::min(std::max<Index>(i - half, 0), count - 1)]; };
    Values means(count);
    double sum = 0;
    for (Index i = 0; i < size; ++i) sum += at(i);
    for (Index i = 0; i < count; ++i) {
        if (i) sum += at(i + size - 1) - at(i - 1);
        means[i] = sum / double(size);
    }
    return means;
}

// One more curve: through the values that lie near the last one, with the first curve where there are none.
Values smoothed(const Values& filled, const std::vector<Byte>& measured, const Values& first, const Values& last, const Values& cut,
                double strength) {
    const Index count = Index(filled.size());
    Values target(count), weight(count);
    for (Index i = 0; i < count; ++i) {
        const double off = (filled[i] - last[i]) / cut[i], rest = std::max(0.0, 1 - off * off);
        const double inlier = rest * rest * double(measured[i]);
        weight[i] = inlier + FIRST_WEIGHT;
        target[i] = (inlier * filled[i] + FIRST_WEIGHT * first[i]) / weight[i];
    }
    return whittaker(target.data(), weight.data(), count, 1, strength, 2);
}

struct Curve {
    Values depth;                  // m
    double waves, in_front, torn;  // m, and shares of the samples
};

// A strand's readings and its radius in the image.
struct Strand {
    Values filled;   // 1/m, inverse depth, interpolated where it was not measured
    Values surface;  // 1/m, inverse depth of what is seen beside it; infinite where that is not known
    std::vector<Byte> measured;
    double radius_px;
};

std::vector<Index> samples_of(const std::vector<Byte>& flags) {
    std::vector<Index> samples;
    for (Index i = 0; i < Index(flags.size()); ++i) {
        if (flags[i]) samples.push_back(i);
    }
    return samples;
}

Values chosen(const Values& values, const std::vector<Index>& samples) {
    Values some;
    for (const Index i : samples) some.push_back(values[i]);
    return some;
}

// The runs of readings without jumps along a strand, in the order of its samples.
struct Runs {
    const std::vector<Index>& known;  // samples with readings
    Values height;                    // inverse depth there, in radii
    Values surface;                   // that of what is seen beside the strand; infinite where it is not known
    double radius_px;
    std::vector<Index> start;  // first reading of each run, and one past the last

    Index count() const { return Index(start.size()) - 1; }
    Index last(Index run) const { return start[run + 1] - 1; }

    // Return the slope from one reading to another.
    double slope(Index from, Index to) const { return std::fabs(height[to] - height[from]) * radius_px / double(known[to] - known[from]); }

    // Return the cost of readings that lie off the straight line that rises from a height at a sample, or `limit` if that is less.
    double off_line(Index first, Index end, double at, double rise, Index from, bool is_inside, double limit) const {
        double cost = 0;
        bool is_behind = false, is_unusual = false;
        Index k = first;
        for (; k < end && cost < limit; ++k) {
            const double line = at + rise * double(known[k] - from), off = height[k] - line;
            if (std::fabs(off) <= TORN_RADII) continue;
            if (off < 0 && 2 * height[k] < line + surface[k]) {
                cost += BEHIND_COST + (is_behind ? 0 : STRETCH_COST);
                is_behind = true;
            } else {
                const bool is_rim = off > 0 && !is_inside;  // at an end of the strand, of what it goes under
                cost += UNUSUAL_COST + (is_unusual || is_rim ? 0 : STRETCH_COST);
                is_unusual = is_unusual || !is_rim;
            }
        }
        count_visits(k - first + 1);
        return std::min(cost, limit);
    }
};

Runs runs_of(const Strand& strand, const std::vector<Index>& known, double per_radius, double max_slope) {
    Runs runs{known, chosen(strand.filled, known), chosen(strand.surface, known), strand.radius_px, {0}};
    for (Values* values : {&runs.height, &runs.surface}) {
        for (double& value : *values) value /= per_radius;
    }
    for (Index k = 1; k < Index(known.size()); ++k) {
        if (runs.slope(k - 1, k) > max_slope) runs.start.push_back(k);
    }
    runs.start.push_back(Index(known.size()));
    return runs;
}

// Runs back among which the one before a run is looked for: what hides a strand is one to ten runs wide. Noise in which every reading
// is a run of its own would take the cube of its length.
constexpr Index MAX_RUNS_BETWEEN = 128;

// Return the samples with readings of the chain of runs that costs least.
std::vector<Index> strand_samples(const Runs& runs) {
    const Index count = runs.count(), readings = Index(runs.known.size());
    std::vector<double> cost(count);
    std::vector<Index> before(count, -1);
    double least = std::numeric_limits<double>::infinity();
    Index best = 0;
    for (Index run = 0; run < count; ++run) {
        const Index first = runs.start[run], last = runs.last(run);
        const double height = runs.height[first];
        cost[run] = runs.off_line(0, first, height, 0, 0, false, least);
        for (Index other = run - 1; other >= std::max<Index>(0, run - MAX_RUNS_BETWEEN); --other) {
            const Index end = runs.last(other), from = runs.known[end];
            const double slope = runs.slope(end, first), rise = (height - runs.height[end]) / double(runs.known[first] - from);
            const double limit = cost[run] - cost[other] - slope * slope;
            if (limit <= 0) continue;
            const double between = runs.off_line(end + 1, first, runs.height[end], rise, from, true, limit);
            if (between < limit) {
                cost[run] = cost[other] + slope * slope + between;
                before[run] = other;
            }
        }
        const double rest = runs.off_line(last + 1, readings, runs.height[last], 0, 0, false, least);
        if (cost[run] + rest < least) {
            least = cost[run] + rest;
            best = run;
        }
    }
    std::vector<Byte> is_in(count);
    for (Index run = best; run >= 0; run = before[run]) is_in[run] = 1;
    std::vector<Index> samples;
    for (Index run = 0; run < count; ++run) {
        for (Index k = runs.start[run]; is_in[run] && k < runs.start[run + 1]; ++k) samples.push_back(runs.known[k]);
    }
    return samples;
}

// Lay a smooth curve along a strand, from a first one on; only the samples that are `counted` pull at it.
Curve curve_from(const Values& first, const Strand& strand, const std::vector<Byte>& counted, const Settings& settings) {
    const Values& filled = strand.filled;
    const Index count = Index(filled.size());
    const std::vector<Index> known = samples_of(counted);
    const double per_meter = std::pow(median(first), 2.0);  // of depth, in inverse depth
    Values smooth = first, cut(count), residual(count);
    double least_deviation = std::numeric_limits<double>::infinity();
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
    Curve curve{Values(count), 0, 0, 0};
    Values behind(count);
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
    const std::vector<Index> samples = strand_samples(runs_of(strand, known, per_radius, settings.max_slope));
    const Index count = Index(strand.filled.size());
    const Values first = interpolated([&](Index i) { return strand.filled[i]; }, count, samples);
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
    for (Index i = 0; i < count; ++i) strand.surface.push_back(surface.shape(0) ? surface(i) : std::numeric_limits<double>::infinity());
    strand.radius_px = settings.radius * settings.focal * median(chosen(strand.filled, known));
    const double wanted = std::min(std::nearbyint(MEDIAN_RADII * strand.radius_px), 1e9);
    const Values first = running_median(strand.filled, std::min(std::max<Index>(2, Index(wanted)), count / 4));
    const Curve curve = curve_from(first, strand, strand.measured, settings);
    const bool is_wrong = curve.in_front > settings.max_in_front || curve.waves > TORN_RADII * settings.radius;
    return is_wrong ? curve_of_runs(strand, known, settings) : curve;
}

// A strand in the image, one sample a pixel, and the depth on both sides of it.
struct Sides {
    const Matrix<Index>& line;
    const Matrix<bool>& mask;
    const Matrix<float>& depth;

    // Return the unit direction across the strand at each sample, u and v: the mean of 9 steps along it, turned.
    std::array<Values, 2> across() const {
        const Index count = line.shape(0);
        std::array<Values, 2> along;
        for (Index d = 0; d < 2; ++d) {
            Values step(count);
            for (Index i = 0; i < count; ++i) {
                const Index before = std::max<Index>(i - 1, 0), after = std::min(i + 1, count - 1);
                step[i] = double(line(after, d) - line(before, d)) / double(after - before);
            }
            along[d] = running_mean(step, 4);
        }
        std::array<Values, 2> turned{Values(count), Values(count)};
        for (Index i = 0; i < count; ++i) {
            const double square = along[0][i] * along[0][i] + along[1][i] * along[1][i], norm = square > 0 ? std::sqrt(square) : 1.0;
            turned[0][i] = -(along[1][i] / norm);
            turned[1][i] = along[0][i] / norm;
        }
        return turned;
    }

    // Return the reading at a position; NaN outside the image, on the object and without a reading.
    float reading(double u, double v) const {
        u = std::nearbyint(u);
        v = std::nearbyint(v);
        if (!(u >= 0 && v >= 0 && u < double(mask.shape(1)) && v < double(mask.shape(0)))) return std::nanf("");
        const Index pixel = Index(v) * Index(mask.shape(1)) + Index(u);
        return !bytes_of(mask)[pixel] && depth.data()[pixel] > 0 ? depth.data()[pixel] : std::nanf("");
    }
};

// Return the median reading on both sides of each sample; NaN where there are none.
Values medians_beside(const Sides& sides, const Vector<double>& reach, const Vector<double>& beyond) {
    const Index count = sides.line.shape(0);
    const std::array<Values, 2> across = sides.across();
    Values medians(count, std::nan(""));
    std::vector<float> readings;
    for (Index i = 0; i < count; ++i) {
        readings.clear();
        for (const double side : {-1.0, 1.0}) {
            for (std::size_t k = 0; k < beyond.shape(0); ++k) {
                const double offset = side * (reach(i) + beyond(k));
                const float depth = sides.reading(double(sides.line(i, 0)) + offset * across[0][i], double(sides.line(i, 1)) + offset * across[1][i]);
                if (!std::isnan(depth)) readings.push_back(depth);
            }
        }
        if (!readings.empty()) medians[i] = double(median(readings));
    }
    return medians;
}

auto smooth_depth_beside(Matrix<Index> line, Vector<double> reach, Vector<double> beyond, Matrix<bool> mask, Matrix<float> depth,
                         double strength) {
    const Index count = line.shape(0);
    require(count >= 2 && line.shape(1) == 2, "line is not (S, 2) with at least two samples");
    require(Index(reach.shape(0)) == count, "reach is not one per sample");
    require(depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1), "depth and mask differ in size");
    Values smooth;
    {
        nb::gil_scoped_release released;
        count_visits(count * (2 * Index(beyond.shape(0)) + SMOOTHINGS));
        const Values medians = medians_beside({line, mask, depth}, reach, beyond);
        std::vector<Index> known;
        for (Index i = 0; i < count; ++i) {
            if (!std::isnan(medians[i])) known.push_back(i);
        }
        if (!known.empty() && 2 * Index(known.size()) >= count) {
            const Values surface = interpolated([&](Index i) { return medians[i]; }, count, known);
            Values weight(count, 1.0), residual(count);
            for (Index round = 0; round < SMOOTHINGS; ++round) {
                smooth = whittaker(surface.data(), weight.data(), count, 1, strength, 2);
                for (Index i = 0; i < count; ++i) residual[i] = std::fabs(surface[i] - smooth[i]);
                const double cut = std::max(2 * (MAD_TO_DEVIATION * median(residual)), 1e-6);
                for (Index i = 0; i < count; ++i) weight[i] = 1 / (1 + (residual[i] / cut) * (residual[i] / cut));
            }
        }
    }
    return to_numpy(std::move(smooth));
}

auto smooth_strand_depth(Vector<double> inverse, Vector<bool> measured, Vector<double> surface, double radius, double focal,
                         double smoothing_radii, double deviations, double noise_radii, double max_in_front, double max_slope) {
    require(inverse.shape(0) == measured.shape(0), "inverse and measured have different lengths");
    require(surface.shape(0) == 0 || surface.shape(0) == inverse.shape(0), "surface has another length than inverse");
    require(radius > 0 && focal > 0, "radius or focal is not positive");
    const Settings settings{radius, focal, smoothing_radii, deviations, noise_radii, max_in_front, max_slope};
    Curve curve;
    {
        nb::gil_scoped_release released;
        curve = smooth_depth(inverse, measured, surface, settings);
    }
    return std::make_tuple(to_numpy(std::move(curve.depth)), curve.waves, curve.in_front, curve.torn);
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
    m.def("smooth_strand_depth", &smooth_strand_depth, "inverse"_a.noconvert(), "measured"_a.noconvert(), "surface"_a.noconvert(), "radius"_a,
          "focal"_a, "smoothing_radii"_a, nb::kw_only(), "deviations"_a, "noise_radii"_a, "max_in_front"_a,
          "max_slope"_a);
    // Return the smooth depth of what is seen on both sides of a strand: the medians across it, then a robust Whittaker smoother.
    //
    // Parameters
    // ----------
    // line
    //     (S, 2) int64 px (u, v), S >= 2 samples along the strand, a pixel apart
    // reach
    //     (S,) px, radius of the strand at each sample
    // beyond
    //     (A,) px, distances from either side of the strand at which the depth is read
    // mask
    //     (H, W) bool, the pixels that are not beside the strand, since they are of the object
    // depth
    //     (H, W) float32 m, 0 = no reading
    // strength
    //     weight of smoothness, as of `whittaker_smooth`
    //
    // Returns
    // -------
    // (S,) m; (0,) if less than half of the samples have a reading beside them.
    m.def("smooth_depth_beside", &smooth_depth_beside, "line"_a.noconvert(), "reach"_a.noconvert(), "beyond"_a.noconvert(),
          "mask"_a.noconvert(), "depth"_a.noconvert(), "strength"_a);
}
