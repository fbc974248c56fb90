// Gap paths: arc, straight line, arc of one radius between two ends (Dubins paths of the CSC kind; in space each arc has a plane
// of its own).
//
// Vectors have three coordinates; in the plane, `planar`, the third is 0.
#include "arrays.h"

#include <array>

namespace {

using Vec = std::array<double, 3>;

constexpr int MAX_ITERATIONS = 200;
constexpr double CONVERGED = 1e-13, TINY = 1e-12;

// Bisections of the step of sqrt 2 in which a radius is searched for: to 5 percent.
constexpr int BISECTIONS = 3;

const double PI = std::acos(-1.0);

// An arc from `start` in `direction`, bending towards `normal` (all unit), by `angle` radians.
struct Arc {
    Vec start, direction, normal;
    double angle, radius;
};

// Two arcs, both pointing into the gap, if there are such.
struct Pair {
    bool found;
    Arc first, second;
};

double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double norm(const Vec& a) { return std::sqrt(dot(a, a)); }
Vec plus(const Vec& a, const Vec& b, double times) { return {a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]}; }
Vec minus(const Vec& a, const Vec& b) { return plus(a, b, -1.0); }
Vec negative(const Vec& a) { return {-a[0], -a[1], -a[2]}; }

Vec unit(const Vec& a) {
    const double size = norm(a);
    return size > 0 ? Vec{a[0] / size, a[1] / size, a[2] / size} : a;
}

// By the half-angle form of Kahan, exact near 0 and pi.
double angle_between(Vec a, Vec b) {
    a = unit(a);
    b = unit(b);
    return 2 * std::atan2(norm(minus(a, b)), norm(plus(a, b, 1.0)));
}

// Return a unit vector square to a direction, always the same for the same direction.
Vec perpendicular(const Vec& direction, bool planar) {
    const double x = std::fabs(direction[0]), y = std::fabs(direction[1]), z = std::fabs(direction[2]);
    Vec axis{1.0, 0.0, 0.0};
    if (y < x && (planar || y <= z)) {
        axis = {0.0, 1.0, 0.0};
    } else if (!planar && z < x && z < y) {
        axis = {0.0, 0.0, 1.0};
    }
    return unit(plus(axis, direction, -dot(axis, direction)));
}

// Return the point on an arc after turning by so many radians.
Vec point_at(const Arc& arc, double turned) {
    const double along = std::sin(turned), across = 1 - std::cos(turned);
    Vec point;
    for (int d = 0; d < 3; ++d) point[d] = arc.start[d] + arc.radius * (along * arc.direction[d] + across * arc.normal[d]);
    return point;
}

Vec end_of(const Arc& arc) { return point_at(arc, arc.angle); }

Vec direction_at_end(const Arc& arc) {
    const double c = std::cos(arc.angle), s = std::sin(arc.angle);
    Vec direction;
    for (int d = 0; d < 3; ++d) direction[d] = c * arc.direction[d] + s * arc.normal[d];
    return direction;
}

// Return the arc that leaves `start` in `direction` and ends heading for `target`, if the target is not in the circle.
std::pair<bool, Arc> turn_towards(const Vec& start, const Vec& direction, const Vec& target, double radius, bool inside, bool planar) {
    const Vec way = minus(target, start);
    const double x = dot(way, direction);
    const Vec across = plus(way, direction, -x);
    double y = norm(across);
    Vec normal;
    if (y <= TINY * most(norm(way), 1e-300)) {
        normal = perpendicular(direction, planar);
        if (x >= 0) return {true, Arc{start, direction, normal, 0.0, radius}};
        y = 0.0;
    } else {
        normal = {across[0] / y, across[1] / y, across[2] / y};
    }
    if (inside) {
        normal = negative(normal);
        y = -y;
    }
    const double reach2 = x * x + (y - radius) * (y - radius) - radius * radius;
    if (reach2 < 0) return {false, Arc{start, direction, normal, 0.0, radius}};
    double theta = std::fmod(std::atan2(y - radius, x) + std::atan2(radius, std::sqrt(reach2)), 2 * PI);
    if (theta < 0) theta += 2 * PI;
    return {true, Arc{start, direction, normal, theta > 2 * PI - 1e-9 ? 0.0 : theta, radius}};
}

double length_of(const Arc& first, const Arc& second) {
    return first.radius * (first.angle + second.angle) + norm(minus(end_of(second), end_of(first)));
}

// Two ends with the unit tangents that point out of their chains.
struct Ends {
    Vec e1, d1, e2, d2;
    bool planar;
    Ends reversed() const { return {e2, d2, e1, d1, planar}; }
};

