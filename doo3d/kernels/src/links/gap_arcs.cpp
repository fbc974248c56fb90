#include "gap_arcs.h"

namespace {

constexpr int MAX_ITERATIONS = 200;
constexpr double CONVERGED = 1e-13, TINY = 1e-12;

// Bisections of the step of sqrt 2 in which a radius is searched for: to 5 percent.
constexpr int BISECTIONS = 3;

// By the half-angle form of Kahan, exact near 0 and pi.
double angle_between(Vec a, Vec b) {
    a = unit(a);
    b = unit(b);
    return 2 * std::atan2(norm(minus(a, b)), norm(plus(a, b, 1.0)));
}

// Return the arc that leaves `start` in `direction` and ends heading for `target`; none if the target is in the circle.
std::optional<Arc> turn_towards(const Vec& start, const Vec& direction, const Vec& target, double radius, bool inside, bool planar) {
    const Vec way = minus(target, start);
    const double x = dot(way, direction);
    const Vec across = plus(way, direction, -x);
    double y = norm(across);
    Vec normal;
    if (y <= TINY * most(norm(way), 1e-300)) {
        normal = perpendicular(direction, planar);
        if (x >= 0) return Arc{start, direction, normal, 0.0, radius};
        y = 0.0;
    } else {
        normal = over(across, y);
    }
    if (inside) {
        normal = negative(normal);
        y = -y;
    }
    const double reach2 = x * x + (y - radius) * (y - radius) - radius * radius;
    if (reach2 < 0) return {};
    double theta = std::fmod(std::atan2(y - radius, x) + std::atan2(radius, std::sqrt(reach2)), 2 * PI);
    if (theta < 0) theta += 2 * PI;
    return Arc{start, direction, normal, theta > 2 * PI - 1e-9 ? 0.0 : theta, radius};
}

double length_of(const ArcPair& pair) {
    const auto& [first, second] = pair;
    return first.radius * (first.angle + second.angle) + norm(minus(second.end(), first.end()));
}

// Find a member of the family by aiming each arc at the end of the other in turn.
//
// It finds turns of any angle, but not members whose first arc reaches round the end that it is aimed at first.
std::optional<ArcPair> aim(const Ends& ends, double radius, bool inside) {
    const double scale = norm(minus(ends.e2, ends.e1));
    Vec target = ends.e2;
    double moved = INFINITY;
    std::optional<Arc> first, second;
    for (int round = 0; round < MAX_ITERATIONS && moved > CONVERGED * scale; ++round) {
        count_visits(1);
        first = turn_towards(ends.e1, ends.d1, target, radius, inside, ends.planar);
        if (!first) return {};
        second = turn_towards(ends.e2, ends.d2, first->end(), radius, inside, ends.planar);
        if (!second) return {};
        moved = norm(minus(second->end(), target));
        target = second->end();
    }
    const Vec direction = first->end_direction();
    const bool is_straight = moved <= 1e-6 * scale && dot(direction, second->end_direction()) <= 1e-9 - 1;
    if (!is_straight || !(dot(minus(target, first->end()), direction) >= -1e-9 * scale)) return {};
    return ArcPair{*first, *second};
}

// Return the arc from `start` that turns from one unit direction to another.
Arc bend(const Vec& start, const Vec& direction, const Vec& target_direction, double radius, bool planar) {
    const Vec across = plus(target_direction, direction, -dot(target_direction, direction));
    if (across == Vec{}) return {start, direction, perpendicular(direction, planar), 0.0, radius};
    return {start, direction, unit(across), angle_between(direction, target_direction), radius};
}

// Find a member of the family by its two corners, where the end lines meet the line, in turn with the line's direction.
//
// A corner lies r tan(turn / 2) ahead of its end. It finds members with large arcs, but no turns of nearly 180 degrees.
std::optional<ArcPair> find_corners(const Ends& ends, double radius) {
    const Vec way = minus(ends.e2, ends.e1);
    const double scale = norm(way);
    Vec line = over(way, scale);
    double length = scale, ahead = 0.0, moved = INFINITY;
    for (int round = 0; round < MAX_ITERATIONS && moved > CONVERGED; ++round) {
        count_visits(1);
        const double cosine1 = dot(ends.d1, line), cosine2 = -dot(ends.d2, line);
        if (least(cosine1, cosine2) < -0.999) return {};
        const double ahead1 = radius * std::sqrt(most(0.0, 1 - cosine1) / (1 + cosine1));
        const double ahead2 = radius * std::sqrt(most(0.0, 1 - cosine2) / (1 + cosine2));
        const Vec between = plus(plus(way, ends.d2, ahead2), ends.d1, -ahead1), before = line;
        length = norm(between);
        ahead = ahead1 + ahead2;
        if (length <= TINY * scale) return {};
        line = over(between, length);
        moved = norm(minus(line, before));
    }
    if (moved > 1e-10 || length < ahead - 1e-9 * scale) return {};
    return ArcPair{bend(ends.e1, ends.d1, line, radius, ends.planar), bend(ends.e2, ends.d2, negative(line), radius, ends.planar)};
}

// Find the arcs of one radius; the shorter path where both orders of aiming find different ones.
std::optional<ArcPair> connect(const Ends& ends, double radius, bool inside) {
    const std::optional<ArcPair> there = aim(ends, radius, inside), back = aim(ends.reversed(), radius, inside);
    if (there && (!back || length_of(*there) <= length_of(*back) * (1 + 1e-9))) return there;
    if (back) return ArcPair{back->second, back->first};
    return inside ? std::nullopt : find_corners(ends, radius);
}

// Find the member of a radius whose line deviates from the straight connection by at most so many radians.
std::optional<ArcPair> member(const Ends& ends, double radius, double max_deviation, bool inside) {
    const std::optional<ArcPair> pair = connect(ends, radius, inside);
    if (!pair) return {};
    const Vec line = minus(pair->second.end(), pair->first.end()), way = minus(ends.e2, ends.e1);
    const bool is_direct = norm(line) <= 1e-9 * norm(way) || angle_between(line, way) <= max_deviation;
    return is_direct ? pair : std::nullopt;
}

}  // namespace

