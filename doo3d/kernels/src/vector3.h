// Vectors in space.
#pragma once

#include <array>
#include <cmath>

using Vec = std::array<double, 3>;

inline Vec vec(const double* p) { return {p[0], p[1], p[2]}; }
inline double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline double norm(const Vec& a) { return std::sqrt(dot(a, a)); }
inline Vec plus(const Vec& a, const Vec& b, double times) { return {a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]}; }
inline Vec minus(const Vec& a, const Vec& b) { return plus(a, b, -1.0); }
inline Vec negative(const Vec& a) { return {-a[0], -a[1], -a[2]}; }
inline Vec over(const Vec& a, double divisor) { return {a[0] / divisor, a[1] / divisor, a[2] / divisor}; }
inline Vec unit(const Vec& a) {
    const double size = norm(a);
    return size > 0 ? over(a, size) : a;
}
inline Vec cross(const Vec& a, const Vec& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Return a unit vector square to a direction, made from the coordinate axis that it is least along; `planar` leaves the third coordinate 0.
inline Vec perpendicular(const Vec& direction, bool planar = false) {
    const double x = std::fabs(direction[0]), y = std::fabs(direction[1]), z = std::fabs(direction[2]);
    Vec axis{1.0, 0.0, 0.0};
    if (y < x && (planar || y <= z)) {
        axis = {0.0, 1.0, 0.0};
    } else if (!planar && z < x && z < y) {
        axis = {0.0, 0.0, 1.0};
    }
    return unit(plus(axis, direction, -dot(axis, direction)));
}
