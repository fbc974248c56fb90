// Which of two strands that cross in the view is on top: by the depth of their surfaces, and by their colors.
#include "image.h"
#include "order_statistics.h"
#include "parabola.h"
#include "polyline.h"

namespace {

// Samples on both sides of a crossing together that must have been measured, to extrapolate a strand's surface; half of them on each
// side must be in the image, to compare colors.
constexpr Index MIN_MEASURED = 4;
// Thicknesses; standard deviation of a difference in depth, twice that without surfaces. Strands that touch are 1 apart.
constexpr double DEPTH_DEVIATION = 0.5;
// Weight of the measured surfaces beside that of the chains: the chain of the lower strand is filled in at the crossing.
constexpr double SURFACE_WEIGHT = 0.75;
// Thicknesses up to which a difference in depth counts.
constexpr double MAX_DEPTH_DIFFERENCE = 1.5;
// Number of independent colors in a profile: its offsets are closer than the blur of a camera, and its channels vary together.
constexpr double INDEPENDENT_COLORS = 6.0;
// Logarithms of a ratio of squared errors: beyond the first, more says nothing; the second comes from light and texture.
constexpr double MAX_LOG_RATIO = 2.0, MIN_LOG_RATIO = 0.35;

using Pair = std::array<double, 2>;

// Like NumPy's maximum: NaN stays.
double at_least(double value, double least) { return value < least ? least : value; }

double clipped(double value, double limit) { return value < -limit ? -limit : value > limit ? limit : value; }

Pair normal_of(const Pair& step) {
    const double size = at_least(std::sqrt(step[0] * step[0] + step[1] * step[1]), 1e-12);
    return {-step[1] / size, step[0] / size};
}

// Read the color of an image between its pixels; NaN outside.
void color_at(const Volume<Byte>& image, const double* position, double* color) {
    const Index height = image.shape(0), width = image.shape(1);
    const double x = position[0], y = position[1], left = std::floor(x), top = std::floor(y);
    std::fill_n(color, CHANNELS, std::nan(""));
    if (!(0 <= x && 0 <= y && left + 1 < double(width) && top + 1 < double(height))) return;
    const double right_weight = x - left, lower_weight = y - top;
    const Byte* upper_row = image.data() + (Index(top) * width + Index(left)) * CHANNELS;
    const Byte* lower_row = upper_row + width * CHANNELS;
    for (Index k = 0; k < CHANNELS; ++k) {
        const double upper = double(upper_row[k]) * (1 - right_weight) + double(upper_row[k + CHANNELS]) * right_weight;
        const double lower = double(lower_row[k]) * (1 - right_weight) + double(lower_row[k + CHANNELS]) * right_weight;
        color[k] = upper * (1 - lower_weight) + lower * lower_weight;
    }
}

class CrossingStrands {
   public:
    CrossingStrands(Matrix<double> joints, Vector<Index> bounds, Vector<bool> closed, Matrix<Index> chain, Matrix<Index> segment,
                    Matrix<double> t, Vector<double> angle, Matrix<double> point, Matrix<double> radius, Matrix<double> half_width,
                    Vector<double> distances, double margin, double min_angle)
        : count_(Index(angle.shape(0))), samples_(2 * Index(distances.shape(0))), min_sine_(std::sin(min_angle)) {
        check_bounds(bounds, joints.shape(0));
        require(joints.shape(1) == 3 && closed.shape(0) + 1 == bounds.shape(0), "joints are not (J, 3), or closed is not one per chain");
        for (const auto* each : {&t, &point, &radius, &half_width}) {
            require(Index(each->shape(0)) == count_ && each->shape(1) == 2, "t, point, radius or half_width is not (C, 2)");
        }
        for (const auto* each : {&chain, &segment}) {
            require(Index(each->shape(0)) == count_ && each->shape(1) == 2, "chain or segment is not (C, 2)");
        }
        point_.assign(point.data(), point.data() + 2 * count_);
        radius_.assign(radius.data(), radius.data() + 2 * count_);
        half_width_.assign(half_width.data(), half_width.data() + 2 * count_);
        count_visits(2 * count_ * samples_);
        for (Index n = 0; n < 2 * count_; ++n) {
            const Index c = chain.data()[n];
            require(c >= 0 && c < Index(closed.shape(0)), "a chain is not among the chains");
            const auto at = [&](double place) {
                std::array<double, 3> value;
                interpolate(joints, bounds, closed(c), c, place, value.data());
                return value;
            };
            const double sine = std::sin(at_least(angle(n / 2), min_angle));
            add_samples(n, at, double(segment.data()[n]), t.data()[n], distances, margin * half_width_[n ^ 1] / sine);
        }
    }

