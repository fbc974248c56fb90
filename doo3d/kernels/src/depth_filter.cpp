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

void check(const Matrix<float>& depth, const Matrix<bool>& mask, const Vector<Index>& rows, const Vector<Index>& columns) {
    require(depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1), "depth and mask have different shapes");
    require(rows.shape(0) == columns.shape(0), "rows and columns have different lengths");
    for (std::size_t i = 0; i < rows.shape(0); ++i) {
        const Index row = rows(i), column = columns(i);
        require(row >= 0 && row < Index(depth.shape(0)) && column >= 0 && column < Index(depth.shape(1)),
                "a pixel lies outside the depth image");
    }
}

auto count_agreeing_neighbors(Matrix<float> depth, Matrix<bool> mask, Vector<Index> rows, Vector<Index> columns, Index half_width,
                              double slope) {
    check(depth, mask, rows, columns);
    const Index height = depth.shape(0), width = depth.shape(1), count = rows.shape(0);
    std::vector<Index> support(count), neighbors(count);
    std::vector<double> mean(count);
    for (Index i = 0; i < count; ++i) {
        const Index center_row = rows(i), center_column = columns(i);
        const float center = depth(center_row, center_column);
        double total = center;
        const Window window(center_row, center_column, half_width, height, width);
        for (Index row = window.top; row < window.bottom; ++row) {
            const float* depth_row = depth.data() + row * width;
            const bool* mask_row = mask.data() + row * width;
            for (Index column = window.left; column < window.right; ++column) {
                const float z = depth_row[column];
                const Index distance = std::max(std::abs(row - center_row), std::abs(column - center_column));
                if (distance > 0 && z > 0 && mask_row[column]) {
                    ++neighbors[i];
                    if (double(std::fabs(z - center)) < slope * double(distance)) {
                        ++support[i];
                        total += double(z);
                    }
                }
            }
        }
        mean[i] = total / double(support[i] + 1);
    }
    return std::make_tuple(to_numpy(std::move(support)), to_numpy(std::move(neighbors)), to_numpy(std::move(mean)));
}

auto sigma_filter(Matrix<float> depth, Matrix<bool> mask, Vector<Index> rows, Vector<Index> columns, Index half_width,
                  double max_difference) {
    check(depth, mask, rows, columns);
    const Index height = depth.shape(0), width = depth.shape(1), count = rows.shape(0);
    std::vector<double> mean(count);
    for (Index i = 0; i < count; ++i) {
        const float center = depth(rows(i), columns(i));
        double total = 0.0;
        Index averaged = 0;
        const Window window(rows(i), columns(i), half_width, height, width);
        for (Index row = window.top; row < window.bottom; ++row) {
            const float* depth_row = depth.data() + row * width;
            const bool* mask_row = mask.data() + row * width;
            for (Index column = window.left; column < window.right; ++column) {
                const float z = depth_row[column];
                if (mask_row[column] && z > 0 && double(std::fabs(z - center)) < max_difference) {
                    total += double(z);
                    ++averaged;
                }
            }
        }
        mean[i] = total / double(averaged);
    }
    return to_numpy(std::move(mean));
}

}  // namespace

void bind_depth_filter(nb::module_& m) {
    m.def("count_agreeing_neighbors", &count_agreeing_neighbors, "depth"_a.noconvert(), "mask"_a.noconvert(), "rows"_a.noconvert(),
          "columns"_a.noconvert(), "half_width"_a, "slope"_a);
    m.def("sigma_filter", &sigma_filter, "depth"_a.noconvert(), "mask"_a.noconvert(), "rows"_a.noconvert(), "columns"_a.noconvert(),
          "half_width"_a, "max_difference"_a);
}
