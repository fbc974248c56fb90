// The nearest target of each of many points that lie near them.
#pragma once

#include "cells.h"

#include <optional>

// Targets (S, D) of which the nearest to each point is looked for; where distance and index are filled in.
struct NearestSearch {
    const double* targets;
    Index size, dim;
    double* distance;
    Index* index;
};

// Points (count, dim), sorted at the first of several searches, whose reaches are about the same.
//
// Each target competes for the points in the cells around it, one after the other: there are far fewer targets than points, and
// the points of a cell lie one behind the other in memory.
class NearestOfPoints {
public:
    NearestOfPoints(const double* points, Index count, Index dim) : points(points), count(count), dim_(dim) {}

    // Fill in the distance and the index of the target nearest to each point that has one within `reach`; without `limited` those
    // of the other points, too.
    void find(const NearestSearch& search, double reach, bool limited);

    const double* const points;
    const Index count;

private:
    const Index dim_;
    std::optional<Cells> cells_;
};

inline void find_nearest(const NearestSearch& search, const double* points, Index count, double reach, bool limited) {
    NearestOfPoints(points, count, search.dim).find(search, reach, limited);
}
