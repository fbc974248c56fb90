// A plane in depth: fitted to points, and the pixels raised from it.
#include "runs.h"
#include "symmetric.h"
#include "vector3.h"

namespace {

constexpr Index BLOCK = 64;  // points or pixels at a time, for vector instructions

// Points axis by axis, for vector instructions.
struct Columns {
    Index count;
    std::vector<double> axes;

    explicit Columns(const StridedMatrix<double>& points) : count(points.shape(0)), axes(3 * count) {
        count_visits(count);
        for (Index n = 0; n < count; ++n) {
            for (Index d = 0; d < 3; ++d) axes[d * count + n] = points(n, d);
        }
    }
    const double* axis(Index d) const { return axes.data() + d * count; }
    Vec point(Index n) const { return {axis(0)[n], axis(1)[n], axis(2)[n]}; }
};

struct Plane {
    Vec normal{0, 0, 1};
    double offset = 0;
};

// Return the plane with a normal through a point.
Plane plane_through(const Vec& normal, const Vec& point) { return {normal, dot(normal, point)}; }

// Return the plane through three of the points; none if they are on one line.
std::optional<Plane> plane_of(const Columns& points, const Index* corners) {
    const Vec corner = points.point(corners[0]);
    const Vec normal = cross(minus(points.point(corners[1]), corner), minus(points.point(corners[2]), corner));
    return norm(normal) > 0 ? std::make_optional(plane_through(over(normal, norm(normal)), corner)) : std::nullopt;
}

// Count the points near a plane; the count ends as soon as the rest of the points cannot make it more than `most`.
Index count_near(const Columns& points, const Plane& plane, double distance, Index most) {
    const double *x = points.axis(0), *y = points.axis(1), *z = points.axis(2), offset = plane.offset;
    const double a = plane.normal[0], b = plane.normal[1], c = plane.normal[2];
    Index near = 0;
    Visits visits;
    for (Index first = 0; first < points.count && near + points.count - first > most; first += BLOCK) {
        int sum = 0;
        for (Index n = first; n < std::min(first + BLOCK, points.count); ++n) sum += std::fabs(x[n] * a + y[n] * b + z[n] * c - offset) < distance;
        near += sum;
        visits.count += BLOCK;
    }
    return near;
}

// Fit a plane to its inliers by least squares; false if they are the same as before, or fewer than three.
bool refine(const Columns& points, double distance, std::vector<Byte>& inlier, Plane& plane) {
    bool changed = false;
    Vec center{};
    double number = 0, spread[3][3] = {}, axes[3][3];
    count_visits(points.count);
    for (Index n = 0; n < points.count; ++n) {
        const Byte near = std::fabs(dot(points.point(n), plane.normal) - plane.offset) < distance;
        changed = changed || near != inlier[n];
        inlier[n] = near;
        number += near;
        for (Index d = 0; d < 3; ++d) center[d] += near ? points.axis(d)[n] : 0.0;
    }
    if (number < 3 || !changed) return false;
    center = over(center, number);
    for (Index n = 0; n < points.count; ++n) {
        if (!inlier[n]) continue;
        const Vec moved = minus(points.point(n), center);
        for (Index i = 0; i < 3; ++i) {
            for (Index j = 0; j < 3; ++j) spread[i][j] += moved[i] * moved[j];
        }
    }
    diagonalize(spread, axes);
    Index least = 0;
    for (Index k = 1; k < 3; ++k) least = spread[k][k] < spread[least][least] ? k : least;
    plane = plane_through({axes[0][least], axes[1][least], axes[2][least]}, center);
    return true;
}

auto fit_plane(StridedMatrix<double> points, Matrix<Index> corners, double distance, Index refinements) {
    const Index count = points.shape(0);
    require(points.shape(1) == 3 && corners.shape(1) == 3 && count > 0, "points or corners are not (., 3), or there are no points");
    for (std::size_t k = 0; k < corners.size(); ++k) require(corners.data()[k] >= 0 && corners.data()[k] < count, "a corner is no point");
    require(refinements >= 0 && refinements <= 1000, "refinements are not from 0 to 1000");
    Plane best;
    const Columns columns(points);
    Index most = -1;
    best.offset = columns.axis(2)[0];
    for (Index k = 0; k < Index(corners.shape(0)); ++k) {
        const std::optional<Plane> plane = plane_of(columns, corners.data() + 3 * k);
        const Index near = plane ? count_near(columns, *plane, distance, most) : -1;
        if (near <= most) continue;
        best = *plane;
        most = near;
    }
    std::vector<Byte> inlier(count, 0);
    for (Index k = 0; k < refinements && most >= 0 && refine(columns, 2 * distance, inlier, best); ++k) continue;
    return std::make_pair(std::vector<double>(best.normal.begin(), best.normal.end()), best.offset);
}

enum Level : Byte { NONE, LOW, SEED };

struct Hysteresis {
    float offset, low, high;
};

// The height of a pixel of depth z above the plane is offset - z (along_u + along_v). Pixels above `high` are seeds, from which the
// pixels above `low` are reached.
WITH_AVX2 void find_levels(const float* __restrict depth, const std::vector<float>& along, float along_v, Hysteresis to,
                           Byte* __restrict levels) {
    const float *along_u = along.data(), offset = to.offset, low = to.low, high = to.high;
    const Index width = Index(along.size());
    for (Index c = 0; c < width; ++c) {
        const float z = depth[c], height = offset - (along_v + along_u[c]) * z;
        levels[c] = Byte(Byte((z > 0) & (height > low)) + Byte((z > 0) & (height > high)));
    }
}

// Set the pixels of the components with a seed to 1 and all others to 0.
void reach_from_seeds(Byte* levels, Index height, Index width) {
    const std::vector<Run> runs = runs_of(levels, height, width);
    RunSets sets = connected(runs, 1);
    std::vector<Byte> has_seed(runs.size(), 0);
    count_visits(Index(runs.size()));
    const auto pixels = [&](const Run& run) { return levels + run.row * width + run.start; };
    const auto size = [](const Run& run) { return std::size_t(run.size()); };
    for (std::size_t i = 0; i < runs.size(); ++i) {
        has_seed[sets.root(std::int32_t(i))] |= std::memchr(pixels(runs[i]), SEED, size(runs[i])) != nullptr;
    }
    for (std::size_t i = 0; i < runs.size(); ++i) std::memset(pixels(runs[i]), has_seed[sets.root(std::int32_t(i))], size(runs[i]));
}

auto raised_pixels(Matrix<float> depth, Vector<float> along_u, Vector<float> along_v, double offset, double low, double high) {
    const Index height = depth.shape(0), width = depth.shape(1), size = height * width;
    require(Index(along_u.shape(0)) == width, "along_u is not one per column");
    require(Index(along_v.shape(0)) == height, "along_v is not one per row");
    require(low <= high, "low is above high");
    count_visits(size);
    std::vector<Byte> levels(size);
    const std::vector<float> u = dense(along_u);
    for (Index row = 0; row < height; ++row) {
        find_levels(depth.data() + row * width, u, along_v(row), {float(offset), float(low), float(high)}, &levels[row * width]);
    }
    reach_from_seeds(levels.data(), height, width);
    return Array<Byte, 2, bool>{std::move(levels), {std::size_t(height), std::size_t(width)}};
}

}  // namespace