// Find a member of the family by aiming each arc at the end of the other in turn.
//
// It finds turns of any angle, but not members whose first arc reaches round the end that it is aimed at first.
Pair aim(const Ends& ends, double radius, bool inside) {
    const double scale = norm(minus(ends.e2, ends.e1));
    Vec target = ends.e2;
    double moved = INFINITY;
    Arc first{ends.e1, ends.d1, ends.d1, 0.0, radius}, second = first;
    for (int round = 0; round < MAX_ITERATIONS; ++round) {
        count_visits(1);
        bool found;
        std::tie(found, first) = turn_towards(ends.e1, ends.d1, target, radius, inside, ends.planar);
        if (!found) return {false, first, second};
        std::tie(found, second) = turn_towards(ends.e2, ends.d2, end_of(first), radius, inside, ends.planar);
        if (!found) return {false, first, second};
        const Vec end = end_of(second);
        moved = norm(minus(end, target));
        target = end;
        if (moved <= CONVERGED * scale) break;
    }
    const Vec direction = direction_at_end(first);
    const bool straight = moved <= 1e-6 * scale && dot(direction, direction_at_end(second)) <= 1e-9 - 1;
    return {straight && dot(minus(target, end_of(first)), direction) >= -1e-9 * scale, first, second};
}

// Return the arc from `start` that turns from one unit direction to another.
Arc bend(const Vec& start, const Vec& direction, const Vec& target_direction, double radius, bool planar) {
    const Vec across = plus(target_direction, direction, -dot(target_direction, direction));
    if (across[0] == 0 && across[1] == 0 && across[2] == 0) {
        return {start, direction, perpendicular(direction, planar), 0.0, radius};
    }
    return {start, direction, unit(across), angle_between(direction, target_direction), radius};
}

// Find a member of the family by its two corners, where the end lines meet the line, in turn with the line's direction.
//
// A corner lies r tan(turn / 2) ahead of its end. It finds members with large arcs, but no turns of nearly 180 degrees.
Pair find_corners(const Ends& ends, double radius) {
    const Arc none{ends.e1, ends.d1, ends.d1, 0.0, radius};
    const Vec way = minus(ends.e2, ends.e1);
    const double scale = norm(way);
    Vec line{way[0] / scale, way[1] / scale, way[2] / scale};
    double length = scale, ahead = 0.0, moved = INFINITY;
    for (int round = 0; round < MAX_ITERATIONS; ++round) {
        count_visits(1);
        const double cosine1 = dot(ends.d1, line), cosine2 = -dot(ends.d2, line);
        if (least(cosine1, cosine2) < -0.999) return {false, none, none};
        const double ahead1 = radius * std::sqrt(most(0.0, 1 - cosine1) / (1 + cosine1));
        const double ahead2 = radius * std::sqrt(most(0.0, 1 - cosine2) / (1 + cosine2));
        const Vec between = plus(plus(way, ends.d2, ahead2), ends.d1, -ahead1);
        length = norm(between);
        ahead = ahead1 + ahead2;
        if (length <= TINY * scale) return {false, none, none};
        const Vec before = line;
        line = {between[0] / length, between[1] / length, between[2] / length};
        moved = norm(minus(line, before));
        if (moved <= CONVERGED) break;
    }
    if (moved > 1e-10 || length < ahead - 1e-9 * scale) return {false, none, none};
    return {true, bend(ends.e1, ends.d1, line, radius, ends.planar), bend(ends.e2, ends.d2, negative(line), radius, ends.planar)};
}

// Find the arcs of one radius; the shorter path where both orders of aiming find different ones.
Pair connect(const Ends& ends, double radius, bool inside) {
    const Pair there = aim(ends, radius, inside);
    const Pair back = aim(ends.reversed(), radius, inside);
    if (there.found && (!back.found || length_of(there.first, there.second) <= length_of(back.first, back.second) * (1 + 1e-9))) {
        return there;
    }
    if (back.found || inside) return {back.found, back.second, back.first};
    return find_corners(ends, radius);
}

// Return the radius of the largest circle that touches both end lines ahead of the ends; -1 where they do not meet there.
double corner_radius_of(const Ends& ends) {
    const double cosine = dot(ends.d1, ends.d2), sine2 = 1 - cosine * cosine;
    if (sine2 < 1e-12) return -1.0;
    const Vec way = minus(ends.e2, ends.e1);
    const double a = (dot(way, ends.d1) - cosine * dot(way, ends.d2)) / sine2;
    const double b = (cosine * dot(way, ends.d1) - dot(way, ends.d2)) / sine2;
    if (a <= 0 || b <= 0) return -1.0;
    return least(a, b) / std::tan(angle_between(ends.d1, negative(ends.d2)) / 2);
}

// Find the member of a radius whose line deviates from the straight connection by at most so many radians.
Pair member(const Ends& ends, double radius, double max_deviation, bool inside) {
    Pair pair = connect(ends, radius, inside);
    if (pair.found) {
        const Vec line = minus(end_of(pair.second), end_of(pair.first)), way = minus(ends.e2, ends.e1);
        pair.found = norm(line) <= 1e-9 * norm(way) || angle_between(line, way) <= max_deviation;
    }
    return pair;
}

// Find the member with about the largest radius up to `radius`.
Pair largest_member(const Ends& ends, double radius, double max_deviation, bool inside) {
    Pair pair = member(ends, radius, max_deviation, inside);
    if (pair.found) return pair;
    for (int halving = 0; halving < 40 && !pair.found; ++halving) {
        radius /= std::sqrt(2.0);
        pair = member(ends, radius, max_deviation, inside);
    }
    double step = std::pow(2.0, 0.25);
    for (int bisection = 0; bisection < BISECTIONS; ++bisection) {
        const Pair larger = member(ends, radius * step, max_deviation, inside);
        if (larger.found) {
            pair = larger;
            radius *= step;
        }
        step = std::sqrt(step);
    }
    return pair;
}

