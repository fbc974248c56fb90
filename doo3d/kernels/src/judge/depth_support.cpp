#include "image.h"
#include "order_statistics.h"

namespace {

// Radii by which a reading may differ from the surface and still support it. The least is that of visibility: a table under the object is
// two radii behind the surface. The most is where `strand_depth` takes a reading for that of something else.
constexpr double MIN_TOLERANCE_RADII = 1.2, MAX_TOLERANCE_RADII = 2.5;
constexpr Index MIN_READINGS = 3;  // of a segment that make a median

// The plane that objects lie on, its normal and its height along that; or none.
struct Table {
    const Vector<double>& plane;
    double lying;

    double height(const double* point) const { return plane(0) * point[0] + plane(1) * point[1] + plane(2) * point[2] - plane(3); }
    bool carries(const double* point, double radius) const {
        return plane.shape(0) == 4 && height(point) > 0 && height(point) < lying * radius;
    }
};

// What is seen of chains, and where it is read.
struct View {
    const Camera camera;
    const MaskedDepth depth;  // in the mask
    const Table table;
    const Vector<double>&positions, &lateral;
    double surface_radii;
};

// By how much readings lie behind a surface, m; and without what the plane explains.
struct Errors {
    std::vector<double> raw, rest;
};

// Append the errors of the readings beside a segment from joint to joint: readings between the surface of a segment that lies on the plane
// and the plane are of both.
void add_errors(const View& view, const double* start, double radius, Errors& errors) {
    const Index steps = view.positions.shape(0);
    const double* end = start + 3;
    std::vector<double> z(steps), at(2 * steps), below(steps);
    for (Index k = 0; k < steps; ++k) {
        double point[3];
        for (Index d = 0; d < 3; ++d) point[d] = start[d] + view.positions(k) * (end[d] - start[d]);
        z[k] = point[2];
        view.camera.project(point, &at[2 * k]);
        if (!(std::isfinite(at[2 * k]) && std::isfinite(at[2 * k + 1]))) return;
        if (view.table.carries(point, radius)) {  // depth from the surface to the plane, along the ray of the axis
            const double height = view.table.plane(3), towards = (view.table.height(point) + height) / z[k];
            below[k] = std::max(0.0, (height / towards) - z[k] + view.surface_radii * radius);
        }
    }
    double along[2] = {at[2 * steps - 2] - at[0], at[2 * steps - 1] - at[1]};
    const double norm = std::max(std::sqrt(along[0] * along[0] + along[1] * along[1]), 1e-9);
    for (double& each : along) each /= norm;
    for (Index k = 0; k < steps; ++k) {
        for (std::size_t a = 0; a < view.lateral.shape(0); ++a) {
            const double offset = radius * view.camera.fx / z[k] * view.lateral(a);
            const double reading = view.depth.at(at[2 * k] - offset * along[1], at[2 * k + 1] + offset * along[0], true);
            if (std::isnan(reading)) continue;
            const double error = reading - (z[k] - view.surface_radii * radius);
            errors.raw.push_back(error);
            errors.rest.push_back(error > 0 ? std::max(0.0, error - below[k]) : error);
        }
    }
}

// Of each segment, as the kernel returns them.
struct Support {
    std::vector<double> supported, agreeing, residual, offset;

