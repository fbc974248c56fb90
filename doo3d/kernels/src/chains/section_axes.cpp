// Unit axes of the cross-sections of strands.
#include "cross_sections.h"
#include "vector3.h"

AcrossAxes axes_across(const double* positions, const double* tangents, Index size, const double* viewpoint) {
    count_visits(size);
    AcrossAxes axes;
    Vec lateral{};
    for (Index s = 0; s < size; ++s) {
        const Vec tangent = vec(tangents + 3 * s);
        const bool turns = !viewpoint && s > 0;
        Vec side = turns ? plus(lateral, tangent, -dot(lateral, tangent)) : perpendicular(tangent);
        if (viewpoint) side = cross(minus(vec(positions + 3 * s), vec(viewpoint)), tangent);
        const double square = dot(side, side), least = turns ? 1e-6 : 0.0;
        lateral = square <= least * least ? perpendicular(tangent) : over(side, std::sqrt(square));
        const Vec depth = cross(tangent, lateral);
        axes.lateral.insert(axes.lateral.end(), lateral.begin(), lateral.end());
        axes.depth.insert(axes.depth.end(), depth.begin(), depth.end());
    }
    return axes;
}

namespace {

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
