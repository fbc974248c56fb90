// Gap paths: arc, straight line, arc of one radius between two ends (Dubins paths of the CSC kind; in space each arc has a plane
// of its own).
//
// Vectors have three coordinates; in the plane, `planar`, the third is 0. For Python an arc is a row of 3 D + 2 numbers: start, direction,
// normal, angle, radius.
#include "gap_arcs.h"

namespace {

constexpr double TOUCHING = 1e-12;  // greatest distance of ends at the same position

// Read the D coordinates from a column of a row on.
Vec read_vector(const Matrix<double>& rows, Index row, Index column, Index dim) {
    return {rows(row, column), rows(row, column + 1), dim == 3 ? rows(row, column + 2) : 0.0};
}

Arc read_arc(const Matrix<double>& rows, Index i, Index dim) {
    const auto part = [&](Index k) { return read_vector(rows, i, k * dim, dim); };
    return {part(0), part(1), part(2), rows(i, 3 * dim), rows(i, 3 * dim + 1)};
}

auto solve_gap(Matrix<double> given, double radius, double max_deviation, bool inside) {
    const Index dim = given.shape(1);
    require(given.shape(0) == 4 && (dim == 2 || dim == 3), "ends are neither (4, 2) nor (4, 3)");
    const auto row = [&](Index i) { return read_vector(given, i, 0, dim); };
    const Ends ends{row(0), unit(row(1)), row(2), unit(row(3)), dim == 2};
    const Vec way = minus(ends.e2, ends.e1);
    const double gap = norm(way), corner = corner_radius_of(ends);
    std::vector<double> rows;
    if (gap < TOUCHING) return std::make_tuple(true, rows_of(std::move(rows), 3 * dim + 2));
    inside = inside && !(corner > 0) && most(dot(ends.d1, way), -dot(ends.d2, way)) < 0;
    const bool is_given = corner > 0 || radius > 0;
    radius = corner > 0 ? corner : radius > 0 ? radius : gap / 2;
    if (const std::optional<ArcPair> pair = largest_member(ends, radius, is_given ? PI : max_deviation, inside)) {
        for (const Arc& arc : {pair->first, pair->second}) {
            for (const Vec& v : {arc.start, arc.direction, arc.normal}) rows.insert(rows.end(), v.begin(), v.begin() + dim);
            rows.insert(rows.end(), {arc.angle, arc.radius});
        }
    }
    return std::make_tuple(false, rows_of(std::move(rows), 3 * dim + 2));
}

// Return the number of steps of at most `spacing` on an arc.
Index step_count(const Arc& arc, double spacing) {
    return arc.angle > 0 ? std::max<Index>(1, Index(std::ceil(arc.length() / spacing))) : 0;
}

auto sample_gap(Matrix<double> arcs, double spacing) {
    require(arcs.shape(0) == 2 && (arcs.shape(1) == 8 || arcs.shape(1) == 11), "arcs are not (2, 3 D + 2)");
    require(spacing > 0, "spacing is not positive");
    const Index dim = Index(arcs.shape(1)) / 3;
    const Arc first = read_arc(arcs, 0, dim), second = read_arc(arcs, 1, dim);
    const Vec out = first.end(), back = second.end(), line = minus(back, out);
    const double total = norm(line) + first.length() + second.length();
    require(std::isfinite(total), "an arc is not finite");
    require(total / spacing < 1e9, "the path has more than 1e9 points");
    const Index before = step_count(first, spacing), after = step_count(second, spacing);
    const Index between = std::max<Index>(1, Index(std::ceil(norm(line) / spacing)));
    count_visits(before + between + after + 1);
    std::vector<double> points;
    const auto add = [&](const Vec& point) { points.insert(points.end(), point.begin(), point.begin() + dim); };
    for (Index i = 0; i < before; ++i) add(first.at(double(i) * (first.angle / double(before))));
    add(out);
    for (Index i = 1; i < between; ++i) add(plus(out, line, double(i) / double(between)));
    add(back);
    for (Index i = after; i-- > 0;) add(second.at(double(i) * (second.angle / double(after))));
    return rows_of(std::move(points), dim);
}

}  // namespace

void bind_gap_path(Module& m) {
    // Return the arcs of the path across a gap: an arc, a straight line, an arc, tangent to both ends.
    //
    // Parameters
    // ----------
    // ends
    //     (4, D) float64, rows: first end, its outward direction, second end, its outward direction
    // radius
    //     radius of the arcs, in the unit of the ends, if the end lines do not meet ahead of both ends; 0 chooses the largest, up
    //     to half the gap, that keeps `max_deviation`. If the lines meet (skew ones where they are closest), the radius is that of
    //     the largest circle that touches both ahead of the ends. A radius without a path is made smaller until there is one
    // max_deviation
    //     rad, greatest angle between the straight line and the direct connection of the ends; applies only if the radius is chosen
    // inside
    //     applies if both ends point away from each other: True leads the path through the inside of the gap, False around it
    //
    // Returns
    // -------
    // touch : True if the ends are at the same position
    // arcs : (2, 3 D + 2) float64, one arc per row, at the first and at the second end; each starts at its end and runs into the
    //     gap, and the straight line joins the points where the arcs end. Columns: start (D,), unit direction at the start (D,),
    //     unit normal from the start towards the center of the circle (D,), angle in radians, radius. (0, 3 D + 2) if the ends
    //     touch or no path was found
    m.def("solve_gap", &solve_gap, "ends"_array, "radius"_a, "max_deviation"_a, "inside"_a);
    // Return points along a path of an arc, a line and an arc, at most `spacing` apart, from the first end to the second.
    //
    // Parameters
    // ----------
    // arcs
    //     (2, 3 D + 2) float64, the arcs at the two ends, as `solve_gap` returns them
    // spacing
    //     greatest distance between neighboring points along the path, in the unit of the arcs
    //
    // Returns
    // -------
    // (P, D) float64, P >= 2 points; both ends of the path and both ends of its straight line are among them.
    m.def("sample_gap", &sample_gap, "arcs"_array, "spacing"_a);
}