    auto positions(Vector<double> offsets) const { return rows_of(beyond(offsets), 2); }

    auto readings(Vector<double> offsets, Matrix<float> depth, Matrix<bool> mask) const {
        const MaskedDepth masked{depth, mask};
        masked.check();
        const std::vector<double> places = beyond(offsets);
        std::vector<double> result(places.size() / 2);
        for (std::size_t i = 0; i < result.size(); ++i) result[i] = masked.at(places[2 * i], places[2 * i + 1], true);
        return result;
    }

    auto depth_log_odds(Vector<double> surface, double deviations) const {
        require(samples_ && count_ && surface.shape(0) % (2 * count_ * samples_) == 0, "surface is not one per sample and offset");
        count_visits(Index(surface.shape(0)));
        std::vector<double> result(count_);
        for (Index c = 0; c < count_; ++c) {
            const double thickness = at_least(radius_[2 * c] + radius_[2 * c + 1], 1e-9);
            const double in_front = surface_at_crossing(2 * c + 1, surface, deviations) - surface_at_crossing(2 * c, surface, deviations);
            double difference = (depth_[2 * c + 1] - depth_[2 * c]) / thickness, noise = 2 * DEPTH_DEVIATION;
            if (std::isfinite(in_front)) {
                difference = SURFACE_WEIGHT * in_front / thickness + (1 - SURFACE_WEIGHT) * difference;
                noise = DEPTH_DEVIATION;
            }
            result[c] = 2 * clipped(difference, MAX_DEPTH_DIFFERENCE) / (noise * noise);
        }
        return result;
    }

    auto color_log_odds(Volume<Byte> image, Vector<double> offsets, double noise) const {
        require(image.shape(2) == CHANNELS && offsets.shape(0) > 0, "image is not (H, W, 3), or there are no offsets");
        const Index values = Index(offsets.shape(0)) * CHANNELS;
        const std::vector<double> places = beyond(offsets);
        std::vector<double> result(count_);
        for (Index c = 0; c < count_; ++c) {
            std::vector<double> profiles(2 * values);
            bool is_measured = true;
            for (Index side = 0; side < 4; ++side) {
                const double* own = places.data() + (4 * c + side) * samples_ / 2 * Index(offsets.shape(0)) * 2;
                is_measured &= add_profile(image, own, profiles.data() + side / 2 * values, values) >= MIN_MEASURED / 2;
            }
            if (is_measured) result[c] = first_log_odds(image, c, offsets, profiles, noise);
        }
        return result;
    }

   private:
    Index count_, samples_;
    double min_sine_;
    std::vector<double> point_, radius_, half_width_, depth_, height_, along_;
    std::vector<Pair> middle_, side_, normal_;

    // Add the samples of a strand before and behind the overlap, whose half-length is given: `at` returns the position of a place on the chain,
    // counted in joints; the crossing is at `t` of a segment.
    template <class At>
    void add_samples(Index strand, At at, double segment, double t, const Vector<double>& distances, double overlap) {
        const auto step = [&](double first) -> Pair {
            const auto start = at(first), end = at(first + 1);
            return {end[0] - start[0], end[1] - start[1]};
        };
        const double joint = segment + t;
        const Pair across = step(segment);
        const double size = at_least(std::sqrt(across[0] * across[0] + across[1] * across[1]), 1e-12);
        depth_.push_back(at(joint)[2]);
        normal_.push_back(normal_of(across));
        for (Index s = 0; s < samples_; ++s) {
            const Index k = s < samples_ / 2 ? samples_ / 2 - 1 - s : s - samples_ / 2;
            const double beyond = overlap + distances(k) * half_width_[strand];
            const double along = s < samples_ / 2 ? -beyond : beyond, place = joint + along / size;
            const auto middle = at(place);
            middle_.push_back({middle[0], middle[1]});
            height_.push_back(middle[2]);
            side_.push_back(normal_of(step(std::floor(place))));
            along_.push_back(along / half_width_[strand]);
        }
    }