    // Append that of a segment of which `samples` readings are taken; `limit` is by how much readings that agree may differ, m.
    void add(const Errors& errors, double samples, double radius, double limit) {
        Index near = 0, agree = 0;
        for (const double error : errors.rest) {
            near += std::fabs(error) < MIN_TOLERANCE_RADII * radius;
            agree += std::fabs(error) < limit;
        }
        supported.push_back(double(near) / samples);
        agreeing.push_back(double(agree) / samples);
        const bool is_known = Index(errors.rest.size()) >= MIN_READINGS;
        residual.push_back(is_known ? std::fabs(median(errors.rest)) / radius : NAN);
        offset.push_back(is_known ? median(errors.raw) / radius : NAN);
    }
};

// The readings that count for all segments of a chain are found first, since the noise of the chain tells which of them agree.
auto depth_support(Matrix<double> joints, Vector<Index> bounds, Vector<double> radius, Matrix<float> depth, Matrix<bool> mask,
                   Vector<double> camera, Vector<double> plane, Vector<double> positions, Vector<double> lateral, double surface_radii,
                   double lying_radii, double deviations) {
    check_bounds(bounds, joints.shape(0));
    require(joints.shape(1) == 3, "joints are not (J, 3)");
    require(plane.shape(0) == 0 || plane.shape(0) == 4, "plane is neither (4,) nor (0,)");
    require(radius.shape(0) + 1 == bounds.shape(0), "radius is not one per chain");
    require(positions.shape(0) > 0 && lateral.shape(0) > 0, "positions or lateral are empty");
    const View view{Camera(camera), {depth, mask}, {plane, lying_radii}, positions, lateral, surface_radii};
    view.depth.check();
    const double samples = double(positions.shape(0) * lateral.shape(0));
    count_visits(Index(samples) * Index(joints.shape(0)));
    Support support;
    for (std::size_t c = 0; c < radius.shape(0); ++c) {
        std::vector<Errors> segments;
        std::vector<double> all;
        for (Index j = bounds(c); j + 1 < bounds(c + 1); ++j) {
            segments.emplace_back();
            add_errors(view, joints.data() + 3 * j, radius(c), segments.back());
            all.insert(all.end(), segments.back().rest.begin(), segments.back().rest.end());
        }
        const double wide = deviations * MAD_TO_DEVIATION * (all.empty() ? 0.0 : absolute_median(all));
        const double limit = std::min(std::max(wide, MIN_TOLERANCE_RADII * radius(c)), MAX_TOLERANCE_RADII * radius(c));
        for (const Errors& errors : segments) support.add(errors, samples, radius(c), limit);
    }
    return std::make_tuple(std::move(support.supported), std::move(support.agreeing), std::move(support.residual), std::move(support.offset));
}

}  // namespace

void bind_depth_support(Module& m) {
    // Compare the segments of chains with the depth readings in the mask beside them.
    //
    // Parameters
    // ----------
    // joints
    //     (J, 3) float64 m in the camera's optical frame, the joints of C chains, one chain after the other
    // bounds
    //     (C + 1,) int64; the joints of chain c are joints[bounds[c]:bounds[c + 1]], the last entry is J
    // radius
    //     (C,) float64 m, radius of each chain
    // depth, mask
    //     (H, W) float32 m, 0 = no reading, and (H, W) bool
    // camera
    //     (4,) float64, the intrinsics fx, fy, cx, cy in px
    // plane
    //     (4,) float64, unit normal and height along it, m, of the plane that chains may lie on; (0,) without one. A reading between
    //     a segment on it and the plane does not differ
    // positions, lateral
    //     (P,) and (A,) float64: fractions of a segment's length, and radii to the side of its axis, at which readings are taken
    // surface_radii, lying_radii
    //     radii by which the surface is nearer than the axis, and over the plane below which an axis lies on it
    // deviations
    //     standard deviations of a chain's readings by which a reading may differ and agree, within 1.2 and 2.5 radii
    //
    // Returns
    // -------
    // supported, agreeing : (S,) float64 of S segments, the share of the P A readings of each that differ by less than 1.2 radii,
    //     and by less than the chain's readings may; 0 for a segment behind the camera
    // residual : (S,) float64 radii, absolute median difference of the readings of each; NaN with too few
    // offset : (S,) float64 radii, by how much they lie behind the surface, median, whatever the plane explains; NaN with too few
    m.def("depth_support", &depth_support, "joints"_array, "bounds"_array, "radius"_array, "depth"_array, "mask"_array, "camera"_array,
          "plane"_array, "positions"_array, "lateral"_array, nb::kw_only(), "surface_radii"_a, "lying_radii"_a, "deviations"_a);
}
