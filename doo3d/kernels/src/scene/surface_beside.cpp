// The surface beside chains in a depth image: its pixels, how far behind the chains it lies, and whether positions lie over it.
#include "image.h"
#include "nearest.h"
#include "order_statistics.h"
#include "polyline.h"

namespace {

const double NONE = std::nan("");

// Radii behind a joint up to which a reading beside it counts as the supporting surface. Farther back is another surface.
constexpr double MAX_RISE_RADII = 8.0;
// Length of chain over which the rise at an end is measured.
constexpr double RISE_WINDOW_RADII = 20.0;
// Least ratio of the rise to the noise of single readings: half the rise, the threshold, is then one standard deviation.
constexpr double MIN_RISE_NOISE_RATIO = 2.0;

// The rise at an end of a chain, and the noise of single readings.
void add_rise(const double* behind, Index count, std::size_t min_readings, std::vector<double>& rises, std::vector<double>& noises) {
    std::vector<double> part;
    count_visits(count);
    for (Index i = 0; i < count; ++i) {
        if (std::isfinite(behind[i])) part.push_back(behind[i]);
    }
    const std::size_t known = part.size();
    const double rise = finite_median(part, NONE);
    for (double& value : part) value -= rise;
    const double noise = known ? MAD_TO_DEVIATION * absolute_median(std::move(part)) : NONE;
    rises.push_back(known >= min_readings && rise > MIN_RISE_NOISE_RATIO * noise ? rise : NONE);
    noises.push_back(noise);
}

// Return the joints within the window from an end of a chain, [first, last).
std::pair<Index, Index> near_end(const double* joints, Index first, Index last, bool at_last, double window) {
    const double spacing = std::sqrt(squared_distance(joints + 3 * std::min(first + 1, last - 1), joints + 3 * first, 3));
    const Index count = std::max<Index>(2, Index(std::min(window / std::max(spacing, 1e-9), 1e9)));
    return at_last ? std::make_pair(std::max(last - count, first), last) : std::make_pair(first, std::min(first + count, last));
}

auto surface_beside(Matrix<double> joints, Vector<Index> bounds, Vector<double> camera, double radius, Vector<double> lateral,
                    Matrix<bool> mask, Matrix<float> depth, std::size_t min_readings) {
    const Index count = joints.shape(0), sides = lateral.shape(0);
    check_bounds(bounds, count);
    require(joints.shape(1) == 3, "joints are not (N, 3)");
    const Camera view(camera);
    const MaskedDepth readings{depth, mask};
    readings.check();
    for (std::size_t c = 0; c + 1 < bounds.shape(0); ++c) require(bounds(c + 1) > bounds(c), "a chain has no joints");
    std::vector<double> seen(2 * count), behind(count * sides, NONE), rise, noise;
    for (Index i = 0; i < count; ++i) view.project(joints.data() + 3 * i, &seen[2 * i]);
    const std::vector<Byte> open(bounds.shape(0) - 1);
    const std::vector<double> tangents = tangents_along(seen.data(), 2, dense(bounds), open);
    std::vector<Index> on, beside;
    count_visits(count * (sides + 1));
    for (Index i = 0; i < count; ++i) {
        const double z = joints(i, 2), reach = view.fx * radius / z;
        const Index middle = readings.pixel(seen[2 * i], seen[2 * i + 1]);
        if (middle >= 0 && bytes_of(mask)[middle]) on.push_back(middle);
        for (Index k = 0; k < sides; ++k) {
            const double offset = reach * lateral(k);
            const Index pixel = readings.pixel(seen[2 * i] - offset * tangents[2 * i + 1], seen[2 * i + 1] + offset * tangents[2 * i]);
            if (pixel < 0 || bytes_of(mask)[pixel]) continue;
            beside.push_back(pixel);
            const double back = depth.data()[pixel] > 0 ? double(depth.data()[pixel]) - z : NONE;
            if (std::fabs(back) <= MAX_RISE_RADII * radius) behind[i * sides + k] = back;
        }
    }
    for (std::size_t end = 0; end + 2 < 2 * bounds.shape(0); ++end) {
        const auto [first, last] = near_end(joints.data(), bounds(end / 2), bounds(end / 2 + 1), end % 2 == 1, RISE_WINDOW_RADII * radius);
        add_rise(behind.data() + first * sides, (last - first) * sides, min_readings, rise, noise);
    }
    return std::make_tuple(std::move(on), std::move(beside), std::move(rise), std::move(noise));
}

// Return the difference over the deviation; without either 0, and no infinite one.
double in_deviations(double difference, double deviation) {
    const double ratio = difference / deviation, largest = std::numeric_limits<double>::max();
    return std::isnan(ratio) ? 0.0 : std::min(std::max(ratio, -largest), largest);
}

auto surface_log_odds(Matrix<double> points, Matrix<Index> pixels, Vector<double> readings, double noise, Matrix<double> ends,
                      Vector<double> rise, Vector<double> rise_noise, Vector<double> camera, Vector<double> plane) {
    const Index count = points.shape(0), number = ends.shape(0);
    require(points.shape(1) == 3 && pixels.shape(1) == 2 && ends.shape(1) == 3, "points, pixels or ends are not (N, 3), (N, 2), (E, 3)");
    require(Index(pixels.shape(0)) == count && Index(readings.shape(0)) == count, "pixels and readings are not one per point");
    require(number > 0 && Index(rise.shape(0)) == number && Index(rise_noise.shape(0)) == number, "rises are not one per end");
    require(plane.shape(0) == 0 || (plane.shape(0) == 5 && camera.shape(0) == 4), "plane or camera are not (5,), (4,)");
    for (std::size_t k = 0; k < ends.size(); ++k) require(std::isfinite(ends.data()[k]), "an end is not finite");
    std::vector<double> odds(count);
    const std::vector<Index> end = NearestOfPoints(points.data(), count, ends.data(), number, 3, INFINITY).index;
    count_visits(count);
    for (Index n = 0; n < count; ++n) {
        const double z = points(n, 2), reading = readings(n), deviation = std::hypot(noise * reading * z, rise_noise(end[n]));
        double nearer = reading - z - rise(end[n]) / 2;
        if (std::isnan(nearer / deviation) && plane.shape(0)) {
            const double x = (double(pixels(n, 0)) - camera(2)) * reading / camera(0);
            const double y = (double(pixels(n, 1)) - camera(3)) * reading / camera(1);
            nearer = plane(4) - (x * plane(0) + y * plane(1) + reading * plane(2) - plane(3));
        }
        odds[n] = in_deviations(nearer, deviation);
    }
    return odds;
}

}  // namespace

