// Pairs of arcs of one radius that join two ends by a straight line between them.
#pragma once

#include "arrays.h"
#include "vector3.h"

// An arc from `start` in `direction`, bending towards `normal` (all unit), by `angle` radians.
struct Arc {
    Vec start, direction, normal;
    double angle, radius;

    // Return the point after turning by so many radians.
    Vec at(double turned) const;
    Vec end() const { return at(angle); }
    Vec end_direction() const;
    double length() const { return angle * radius; }
};

// Both arcs point into the gap.
using ArcPair = std::pair<Arc, Arc>;

// Two ends with the unit tangents that point out of their chains.
struct Ends {
    Vec e1, d1, e2, d2;
    bool planar;
    Ends reversed() const { return {e2, d2, e1, d1, planar}; }
};

// Return the radius of the largest circle that touches both end lines ahead of the ends; -1 where they do not meet there.
double corner_radius_of(const Ends& ends);

// Find the arcs with about the largest radius up to `radius`, whose line deviates from the straight connection by at most so many radians.
std::optional<ArcPair> largest_member(const Ends& ends, double radius, double max_deviation, bool inside);
