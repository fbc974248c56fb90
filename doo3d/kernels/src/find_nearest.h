// The nearest target of each of many points that lie near them.
#pragma once

#include "cells.h"

// Points (N, D) and the targets (S, D) of which the nearest to each is looked for; where distance and index are filled in.
struct NearestSearch {
    const double* targets;
    Index size, dim;
    double* distance;
    Index* index;
};

// Fill in the nearest target of each point that has one within `reach`; return the rows of the others that are finite.
//
// Each target competes for the points in the cells around it, one after the other: there are far fewer targets than points, and
// the points of a cell lie one behind the other in memory.
inline std::vector<Index> find_within(const NearestSearch& search, const double* points, const std::vector<Index>& rows, double reach) {
    Cells cells(points, Index(rows.size()), search.dim, reach / CELLS_PER_REACH, 4.0);  // strands far apart leave most cells empty
    for (Index s = 0; s < search.size && cells.size > 0; ++s) cells.offer(search.targets + s * search.dim, s, reach);
    std::vector<Index> others;
    for (Index k = 0; k < cells.size; ++k) {
        const Index n = rows[cells.order[k]];
        if (cells.square[k] <= reach * reach) {
            search.distance[n] = std::sqrt(cells.square[k]);
            search.index[n] = cells.owner[k];
        } else {
            others.push_back(n);
        }
    }
    return others;
}

// Fill in the distance and the index of the target nearest to each point.
//
// A target within half the reach is the nearest of all, if there is one; where there are more points than targets, few points are
// left for the search in the whole reach, which takes four times as long. Those without a target there are compared with all
// targets, unless the search is limited.
inline void find_nearest(const NearestSearch& search, const double* points, Index count, double reach, bool limited) {
    if (search.size == 0 || count == 0) return;
    const Index dim = search.dim;
    std::vector<Index> rows(count);
    for (Index n = 0; n < count; ++n) rows[n] = n;
    if (count > search.size) rows = find_within(search, points, rows, reach / 2);
    if (rows.empty()) return;
    std::sort(rows.begin(), rows.end());
    std::vector<double> left;
    for (const Index n : rows) left.insert(left.end(), points + n * dim, points + (n + 1) * dim);
    rows = find_within(search, left.data(), rows, reach);
    for (std::size_t k = 0; k < rows.size() && !limited; ++k) {
        const Index n = rows[k];
        count_visits(search.size);
        double best = INFINITY;
        for (Index s = 0; s < search.size; ++s) {
            const double between = squared_distance(points + n * dim, search.targets + s * dim, dim);
            if (between < best) {
                best = between;
                search.index[n] = s;
            }
        }
        search.distance[n] = std::sqrt(best);
    }
}