    // Return the positions at lateral offsets from each sample.
    std::vector<double> beyond(const Vector<double>& offsets) const {
        std::vector<double> result;
        result.reserve(2 * middle_.size() * offsets.shape(0));
        count_visits(Index(middle_.size() * offsets.shape(0)));
        for (std::size_t i = 0; i < middle_.size(); ++i) {
            for (std::size_t a = 0; a < offsets.shape(0); ++a) {
                const double lateral = offsets(a) * half_width_[i / samples_];
                for (int d = 0; d < 2; ++d) result.push_back(middle_[i][d] + lateral * side_[i][d]);
            }
        }
        return result;
    }

    // Return the distance of a strand's surface at the crossing, from readings that do not differ by more than its thickness.
    double surface_at_crossing(Index strand, const Vector<double>& surface, double deviations) const {
        const Index offsets = Index(surface.shape(0)) / (2 * count_ * samples_), first = strand * samples_;
        std::vector<double> measured(samples_), height(samples_), across(offsets);
        for (Index s = 0; s < samples_; ++s) {
            for (Index a = 0; a < offsets; ++a) across[a] = surface((first + s) * offsets + a);
            measured[s] = finite_median(across, NAN);
            height[s] = height_[first + s] - measured[s];
        }
        const double middle = finite_median(height, NAN);
        for (Index s = 0; s < samples_; ++s) {
            if (!(std::fabs(height[s] - middle) < 2 * radius_[strand])) measured[s] = std::nan("");
        }
        return parabola_at_zero(along_.data() + first, measured, deviations, MIN_MEASURED);
    }

    // Add half of the median colors across a strand on one side of a crossing, and return the number of samples in the image.
    Index add_profile(const Volume<Byte>& image, const double* places, double* profile, Index values) const {
        std::vector<double> colors(samples_ / 2 * values), along(samples_ / 2);
        Index measured = 0;
        for (Index s = 0; s < samples_ / 2; ++s) {
            double* own = colors.data() + s * values;
            for (Index k = 0; k < values / CHANNELS; ++k) color_at(image, places + 2 * (s * values / CHANNELS + k), own + k * CHANNELS);
            measured += std::all_of(own, own + values, [](double value) { return std::isfinite(value); });
        }
        for (Index k = 0; k < values; ++k) {
            for (Index s = 0; s < samples_ / 2; ++s) along[s] = colors[s * values + k];
            profile[k] += finite_median(along, NAN) / 2;
        }
        return measured;
    }

    // Compare the colors inside the overlap with those across both strands.
    double first_log_odds(const Volume<Byte>& image, Index c, const Vector<double>& offsets, const std::vector<double>& profiles,
                          double noise) const {
        const Index size = Index(offsets.shape(0));
        const Pair &first = normal_[2 * c], &second = normal_[2 * c + 1];
        double sine = first[0] * second[1] - first[1] * second[0], color[CHANNELS], own = 0.0, other = 0.0;
        if (std::fabs(sine) < min_sine_) sine = std::copysign(min_sine_, sine);
        count_visits(size * size);
        for (Index i = 0; i < size * size; ++i) {
            const double a = offsets(i / size) * half_width_[2 * c], b = offsets(i % size) * half_width_[2 * c + 1];
            const double at[2] = {point_[2 * c] + (a * second[1] - b * first[1]) / sine,
                                  point_[2 * c + 1] + (b * first[0] - a * second[0]) / sine};
            color_at(image, at, color);
            for (Index k = 0; k < CHANNELS; ++k) {
                const double to_first = profiles[i / size * CHANNELS + k] - color[k];
                const double to_second = profiles[(size + i % size) * CHANNELS + k] - color[k];
                own += to_first * to_first;
                other += to_second * to_second;
            }
        }
        const double count = double(size * size * CHANNELS), variance = noise * noise;
        const double ratio = std::log((other / count + variance) / (own / count + variance));
        return std::fabs(ratio) >= MIN_LOG_RATIO ? INDEPENDENT_COLORS / 2 * clipped(ratio, MAX_LOG_RATIO) : 0.0;
    }
};

}  // namespace

