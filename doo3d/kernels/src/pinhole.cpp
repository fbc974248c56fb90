// The pinhole camera: points projected to pixels, and pixels with depth to points.
#include "arrays.h"

namespace {

auto project_pinhole(StridedMatrix<double> points, double fx, double fy, double cx, double cy) {
    const std::size_t size = points.shape(0);
    require(points.shape(1) == 3, "points are not (N, 3)");
    count_visits(Index(size));
    ReleasedGil released;
    std::vector<double> pixels(2 * size);
    for (std::size_t n = 0; n < size; ++n) {
        const double z = points(n, 2) > 0 ? points(n, 2) : NAN;
        pixels[2 * n] = fx * points(n, 0) / z + cx;
        pixels[2 * n + 1] = fy * points(n, 1) / z + cy;
    }
    released.end();
    return to_numpy(std::move(pixels), size, 2);
}

auto unproject_pinhole(StridedMatrix<double> pixels, Vector<double> depth, double fx, double fy, double cx, double cy) {
    const std::size_t size = pixels.shape(0);
    require(pixels.shape(1) == 2 && depth.shape(0) == size, "pixels are not (N, 2), or depth is not (N,)");
    count_visits(Index(size));
    ReleasedGil released;
    std::vector<double> points(3 * size);
    for (std::size_t n = 0; n < size; ++n) {
        const double z = depth(n);
        points[3 * n] = (pixels(n, 0) - cx) * z / fx;
        points[3 * n + 1] = (pixels(n, 1) - cy) * z / fy;
        points[3 * n + 2] = z;
    }
    released.end();
    return to_numpy(std::move(points), size, 3);
}

}  // namespace

void bind_pinhole(Module& m) {
    // Return the pixels (N, 2) float64 (u, v) of points (N, 3) float64 m of any layout; NaN for those with z <= 0.
    //
    // A pixel is (fx x / z + cx, fy y / z + cy).
    m.def("project_pinhole", &project_pinhole, "points"_a.noconvert(), "fx"_a, "fy"_a, "cx"_a, "cy"_a);
    // Return the points (N, 3) float64 m at depths along z that are seen at pixels.
    //
    // pixels : (N, 2) float64 (u, v), of any layout. depth : (N,) float64 m.
    m.def("unproject_pinhole", &unproject_pinhole, "pixels"_a.noconvert(), "depth"_a.noconvert(), "fx"_a, "fy"_a, "cx"_a, "cy"_a);
}
