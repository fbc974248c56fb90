// Clearance of paths that leave one place from each other.
#pragma once

#include "arrays.h"

// Return, for each of L lines that leave one place, the index of its first point that is clear of all other lines; that of the last
// point looked through if none is. L >= 1, every line has points.
//
// A point is clear if it is farther than `clearance` from the first points of every other line, as many as are looked through of its own
// line, `counts`; `limits` are the numbers of points of each line that others are compared with at most. The time grows in proportion to
// the points, unless many of them lie within `clearance` of each other.
std::vector<Index> first_clear(const std::vector<double>& points, Index dim, const std::vector<Index>& bounds,
                               const std::vector<Index>& counts, const std::vector<Index>& limits, double clearance);
