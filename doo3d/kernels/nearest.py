"""The nearest of places that lie along lines, for many points that lie near them."""

from __future__ import annotations

import numba
import numpy as np

GROUP = 16
"""Points that may share the places to be asked."""


@numba.njit(cache=True)
def nearest(points, places, reach, limited):  # type: ignore[no-untyped-def]
    """The nearest place to each point, and how far it is; of several the first.

    The places are sorted into cells of edge `reach`, and those near a point serve the points after it that are close to it, too:
    ten times as fast as a tree when points that follow each other are neighbours, as the pixels of a mask are.

    points : (N, D) float64. places : (S, D) float64. reach : same unit; within it the search is quick. limited : bool, whether
    to leave out points that have no place within reach: their distance is infinite and their place 0.
    Returns (N,) float64 and (N,) int64.
    """
    count, size, dim = points.shape[0], places.shape[0], places.shape[1]
    distance, found = np.full(count, np.inf), np.zeros(count, np.int64)
    if size == 0 or count == 0:
        return distance, found
    order, sorted_places, start, low, shape, edge = _in_cells(places, reach)
    first, last, slack, p, q = np.zeros(3, np.int64), np.ones(3, np.int64), reach / 5, np.zeros(3), np.zeros(3)
    asked, away, n = np.empty(size, np.int64), np.empty(size), 0
    while n < count:
        p[:dim] = points[n]
        group = n + 1
        while group < min(count, n + GROUP):
            q[:dim] = points[group]
            if (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2 > slack * slack:
                break
            group += 1
        for d in range(dim):
            margin = reach + (slack if group > n + 1 else 0.0)
            first[d] = np.int64(min(max(np.floor((p[d] - margin - low[d]) / edge), 0.0), float(shape[d])))
            last[d] = np.int64(min(max(np.floor((p[d] + margin - low[d]) / edge) + 1, 0.0), float(shape[d])))
        some, best = 0, np.inf
        for a in range(first[0], last[0]):
            for b in range(first[1], last[1]):
                row = (a * shape[1] + b) * shape[2]
                for k in range(start[row + first[2]], start[max(row + first[2], row + last[2])]):
                    asked[some], s = k, sorted_places[k]
                    away[some] = (p[0] - s[0]) ** 2 + (p[1] - s[1]) ** 2 + (p[2] - s[2]) ** 2
                    best = min(best, away[some])
                    some += 1
        if np.sqrt(best) <= reach:
            most, kept = (np.sqrt(best) + 2 * slack * (group > n + 1)) ** 2 * (1 + 1e-9), 0
            for k in range(some):
                if away[k] <= most:
                    asked[kept] = asked[k]
                    kept += 1
            some = kept
        while n < group:
            p[:dim] = points[n]
            best, owner = np.inf, 0
            for k in range(some):
                s = sorted_places[asked[k]]
                square = (p[0] - s[0]) ** 2 + (p[1] - s[1]) ** 2 + (p[2] - s[2]) ** 2
                if square < best or (square == best and order[asked[k]] < owner):
                    best, owner = square, order[asked[k]]
            if best > reach * reach and not limited:
                for k in range(size):
                    s = sorted_places[k]
                    square = (p[0] - s[0]) ** 2 + (p[1] - s[1]) ** 2 + (p[2] - s[2]) ** 2
                    if square < best or (square == best and order[k] < owner):
                        best, owner = square, order[k]
            if best <= reach * reach or not limited:
                distance[n], found[n] = np.sqrt(best), owner
            n += 1
    return distance, found


@numba.njit(cache=True)
def lateral_sums(points, distance, near, places, across, reach):  # type: ignore[no-untyped-def]
    """How many points belong to each place, and the sum of how far aside of it they lie: (S,) float64 and (S,) float64.

    points : (N, 2) float64, their `distance` and `near` from `nearest`. places, across : (S, 2), and the direction across there.
    reach : (S,), points farther from their place do not belong to it.
    """
    count, total = np.zeros(places.shape[0]), np.zeros(places.shape[0])
    for n in range(points.shape[0]):
        s = near[n]
        if distance[n] < reach[s]:
            count[s] += 1
            total[s] += (points[n, 0] - places[s, 0]) * across[s, 0] + (points[n, 1] - places[s, 1]) * across[s, 1]
    return count, total


@numba.njit(cache=True)
def _in_cells(places, reach):  # type: ignore[no-untyped-def]
    """The places (S, D) in the order of their cells: (S,) int64 which each is, and (S, 3) where, 0 for what D has not.

    And where in that order each cell begins, the lower corner of all cells (3,), how many there are each way (3,), their edge.
    """
    size, dim = places.shape
    low, shape, edge = np.zeros(3), np.ones(3, np.int64), reach
    for d in range(dim):
        low[d] = places[:, d].min()
    while True:
        for d in range(dim):
            shape[d] = np.int64((places[:, d].max() - low[d]) / edge) + 1
        if np.float64(shape[0]) * shape[1] * shape[2] <= 64.0 * size + 4096.0:
            break
        edge *= 2
    cell, start = np.zeros(size, np.int64), np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    for s in range(size):
        for d in range(dim):
            cell[s] = cell[s] * shape[d] + np.int64((places[s, d] - low[d]) / edge)
        start[cell[s] + 1] += 1
    start = np.cumsum(start)
    order, placed, filled = np.empty(size, np.int64), np.zeros((size, 3)), start[:-1].copy()
    for s in range(size):
        at = filled[cell[s]]
        order[at] = s
        placed[at, :dim] = places[s]
        filled[cell[s]] += 1
    return order, placed, start, low, shape, edge


@numba.njit(cache=True)
def points_near_line(points, tip, heading, reach, width):  # type: ignore[no-untyped-def]
    """The points in a box of half edge `reach` about a place that lie within `width` of a line through it.

    points : (N, D) float64. tip, heading : (D,) the place, and the line's unit direction.
    Returns those points (M, D), how far along the line from the place each lies (M,), and how far from the line (M,).
    """
    dim = points.shape[1]
    kept, along, aside = np.empty_like(points), np.empty(points.shape[0]), np.empty(points.shape[0])
    size = 0
    for n in range(points.shape[0]):
        inside, ahead, square = True, 0.0, 0.0
        for d in range(dim):
            offset = points[n, d] - tip[d]
            inside = inside and abs(offset) < reach
            ahead += offset * heading[d]
        if not inside:
            continue
        for d in range(dim):
            square += (points[n, d] - tip[d] - ahead * heading[d]) ** 2
        if square < width * width:
            kept[size] = points[n]
            along[size], aside[size] = ahead, np.sqrt(square)
            size += 1
    return kept[:size], along[:size], aside[:size]
