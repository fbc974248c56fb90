// Unit axes of the cross-sections of strands.
#include "cross_sections.h"

namespace {

void cross(const double* a, const double* b, double* result) {
    for (int d = 0; d < 3; ++d) result[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

// Write the vector scaled to length 1; return false for one that is shorter than `least`.
bool scale_to_unit(const double* vector, double least, double* result) {
    const double square = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2];
    if (square <= least * least) return false;
    for (int d = 0; d < 3; ++d) result[d] = vector[d] / std::sqrt(square);
    return true;
}

// Write the part of a vector that is perpendicular to a unit vector.
void without(const double* vector, const double* direction, double* result) {
    const double along = vector[0] * direction[0] + vector[1] * direction[1] + vector[2] * direction[2];
    for (int d = 0; d < 3; ++d) result[d] = vector[d] - along * direction[d];
}

// Write a unit vector perpendicular to a direction, made from the coordinate axis that it is least along.
void perpendicular(const double* direction, double* result) {
    int least = 0;
    for (int d = 1; d < 3; ++d) {
        if (std::fabs(direction[d]) < std::fabs(direction[least])) least = d;
    }
    double axis[3] = {0, 0, 0}, side[3];
    axis[least] = 1.0;
    without(axis, direction, side);
    if (!scale_to_unit(side, 0.0, result)) std::copy(axis, axis + 3, result);
}

auto section_axes(Matrix<double> positions, Matrix<double> tangents, Vector<double> viewpoint) {
    const Index size = positions.shape(0);
    require(positions.shape(1) == 3 && tangents.shape(1) == 3, "positions and tangents are not (S, 3)");
    require(Index(tangents.shape(0)) == size, "tangents are not one per position");
    require(viewpoint.shape(0) == 0 || viewpoint.shape(0) == 3, "viewpoint is neither (3,) nor (0,)");
    const std::vector<double> seen_from = dense(viewpoint);
    AcrossAxes axes = axes_across(positions.data(), tangents.data(), size, seen_from.empty() ? nullptr : seen_from.data());
    return std::make_tuple(rows_of(std::move(axes.lateral), 3), rows_of(std::move(axes.depth), 3));
}

}  // namespace

AcrossAxes axes_across(const double* positions, const double* tangents, Index size, const double* viewpoint) {
    count_visits(size);
    AcrossAxes axes{std::vector<double>(3 * size), std::vector<double>(3 * size)};
    double side[3];
    for (Index s = 0; s < size; ++s) {
        const double* tangent = tangents + 3 * s;
        double *lateral = axes.lateral.data() + 3 * s, least = 0.0;
        if (viewpoint) {
            double ray[3];
            for (int d = 0; d < 3; ++d) ray[d] = positions[3 * s + d] - viewpoint[d];
            cross(ray, tangent, side);
        } else if (s > 0) {
            without(lateral - 3, tangent, side);
            least = 1e-6;
        } else {
            perpendicular(tangent, side);
        }
        if (!scale_to_unit(side, least, lateral)) perpendicular(tangent, lateral);
        cross(tangent, lateral, axes.depth.data() + 3 * s);
    }
    return axes;
}

void bind_section_axes(Module& m) {
    // Return two unit axes across the object at each sample: across the line of sight, and away from the sensor.
    //
    // Parameters
    // ----------
    // positions
    //     (S, 3) float64 m
    // tangents
    //     (S, 3) float64 unit, along the object
    // viewpoint
    //     (3,) float64 m, position of the sensor; (0,) if unknown: the axes then turn as little as they can from sample to sample
    //
    // Returns
    // -------
    // lateral : (S, 3) float64; arbitrary where the object points at the sensor
    // depth : (S, 3) float64, tangent x lateral
    m.def("section_axes", &section_axes, "positions"_array, "tangents"_array, "viewpoint"_array);
}