// ---- at the border: an arc is a row of 3 D + 2 numbers: start, direction, normal, angle, radius

using Rows = std::vector<double>;

void check_dimension(Index dim) { require(dim == 2 || dim == 3, "points have neither 2 nor 3 coordinates"); }

Ends read_ends(const Matrix<double>& ends) {
    const Index dim = ends.shape(1);
    require(ends.shape(0) == 4, "ends are not (4, D)");
    check_dimension(dim);
    auto row = [&](Index i) { return Vec{ends(i, 0), ends(i, 1), dim == 3 ? ends(i, 2) : 0.0}; };
    return {row(0), row(1), row(2), row(3), dim == 2};
}

void write_arc(const Arc& arc, Index dim, Rows& rows) {
    for (const Vec* v : {&arc.start, &arc.direction, &arc.normal}) rows.insert(rows.end(), v->begin(), v->begin() + dim);
    rows.push_back(arc.angle);
    rows.push_back(arc.radius);
}

auto to_rows(const Pair& pair, Index dim) {
    Rows rows;
    if (pair.found) {
        write_arc(pair.first, dim, rows);
        write_arc(pair.second, dim, rows);
    }
    return to_numpy(std::move(rows), pair.found ? 2 : 0, 3 * dim + 2);
}

Arc read_arc(const Matrix<double>& rows, Index i, Index dim) {
    auto part = [&](Index k) { return Vec{rows(i, k * dim), rows(i, k * dim + 1), dim == 3 ? rows(i, k * dim + 2) : 0.0}; };
    return {part(0), part(1), part(2), rows(i, 3 * dim), rows(i, 3 * dim + 1)};
}

auto solve_gap(Matrix<double> given, double radius, double max_deviation, bool inside) {
    const Index dim = given.shape(1);
    Ends ends = read_ends(given);
    ends.d1 = unit(ends.d1);
    ends.d2 = unit(ends.d2);
    const Vec way = minus(ends.e2, ends.e1);
    const double gap = norm(way);
    if (gap < TINY) return std::make_tuple(true, to_numpy(Rows(), 0, 3 * dim + 2));
    const double corner = corner_radius_of(ends);
    inside = inside && most(dot(ends.d1, way), -dot(ends.d2, way)) < 0;
    if (corner > 0) {
        radius = corner;
        max_deviation = PI;
        inside = false;
    } else if (radius > 0) {
        max_deviation = PI;
    } else {
        radius = gap / 2;
    }
    ReleasedGil released;
    const Pair pair = largest_member(ends, radius, max_deviation, inside);
    released.end();
    return std::make_tuple(false, to_rows(pair, dim));
}

// Return the number of steps of at most `spacing` on an arc.
Index step_count(const Arc& arc, double spacing) {
    if (!(arc.angle > 0)) return 0;
    return std::max<Index>(1, Index(std::ceil(arc.angle * arc.radius / spacing)));
}

auto sample_gap(Matrix<double> arcs, double spacing) {
    require(arcs.shape(0) == 2 && (arcs.shape(1) == 8 || arcs.shape(1) == 11), "arcs are not (2, 3 D + 2)");
    require(spacing > 0, "spacing is not positive");
    const Index dim = Index(arcs.shape(1)) / 3;
    const Arc first = read_arc(arcs, 0, dim), second = read_arc(arcs, 1, dim);
    const Vec out = end_of(first), back = end_of(second), line = minus(back, out);
    require(std::isfinite(norm(line)) && std::isfinite(first.angle * first.radius) && std::isfinite(second.angle * second.radius),
            "an arc is not finite");
    require((norm(line) + first.angle * first.radius + second.angle * second.radius) / spacing < 1e9,
            "the path has more than 1e9 points");
    const Index before = step_count(first, spacing), after = step_count(second, spacing);
    const Index between = std::max<Index>(1, Index(std::ceil(norm(line) / spacing)));
    const Index count = before + between + after + 1;
    count_visits(count);
    std::vector<double> points(count * dim);
    for (Index i = 0; i < count; ++i) {
        Vec point;
        if (i < before) {
            point = point_at(first, double(i) * (first.angle / double(before)));
        } else if (i == before) {
            point = out;
        } else if (i < before + between) {
            point = plus(out, line, double(i - before) / double(between));
        } else if (i == before + between) {
            point = back;
        } else {
            point = point_at(second, double(count - 1 - i) * (second.angle / double(after)));
        }
        for (Index d = 0; d < dim; ++d) points[i * dim + d] = point[d];
    }
    return to_numpy(std::move(points), count, dim);
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
    m.def("solve_gap", &solve_gap, "ends"_a.noconvert(), "radius"_a, "max_deviation"_a, "inside"_a);
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
    m.def("sample_gap", &sample_gap, "arcs"_a.noconvert(), "spacing"_a);
}
