// What a depth image says about positions in space.
#include "arrays.h"

namespace {

// The reading at the pixel to which each position projects is compared with the position.
auto classify_positions(StridedMatrix<double> points, Vector<double> camera, Matrix<float> depth, Matrix<bool> mask, double margin,
                        bool own_counts, Vector<Index> classes) {
    require(points.shape(1) == 3 && camera.shape(0) == 4 && classes.shape(0) == 6, "points, camera or classes are not (N, 3), (4,), (6,)");
    require(depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1), "depth and mask have different shapes");
    const Index count = points.shape(0);
    const Index outside = classes(0), no_depth = classes(1), masked = classes(2), surface = classes(3), hidden = classes(4), free = classes(5);
    const double height = double(mask.shape(0)), width = double(mask.shape(1));
    std::vector<Index> result(count, outside), behind, pixels;
    std::vector<double> readings;
    count_visits(count);
    for (Index n = 0; n < count; ++n) {
        const double z = points(n, 2);
        const double u = camera(0) * points(n, 0) / z + camera(2), v = camera(1) * points(n, 1) / z + camera(3);
        if (!(z > 0 && u > -0.5 && v > -0.5 && u < width - 0.5 && v < height - 0.5)) continue;
        const Index column = Index(std::nearbyint(u)), row = Index(std::nearbyint(v));
        const double reading = depth(row, column);
        const bool on = mask(row, column);
        if (reading <= 0) {
            result[n] = on ? masked : no_depth;
        } else if (reading > z + margin && (own_counts || !on)) {
            result[n] = free;
        } else {
            result[n] = reading < z - margin || !on ? hidden : surface;
        }
        if (result[n] == hidden && !on && reading >= z - margin) {
            behind.push_back(n);
            pixels.insert(pixels.end(), {column, row});
            readings.push_back(reading);
        }
    }
    const std::size_t number = behind.size();
    return std::make_tuple(to_numpy(std::move(result)), to_numpy(std::move(behind)), to_numpy(std::move(pixels), number, 2),
                           to_numpy(std::move(readings)));
}

}  // namespace

void bind_visibility(nb::module_& m) {
    m.def("classify_positions", &classify_positions, "points"_a.noconvert(), "camera"_a.noconvert(), "depth"_a.noconvert(),
          "mask"_a.noconvert(), "margin"_a, "own_counts"_a, "classes"_a.noconvert());
}
