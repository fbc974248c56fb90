#include "arrays.h"
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

struct Frame {
    const Matrix<float>& depth;
    const Matrix<bool>& mask;
    double fx, fy, cx, cy;

    // The reading in the mask at a position in the image; 0 if there is none.
    double reading(double u, double v) const {
        u = std::nearbyint(u);
        v = std::nearbyint(v);
        if (!(u >= 0 && v >= 0 && u < double(mask.shape(1)) && v < double(mask.shape(0)))) return 0.0;
        const Index row = Index(v), column = Index(u);
        return mask(row, column) && depth(row, column) > 0 ? depth(row, column) : 0.0;
    }
};

// Append by how much the readings beside a segment, from joint to joint, lie behind its surface, to `raw`; and to `errors` without
// what the plane explains: readings between the surface of a segment that lies on it and the plane are of both.
void add_errors(const Frame& frame, const Table& table, const double* start, const double* end, double radius,
                const Vector<double>& positions, const Vector<double>& lateral, double surface, std::vector<double>& errors, std::vector<double>& raw) {
    const Index steps = positions.shape(0);
    std::vector<double> z(steps), u(steps), v(steps), below(steps, 0.0);
    for (Index k = 0; k < steps; ++k) {
        double point[3];
        for (Index d = 0; d < 3; ++d) point[d] = start[d] + positions(k) * (end[d] - start[d]);
        z[k] = point[2];
        u[k] = frame.fx * point[0] / z[k] + frame.cx;
        v[k] = frame.fy * point[1] / z[k] + frame.cy;
        if (!(z[k] > 0 && std::isfinite(u[k]) && std::isfinite(v[k]))) return;
        if (table.carries(point, radius)) {  // depth from the surface to the plane, along the ray of the axis
            const double towards = (table.height(point) + table.plane(3)) / z[k];
            below[k] = std::max(0.0, (table.plane(3) / towards) - z[k] + surface * radius);
        }
    }
    double along[2] = {u[steps - 1] - u[0], v[steps - 1] - v[0]};
    const double norm = std::max(std::sqrt(along[0] * along[0] + along[1] * along[1]), 1e-9);
    for (double& each : along) each /= norm;
    for (Index k = 0; k < steps; ++k) {
        for (std::size_t a = 0; a < lateral.shape(0); ++a) {
            const double offset = radius * frame.fx / z[k] * lateral(a);
            const double reading = frame.reading(u[k] - offset * along[1], v[k] + offset * along[0]);
            if (!(reading > 0)) continue;
            const double error = reading - (z[k] - surface * radius);
            raw.push_back(error);
            errors.push_back(error > 0 ? std::max(0.0, error - below[k]) : error);
        }
    }
}

// The readings that count for all segments of a chain are found first, since the noise of the chain tells which of them agree.
auto depth_support(Matrix<double> joints, Vector<Index> bounds, Vector<double> radius, Matrix<float> depth, Matrix<bool> mask,
                   Vector<double> camera, Vector<double> plane, Vector<double> positions, Vector<double> lateral,
                   double surface_radii, double lying_radii, double deviations) {
    check_bounds(bounds, joints.shape(0));
    require(joints.shape(1) == 3 && camera.shape(0) == 4, "joints and camera are not (J, 3) and (4,)");
    require(plane.shape(0) == 0 || plane.shape(0) == 4, "plane is neither (4,) nor (0,)");
    require(radius.shape(0) + 1 == bounds.shape(0), "radius is not one per chain");
    require(depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1), "depth and mask have different shapes");
    require(positions.shape(0) > 0 && lateral.shape(0) > 0, "positions or lateral are empty");
    const Frame frame{depth, mask, camera(0), camera(1), camera(2), camera(3)};
    const Table table{plane, lying_radii};
    const double samples = double(positions.shape(0) * lateral.shape(0));
    count_visits(Index(samples) * Index(joints.shape(0)));
    ReleasedGil released;
    std::vector<double> supported, agreeing, residual, offset;
    for (std::size_t c = 0; c < radius.shape(0); ++c) {
        std::vector<double> errors, raw, residuals;
        std::vector<std::size_t> first;
        for (Index j = bounds(c); j + 1 < bounds(c + 1); ++j) {
            first.push_back(errors.size());
            add_errors(frame, table, joints.data() + 3 * j, joints.data() + 3 * j + 3, radius(c), positions, lateral, surface_radii, errors, raw);
        }
        first.push_back(errors.size());
        for (const double error : errors) residuals.push_back(std::fabs(error));
        const double wide = deviations * MAD_TO_DEVIATION * (residuals.empty() ? 0.0 : median(residuals));
        const double limit = std::min(std::max(wide, MIN_TOLERANCE_RADII * radius(c)), MAX_TOLERANCE_RADII * radius(c));
        for (std::size_t j = 0; j + 1 < first.size(); ++j) {
            std::vector<double> own(errors.begin() + first[j], errors.begin() + first[j + 1]);
            std::vector<double> all(raw.begin() + first[j], raw.begin() + first[j + 1]);
            Index near = 0, agree = 0;
            for (const double error : own) {
                near += std::fabs(error) < MIN_TOLERANCE_RADII * radius(c);
                agree += std::fabs(error) < limit;
            }
            supported.push_back(double(near) / samples);
            agreeing.push_back(double(agree) / samples);
            const bool is_known = Index(own.size()) >= MIN_READINGS;
            residual.push_back(is_known ? std::fabs(median(own)) / radius(c) : NAN);
            offset.push_back(is_known ? median(all) / radius(c) : NAN);
        }
    }
    released.end();
    return std::make_tuple(to_numpy(std::move(supported)), to_numpy(std::move(agreeing)), to_numpy(std::move(residual)),
                           to_numpy(std::move(offset)));
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
    m.def("depth_support", &depth_support, "joints"_a.noconvert(), "bounds"_a.noconvert(), "radius"_a.noconvert(), "depth"_a.noconvert(),
          "mask"_a.noconvert(), "camera"_a.noconvert(), "plane"_a.noconvert(), "positions"_a.noconvert(), "lateral"_a.noconvert(), nb::kw_only(),
          "surface_radii"_a, "lying_radii"_a, "deviations"_a);
}
