// Depth readings compared with their neighbors in the image.
#include "arrays.h"

#include <algorithm>

namespace {

// The window of `half_width` px about a pixel, within the image.
struct Window {
    Index top, bottom, left, right;
    Window(Index row, Index column, Index half_width, Index height, Index width)
        : top(std::max<Index>(row - half_width, 0)),
          bottom(std::min(row + half_width + 1, height)),
          left(std::max<Index>(column - half_width, 0)),
          right(std::min(column + half_width + 1, width)) {}
};

void check_shapes(const Matrix<float>& depth, const Matrix<bool>& mask) {
    require(depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1), "depth and mask have different shapes");
}

auto readings_in_mask(Matrix<float> depth, Matrix<bool> mask) {
    check_shapes(depth, mask);
    const float* z = depth.data();
    std::vector<float> readings;
    for_each_set(mask, [&](Index i) {
        if (z[i] > 0) readings.push_back(z[i]);
    });
    return to_numpy(std::move(readings));
}

auto depth_differences(Matrix<float> depth, Matrix<bool> mask) {
    check_shapes(depth, mask);
    const Index width = depth.shape(1);
    const float* z = depth.data();
    std::vector<float> differences;
    Index previous = -2;
    for_each_set(mask, [&](Index i) {
        if (!(z[i] > 0)) return;
        if (previous == i - 1 && i % width) differences.push_back(std::fabs(z[i] - z[previous]));
        previous = i;
    });
    return to_numpy(std::move(differences));
}

// Each reading between `low` and `high` is compared with the others in the window around it.
auto agreeing_readings(Matrix<float> depth, Matrix<bool> mask, double low, double high, Index half_width, double slope,
                       Index min_agreeing) {
    check_shapes(depth, mask);
    require(half_width >= 0, "half_width is negative");
    const Index height = depth.shape(0), width = depth.shape(1);
    half_width = std::min(half_width, std::max(height, width));
    const float* z = depth.data();
    const Byte* in_mask = bytes_of(mask);
    std::vector<Index> rows, columns;
    std::vector<double> means;
    Index dropped = 0;
    Visits visits;
    for_each_set(mask, [&](Index offset) {
        const float center = z[offset];
        if (!(center >= float(low) && center <= float(high))) return;
        const Index center_row = offset / width, center_column = offset % width;
        double total = center;
        Index support = 0, neighbors = 0;
        const Window window(center_row, center_column, half_width, height, width);
        visits.count += (window.bottom - window.top) * (window.right - window.left);
        for (Index row = window.top; row < window.bottom; ++row) {
            for (Index column = window.left; column < window.right; ++column) {
                const Index other = row * width + column;
                const Index distance = std::max(std::abs(row - center_row), std::abs(column - center_column));
                if (distance == 0 || !in_mask[other] || !(z[other] > 0)) continue;
                ++neighbors;
                if (double(std::fabs(z[other] - center)) < slope * double(distance)) {
                    ++support;
                    total += double(z[other]);
                }
            }
        }
        if (double(support) < std::min(double(min_agreeing), double(neighbors) / 2)) {
            ++dropped;
            return;
        }
        rows.push_back(center_row);
        columns.push_back(center_column);
        means.push_back(total / double(support + 1));
    });
    return std::make_tuple(to_numpy(std::move(rows)), to_numpy(std::move(columns)), to_numpy(std::move(means)), dropped);
}

}  // namespace

void bind_depth_filter(nb::module_& m) {
    m.def("readings_in_mask", &readings_in_mask, "depth"_a.noconvert(), "mask"_a.noconvert());
    m.def("depth_differences", &depth_differences, "depth"_a.noconvert(), "mask"_a.noconvert());
    m.def("agreeing_readings", &agreeing_readings, "depth"_a.noconvert(), "mask"_a.noconvert(), "low"_a, "high"_a, "half_width"_a,
          "slope"_a, "min_agreeing"_a);
}