Vec Arc::at(double turned) const {
    const double along = std::sin(turned), across = 1 - std::cos(turned);
    Vec point;
    for (int d = 0; d < 3; ++d) point[d] = start[d] + radius * (along * direction[d] + across * normal[d]);
    return point;
}

Vec Arc::end_direction() const {
    const double c = std::cos(angle), s = std::sin(angle);
    return {c * direction[0] + s * normal[0], c * direction[1] + s * normal[1], c * direction[2] + s * normal[2]};
}

double corner_radius_of(const Ends& ends) {
    const double cosine = dot(ends.d1, ends.d2), sine2 = 1 - cosine * cosine;
    if (sine2 < 1e-12) return -1.0;
    const Vec way = minus(ends.e2, ends.e1);
    const double a = (dot(way, ends.d1) - cosine * dot(way, ends.d2)) / sine2;
    const double b = (cosine * dot(way, ends.d1) - dot(way, ends.d2)) / sine2;
    if (a <= 0 || b <= 0) return -1.0;
    return least(a, b) / std::tan(angle_between(ends.d1, negative(ends.d2)) / 2);
}

std::optional<ArcPair> largest_member(const Ends& ends, double radius, double max_deviation, bool inside) {
    std::optional<ArcPair> pair = member(ends, radius, max_deviation, inside);
    if (pair) return pair;
    for (int halving = 0; halving < 40 && !pair; ++halving) {
        radius /= std::sqrt(2.0);
        pair = member(ends, radius, max_deviation, inside);
    }
    double step = std::pow(2.0, 0.25);
    for (int bisection = 0; bisection < BISECTIONS; ++bisection) {
        if (const std::optional<ArcPair> larger = member(ends, radius * step, max_deviation, inside)) {
            pair = larger;
            radius *= step;
        }
        step = std::sqrt(step);
    }
    return pair;
}