void bind_crossing_strands(Module& m) {
    // Samples of the two strands at each of C crossings: S per strand, before and after the place where they overlap in the view.
    //
    // Positions and lengths in the view are in its unit: px for a camera and in 2-D, tangents of angles for a cloud with a
    // viewpoint, m otherwise. Samples beyond the ends of a strand are NaN.
    //
    // Parameters
    // ----------
    // joints, bounds
    //     (J, 3) joints of the chains as (u, v, distance): position in the view and distance along the viewing direction, and bounds
    //     of the chains as for `polyline_lengths`
    // closed
    //     (L,) bool, True for a ring, whose last joint repeats its first
    // chain, segment, t, angle, point
    //     the crossings: (C, 2) int64 chain and segment of both strands, (C, 2) position along the segments from 0 to 1, (C,) rad
    //     between them in the view, (C, 2) position in the view
    // radius, half_width
    //     (C, 2) radius of the strands, m (px in 2-D), and half their width in the view
    // distances
    //     (S / 2,) half-widths beyond the overlap of the samples on one side
    // margin
    //     half-lengths of the overlap that are left out
    // min_angle
    //     rad; strands that cross at less are taken to cross at this
    Class<CrossingStrands>(m, "CrossingStrands")
        .def(nb::init<Matrix<double>, Vector<Index>, Vector<bool>, Matrix<Index>, Matrix<Index>, Matrix<double>, Vector<double>,
             Matrix<double>, Matrix<double>, Matrix<double>, Vector<double>, double, double>(), "joints"_array, "bounds"_array,
             "closed"_array, "chain"_array, "segment"_array, "t"_array, "angle"_array, "point"_array, "radius"_array, "half_width"_array,
             "distances"_array, "margin"_a, "min_angle"_a)
        // Return the positions in the view (C * 2 * S * A, 2), at lateral offsets (A,) half-widths from each sample.
        .def("positions", &CrossingStrands::positions, "offsets"_array)
        // Return the readings (C * 2 * S * A,) m of a depth image (H, W) float32 at `positions`; NaN outside the mask.
        .def("readings", &CrossingStrands::readings, "offsets"_array, "depth"_array, "mask"_array)
        // Return the log odds that the first strand is upper, (C,) nat, by the chains' depth and that of their surfaces.
        //
        // The surface of each strand is measured on both sides of the overlap and extrapolated across the overlap by a parabola.
        // Readings on a strand that differ by more than its thickness from its others belong to something else and are left out, and
        // so are outliers of the parabola, once.
        //
        // Parameters
        // ----------
        // surface
        //     (C * 2 * S * A,) m, distance of the object's surface at `positions`; NaN without a reading
        // deviations
        //     of an outlier
        .def("depth_log_odds", &CrossingStrands::depth_log_odds, "surface"_array, "deviations"_a)
        // Return the log odds that the first strand is upper, (C,) nat, by the colors in the overlap.
        //
        // The colors across the upper strand (bright middle, darker sides) continue through the overlap. So each strand's median
        // colors on both sides are compared with the colors inside. With normally distributed errors of unknown size, the logarithm
        // of the likelihood ratio of n independent colors is n / 2 times that of the ratio of the mean squared errors.
        //
        // Parameters
        // ----------
        // image
        //     (H, W, 3) uint8 RGB, looked up bilinearly
        // offsets
        //     (A,) lateral offsets in half-widths
        // noise
        //     standard deviation of the colors
        .def("color_log_odds", &CrossingStrands::color_log_odds, "image"_array, "offsets"_array, "noise"_a);
}
