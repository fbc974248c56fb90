#include "cells.h"

namespace {

// A segment as a cuboid: its middle, its unit axes along the segment and across it, and half its edges.
struct Cuboid {
    double middle[3], axis[3][3], half[3];
};

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Cuboid cuboid_of(const double* start, const double* end, Index dim, double width) {
    Cuboid box{};
    double offset[3] = {0, 0, 0};
    for (Index d = 0; d < dim; ++d) {
        box.middle[d] = (start[d] + end[d]) / 2;
        offset[d] = end[d] - start[d];
    }
    const double length = std::sqrt(dot(offset, offset));
    double *x = box.axis[0], *y = box.axis[1], *z = box.axis[2];
    for (Index d = 0; d < 3; ++d) x[d] = length > 0 ? offset[d] / length : double(d == 0);
    Index least = 0;  // of equal ones the first
    for (Index d = 1; d < 3; ++d) least = std::fabs(x[d]) < std::fabs(x[least]) ? d : least;
    for (Index d = 0; d < 3; ++d) y[d] = double(d == least) - x[d] * x[least];
    const double size = std::sqrt(dot(y, y));
    for (Index d = 0; d < 3; ++d) y[d] /= size;
    for (Index d = 0; d < 3; ++d) z[d] = x[(d + 1) % 3] * y[(d + 2) % 3] - x[(d + 2) % 3] * y[(d + 1) % 3];
    box.half[0] = length / 2;
    box.half[1] = box.half[2] = width / 2;
    return box;
}

const double ROUNDING = 1e-6;  // share of the size of two cuboids

// Return how far two cuboids reach along an axis beyond the distance of their middles, in units of the axis.
double common_reach(const Cuboid& first, const Cuboid& second, const double* axis) {
    const double between[3] = {second.middle[0] - first.middle[0], second.middle[1] - first.middle[1], second.middle[2] - first.middle[2]};
    double reach = -std::fabs(dot(between, axis));
    for (const Cuboid* box : {&first, &second}) {
        for (Index k = 0; k < 3; ++k) reach += box->half[k] * std::fabs(dot(box->axis[k], axis));
    }
    return reach;
}

double size_of(const Cuboid& first, const Cuboid& second) { return first.half[0] + first.half[1] + second.half[0] + second.half[1]; }

// Return the least reach over the axes of both cuboids: below 0 there is a gap.
double least_reach(const Cuboid& first, const Cuboid& second) {
    double least = common_reach(first, second, first.axis[0]);
    for (const Cuboid* cuboid : {&first, &second}) {
        for (const auto& axis : cuboid->axis) least = std::min(least, common_reach(first, second, axis));
    }
    return least;
}

// Tell whether no axis across an edge of both parts two cuboids, by more than rounding.
bool edges_overlap(const Cuboid& first, const Cuboid& second) {
    for (const auto& x : first.axis) {
        for (const auto& y : second.axis) {
            const double axis[3] = {x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
            const double length = std::sqrt(dot(axis, axis));
            if (length > ROUNDING && common_reach(first, second, axis) < 10 * ROUNDING * size_of(first, second) * length) return false;
        }
    }
    return true;
}

auto near_cuboids(Matrix<double> starts, Matrix<double> ends, Vector<Index> chain, double width) {
    const Index count = starts.shape(0), dim = starts.shape(1);
    require(dim == 2 || dim == 3, "starts are neither (S, 2) nor (S, 3)");
    require(Index(ends.shape(0)) == count && Index(ends.shape(1)) == dim, "ends are not as many as starts");
    require(Index(chain.shape(0)) == count, "chain is not one per segment");
    require(width > 0 && std::isfinite(width), "width is not positive and finite");
    for (Index k = 0; k < count * dim; ++k) {
        require(std::isfinite(starts.data()[k]) && std::isfinite(ends.data()[k]), "a coordinate is not finite");
    }
    std::vector<Index> pairs;
    std::vector<Byte> overlap;
    if (count > 0) {
        nb::gil_scoped_release released;
        std::vector<Cuboid> boxes(count);
        std::vector<double> middles;
        double longest = 0.0;
        for (Index i = 0; i < count; ++i) {
            boxes[i] = cuboid_of(starts.data() + i * dim, ends.data() + i * dim, dim, width);
            middles.insert(middles.end(), boxes[i].middle, boxes[i].middle + dim);
            longest = std::max(longest, 2 * boxes[i].half[0]);
        }
        const double reach = longest + 2 * width;
        const Cells cells(middles.data(), count, dim, reach / CELLS_PER_REACH);
        count_visits(2 * count);
        std::vector<Index> others;
        for (Index i = 0; i < count; ++i) {
            others.clear();
            cells.for_each_around(middles.data() + i * dim, reach, [&](Index k) {
                const Index j = cells.order[k];
                const bool are_neighbors = j == i + 1 && chain(i) == chain(j);
                if (j <= i || are_neighbors) return;
                if (least_reach(boxes[i], boxes[j]) >= -ROUNDING * size_of(boxes[i], boxes[j])) others.push_back(j);
            });
            std::sort(others.begin(), others.end());
            for (const Index j : others) {
                pairs.insert(pairs.end(), {i, j});
                const bool is_clear = least_reach(boxes[i], boxes[j]) > 10 * ROUNDING * size_of(boxes[i], boxes[j]);
                overlap.push_back(is_clear && edges_overlap(boxes[i], boxes[j]));
            }
        }
    }
    const std::size_t found = pairs.size() / 2;
    return std::make_tuple(to_numpy(std::move(pairs), found, 2), to_numpy_bool(overlap));
}

}  // namespace

void bind_near_cuboids(Module& m) {
    // Return the pairs of segments that may intersect, each taken as a cuboid with a square cross-section.
    //
    // A pair is left out if there is a gap between the two along one of the axes of either cuboid. Consecutive segments of a chain,
    // which share a joint, are left out too. In 2-D the cuboids lie in the plane z = 0.
    //
    // Parameters
    // ----------
    // starts, ends
    //     (S, D) float64, the two joints of each of S segments, D = 2 or 3
    // chain
    //     (S,) int64, number of the chain of each segment
    // width
    //     edge of the cross-section, in the unit of the joints
    //
    // Returns
    // -------
    // pairs : (K, 2) int64, indices (i, j) with i < j, in lexicographic order.
    // overlap : (K,) bool, the pairs that intersect for certain: by more than rounding along each axis that could part them.
    //
    // Notes
    // -----
    // One axis of a cuboid's cross-section is perpendicular to the coordinate axis that the segment is least along.
    m.def("near_cuboids", &near_cuboids, "starts"_a.noconvert(), "ends"_a.noconvert(), "chain"_a.noconvert(), "width"_a);
}