void bind_plane(Module& m) {
    // Fit the plane that has the most points near it, by planes tried and then least squares on the inliers.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64 m, at least one, of any layout
    // corners
    //     (Q, 3) int64, rows of three points through which a plane is tried; the first of several with as many points near is taken
    // distance
    //     m; a point nearer to a plane tried than this counts for it, one nearer than twice of it is an inlier of the fit
    // refinements
    //     times at most that the plane is fitted to its inliers; it ends when these stay the same
    //
    // Returns
    // -------
    // normal : (3,) unit, of arbitrary sign.
    // offset : m; points p on the plane have normal @ p = offset.
    //
    // If the corners of every plane are on one line, the result is the plane z = constant through the first point.
    m.def("fit_plane", &fit_plane, "points"_array, "corners"_array, "distance"_a, "refinements"_a);
    // Select the pixels raised from a plane towards the camera: hysteresis threshold of their height.
    //
    // A pixel of depth z lies offset - z (along_u + along_v) above the plane. Pixels higher than `high` are selected, and pixels
    // higher than `low` that are connected to these by pixels higher than `low`, along rows, columns or diagonals.
    //
    // Parameters
    // ----------
    // depth
    //     (H, W) float32 m, 0 = no reading, which is never selected
    // along_u, along_v
    //     (W,) and (H,) float32; their sum is the product of the plane's normal with the ray through the pixel, scaled to z = 1
    // offset
    //     m; points p on the plane have normal @ p = offset, and the normal points away from the camera
    // low, high
    //     m, the thresholds, low <= high
    //
    // Returns
    // -------
    // (H, W) bool
    m.def("raised_pixels", &raised_pixels, "depth"_array, "along_u"_array, "along_v"_array, "offset"_a, "low"_a, "high"_a);
}
