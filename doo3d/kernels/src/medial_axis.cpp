// The medial axis of a mask: pixels as far from its outside as their farthest neighbor.
#include "arrays.h"

#include <algorithm>

namespace {

// px: the lengths of the three kinds of steps on a 5 x 5 neighborhood (Borgefors, CVGIP 34, 1986).
constexpr float SIDE = 1.0f, CORNER = 1.4f, KNIGHT = 2.1969f;

// px by which a neighbor may be farther from the edge.
constexpr float SLACK = 1e-3f;

// Return the distance at x of a row by way of the row before it, the one before that, and the pixel beside.
float chamfer(const float* row, const float* one, const float* two, Index x, Index side) {
    const float near = least(least(one[x - 1], one[x + 1]) + CORNER, least(one[x], row[x + side]) + SIDE);
    return least(near, least(least(two[x - 1], two[x + 1]), least(one[x - 2], one[x + 2])) + KNIGHT);
}

// The chamfer distance in two passes, down and up. Both remember no more than three rows, padded by two pixels of outside on either
// side, and what they found at the pixels of the mask.
auto medial_axis(Matrix<bool> mask) {
    const Index height = mask.shape(0), width = mask.shape(1), padded = width + 4;
    std::vector<Index> starts(height + 1), columns;
    std::vector<float> inside, rows(3 * padded);
    auto row_of = [&](Index v) { return rows.data() + ((v % 3) + 3) % 3 * padded; };
    for (Index v = 0; v < height; ++v) {
        float* row = row_of(v);
        const bool* mask_row = mask.data() + v * width;
        std::fill(row, row + padded, 0.0f);
        for (Index u = 0; u < width; ++u) {
            if (!mask_row[u]) continue;
            row[u + 2] = chamfer(row, row_of(v - 1), row_of(v - 2), u + 2, -1);
            columns.push_back(u);
            inside.push_back(row[u + 2]);
        }
        starts[v + 1] = Index(columns.size());
    }
    count_visits(height * width + 2 * Index(columns.size()));
    std::fill(rows.begin(), rows.end(), 0.0f);
    std::vector<Index> axis_rows, axis_columns;
    std::vector<float> distances;
    for (Index v = height - 1; v >= -1; --v) {
        float* row = row_of(v);
        const float *below = row_of(v + 1), *beyond = row_of(v + 2);
        std::fill(row, row + padded, 0.0f);
        if (v >= 0) {
            for (Index k = starts[v + 1] - 1; k >= starts[v]; --k) {
                const Index x = columns[k] + 2;
                row[x] = least(inside[k], chamfer(row, below, beyond, x, 1));
            }
        }
        if (v + 1 < height) {  // the row below has all its neighbors now
            for (Index k = starts[v + 1]; k < starts[v + 2]; ++k) {
                const Index x = columns[k] + 2;
                float farthest = below[x];
                for (Index n = x - 1; n < x + 2; ++n) farthest = most(most(most(farthest, row[n]), below[n]), beyond[n]);
                if (below[x] >= farthest - SLACK) {
                    axis_rows.push_back(v + 1);
                    axis_columns.push_back(columns[k]);
                    distances.push_back(below[x]);
                }
            }
        }
    }
    return std::make_tuple(to_numpy(std::move(axis_rows)), to_numpy(std::move(axis_columns)), to_numpy(std::move(distances)));
}

}  // namespace

void bind_medial_axis(nb::module_& m) { m.def("medial_axis", &medial_axis, "mask"_a.noconvert()); }
