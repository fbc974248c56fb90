// Axes measured inside a plane that is seen beside them, raised to lie on it.
#include "arrays.h"
#include "medians.h"

namespace {

struct View {
    const Matrix<float>& depth;
    const Matrix<bool>& mask;
    const Vector<double>& camera;
    const Vector<double>& plane;

    double height(const double* point) const { return plane(0) * point[0] + plane(1) * point[1] + plane(2) * point[2] - plane(3); }

    // Append the height over the plane of what is seen at a position beside the mask, if anything is.
    void add_height(const double* point, std::vector<double>& heights) const {
        if (!(point[2] > 0)) return;
        const double u = std::nearbyint(camera(0) * point[0] / point[2] + camera(2));
        const double v = std::nearbyint(camera(1) * point[1] / point[2] + camera(3));
        if (!(u >= 0 && v >= 0 && u < double(mask.shape(1)) && v < double(mask.shape(0)))) return;
        const double reading = depth(Index(v), Index(u));
        if (mask(Index(v), Index(u)) || !(reading > 0)) return;
        const double seen[3] = {(u - camera(2)) / camera(0) * reading, (v - camera(3)) / camera(1) * reading, reading};
        heights.push_back(height(seen));
    }
};

auto raised_to_plane(Matrix<double> points, Matrix<double> lateral, Matrix<double> behind, Matrix<double> target, Vector<double> radius,
                     Matrix<float> depth, Matrix<bool> mask, Vector<double> camera, Vector<double> plane, Vector<double> beside,
                     double near_radii, double sunk_radii) {
    const Index count = Index(radius.shape(0));
    for (const auto* each : {&points, &lateral, &behind, &target}) {
        require(Index(each->shape(0)) == count && each->shape(1) == 3, "positions and axes are not (S, 3)");
    }
    require(depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1), "depth and mask have different shapes");
    require(camera.shape(0) == 4 && plane.shape(0) == 4, "camera or plane is not (4,)");
    const View view{depth, mask, camera, plane};
    std::vector<double> raised(target.data(), target.data() + target.size()), heights;
    count_visits(count);
    for (Index i = 0; i < count; ++i) {
        const double* axis = target.data() + 3 * i;
        const double* away = behind.data() + 3 * i;
        const double low = view.height(axis), slope = -(away[0] * plane(0) + away[1] * plane(1) + away[2] * plane(2));
        if (!(low < radius(i) && low > -sunk_radii * radius(i) && slope > 0)) continue;
        heights.clear();
        count_visits(2 * Index(beside.shape(0)));
        for (std::size_t b = 0; b < 2 * beside.shape(0); ++b) {
            const double offset = (b % 2 ? 1.0 : -1.0) * (radius(i) + beside(b / 2) * points(i, 2) / camera(0));
            const double at[3] = {points(i, 0) + offset * lateral(i, 0), points(i, 1) + offset * lateral(i, 1),
                                  points(i, 2) + offset * lateral(i, 2)};
            view.add_height(at, heights);
        }
        if (heights.empty() || !(std::fabs(median(heights)) < near_radii * radius(i))) continue;
        const double rise = std::min((radius(i) - low) / slope, (1 + sunk_radii) * radius(i));
        for (Index d = 0; d < 3; ++d) raised[3 * i + d] -= rise * away[d];
    }
    return to_numpy(std::move(raised), count, 3);
}

}  // namespace

void bind_plane_rise(nb::module_& m) {
    m.def("raised_to_plane", &raised_to_plane, "points"_a.noconvert(), "lateral"_a.noconvert(), "behind"_a.noconvert(),
          "target"_a.noconvert(), "radius"_a.noconvert(), "depth"_a.noconvert(), "mask"_a.noconvert(), "camera"_a.noconvert(),
          "plane"_a.noconvert(), "beside"_a.noconvert(), "near_radii"_a, "sunk_radii"_a);
}