void bind_surface_beside(Module& m) {
    // Measure the surface beside chains in a depth image.
    //
    // The rise at an end is the median distance by which readings beside the joints near the end lie behind the joints.
    //
    // Parameters
    // ----------
    // joints, bounds
    //     (N, 3) float64 m in the camera's optical frame, the joints of C chains one after the other; (C + 1,) int64, first of each
    // camera
    //     (4,) float64, the intrinsics fx, fy, cx, cy in px
    // radius
    //     m, of the object
    // lateral
    //     (S,) float64 radii, offsets across the chain in the image at which the surface is read
    // mask, depth
    //     (H, W) bool, the object, and (H, W) float32 m, 0 = no reading
    // min_readings
    //     readings beside an end from which a rise and its noise are measured at least
    //
    // Returns
    // -------
    // inside : (I,) int64, row-major indices of the pixels of the joints that are in the mask
    // around : (A,) int64, of the pixels at the offsets that are outside the mask
    // rise : (2 C,) float64 m, at the first and the last joint of each chain; NaN where it is not told from zero
    // noise : (2 C,) float64 m, the standard deviation of single readings there; NaN without any
    m.def("surface_beside", &surface_beside, "joints"_array, "bounds"_array, "camera"_array, "radius"_a, "lateral"_array, "mask"_array,
          "depth"_array, "min_readings"_a);
    // Return the log-odds, by depth, that readings are of the surface beside an object, and not of the object at positions.
    //
    // They are the distance by which the reading is farther than the position and half the rise at the nearest end, in standard
    // deviations of both; where the rise is not known, the distance by which the reading is lower over the plane than half
    // the object.
    //
    // Parameters
    // ----------
    // points, pixels, readings
    //     (N, 3) float64 m in the camera's optical frame; (N, 2) int64, the pixel (u, v) of each; (N,) float64 m, the reading there
    // noise
    //     1/m, standard deviation of readings in inverse depth
    // ends, rise, rise_noise
    //     (E, 3) float64 m, E > 0 ends of chains, and (E,) float64 m, as `surface_beside` measures them there
    // camera, plane
    //     (4,) float64 intrinsics fx, fy, cx, cy in px, and (5,) float64: normal and height of the plane, and half the height of the
    //     object over it, m; (0,) each without a plane
    //
    // Returns
    // -------
    // (N,) float64 nat; 0 where it is not known
    m.def("surface_log_odds", &surface_log_odds, "points"_array, "pixels"_array, "readings"_array, "noise"_a, "ends"_array, "rise"_array,
          "rise_noise"_array, "camera"_array, "plane"_array);
}
