"""Nearest targets of many points that lie near them, and sums over the points of each target."""

from __future__ import annotations

import numba
import numpy as np

from ._jit import helper, inlined

MAX_GROUP = 16
"""Points in a row that may share one set of candidate targets."""


@inlined
def _square(p, q):  # type: ignore[no-untyped-def]
    """Return the squared distance between two points (3,)."""
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@helper
def _fit_cells(targets, reach):  # type: ignore[no-untyped-def]
    """Choose a box of cells about the targets: its lower corner (3,), its shape (3,), and the edge of a cell.

    The edge is `reach`, doubled until the number of cells is in proportion to the number of targets.
    """
    low, shape, edge = np.zeros(3), np.ones(3, np.int64), reach
    for d in range(targets.shape[1]):
        low[d] = targets[:, d].min()
    while True:
        for d in range(targets.shape[1]):
            shape[d] = np.int64((targets[:, d].max() - low[d]) / edge) + 1
        if np.float64(shape[0]) * shape[1] * shape[2] <= 64.0 * targets.shape[0] + 4096.0:
            return low, shape, edge
        edge *= 2


@helper
def _sort_into_cells(targets, low, shape, edge):  # type: ignore[no-untyped-def]
    """Sort the targets (S, D) by their cells.

    Returns the index of each sorted target (S,), its position (S, 3), 0 along axes beyond D, and where each cell begins among
    them.
    """
    size, dim = targets.shape
    cell, start = np.zeros(size, np.int64), np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    for s in range(size):
        for d in range(dim):
            cell[s] = cell[s] * shape[d] + np.int64((targets[s, d] - low[d]) / edge)
        start[cell[s] + 1] += 1
    start = np.cumsum(start)
    order, positions, filled = np.empty(size, np.int64), np.zeros((size, 3)), start[:-1].copy()
    for s in range(size):
        k = filled[cell[s]]
        order[k] = s
        positions[k, :dim] = targets[s]
        filled[cell[s]] += 1
    return order, positions, start


@inlined
def _group_end(points, n, slack, p):  # type: ignore[no-untyped-def]
    """Return the end of the run of points from n on that lie within `slack` of p, which is point n."""
    end = n + 1
    while end < min(points.shape[0], n + MAX_GROUP):
        square = 0.0
        for d in range(points.shape[1]):
            square += (p[d] - points[end, d]) ** 2
        if square > slack * slack:
            break
        end += 1
    return end


@inlined
def _cells_within(p, margin, low, shape, edge, dim, first, last):  # type: ignore[no-untyped-def]
    """Fill in the first cell, and the one after the last, within `margin` of p along each of the `dim` axes."""
    for d in range(dim):
        first[d] = np.int64(min(max(np.floor((p[d] - margin - low[d]) / edge), 0.0), float(shape[d])))
        last[d] = np.int64(min(max(np.floor((p[d] + margin - low[d]) / edge) + 1, 0.0), float(shape[d])))


@inlined
def _collect(p, targets, start, shape, first, last, candidates, squares):  # type: ignore[no-untyped-def]
    """Fill in the targets of a box of cells and their squared distances from p; return their number and the least distance."""
    size, best = 0, np.inf
    for a in range(first[0], last[0]):
        for b in range(first[1], last[1]):
            row = (a * shape[1] + b) * shape[2]
            for k in range(start[row + first[2]], start[max(row + first[2], row + last[2])]):
                candidates[size] = k
                squares[size] = _square(p, targets[k])
                best = min(best, squares[size])
                size += 1
    return size, np.sqrt(best)


@inlined
def _keep_within(limit, candidates, squares, size):  # type: ignore[no-untyped-def]
    """Keep the candidates whose squared distance is at most `limit`; return how many there are."""
    kept = 0
    for k in range(size):
        if squares[k] <= limit:
            candidates[kept] = candidates[k]
            kept += 1
    return kept


@inlined
def _nearest_candidate(p, targets, order, candidates, size):  # type: ignore[no-untyped-def]
    """Return the least squared distance of p from the first `size` candidates, and whose it is; of several equal ones the first.

    targets, order : the sorted targets (S, 3) and their indices (S,). candidates : indices into those.
    """
    best, owner = np.inf, 0
    for c in range(size):
        k = candidates[c]
        square = _square(p, targets[k])
        if square < best or (square == best and order[k] < owner):
            best, owner = square, order[k]
    return best, owner


@helper
def _nearest_of_all(p, targets, order):  # type: ignore[no-untyped-def]
    """Return the least squared distance of p from the sorted targets, and whose it is; of several equal ones the first."""
    best, owner = np.inf, 0
    for k in range(order.size):
        square = _square(p, targets[k])
        if square < best or (square == best and order[k] < owner):
            best, owner = square, order[k]
    return best, owner


@numba.njit(cache=True)
def nearest(points, targets, reach, limited):  # type: ignore[no-untyped-def]
    """Find the nearest target of each point; of several equally near the first.

    The targets are sorted into cells of edge `reach`. Points that follow each other in the list are often neighbors, as the
    pixels of a mask are, so up to MAX_GROUP of them that lie within reach / 5 of the first share its candidates: the targets in
    the cells around it, without those too far from the first to be the nearest of any (its nearest plus twice the slack). A
    point without a target within reach is compared with all targets, unless the search is limited. Ten times as fast as a k-d
    tree on the pixels of masks.

    Parameters
    ----------
    points
        (N, D) float64
    targets
        (S, D) float64, in the unit of the points
    reach
        the distance within which the search is quick
    limited
        bool, whether points without a target within reach are left out

    Returns
    -------
    distance : (N,) float64; infinite where a point was left out
    index : (N,) int64, of the nearest target; 0 where a point was left out
    """
    count, size, dim = points.shape[0], targets.shape[0], points.shape[1]
    distance, index = np.full(count, np.inf), np.zeros(count, np.int64)
    if size == 0 or count == 0:
        return distance, index
    low, shape, edge = _fit_cells(targets, reach)
    order, positions, start = _sort_into_cells(targets, low, shape, edge)
    candidates, squares = np.empty(size, np.int64), np.empty(size)
    first, last, p = np.zeros(3, np.int64), np.ones(3, np.int64), np.zeros(3)
    slack, n = reach / 5, 0
    while n < count:
        p[:dim] = points[n]
        end = _group_end(points, n, slack, p)
        shared = slack if end > n + 1 else 0.0
        _cells_within(p, reach + shared, low, shape, edge, dim, first, last)
        some, least = _collect(p, positions, start, shape, first, last, candidates, squares)
        if least <= reach:
            some = _keep_within((least + 2 * shared) ** 2 * (1 + 1e-9), candidates, squares, some)
        for i in range(n, end):
            p[:dim] = points[i]
            square, owner = _nearest_candidate(p, positions, order, candidates, some)
            if square > reach * reach:
                if limited:
                    continue
                square, owner = _nearest_of_all(p, positions, order)
            distance[i], index[i] = np.sqrt(square), owner
        n = end
    return distance, index


@numba.njit(cache=True)
def lateral_sums(points, distance, index, samples, normals, reach):  # type: ignore[no-untyped-def]
    """Count the points of each sample and sum their lateral offsets.

    Parameters
    ----------
    points
        (N, 2) float64
    distance, index
        (N,) float64 and (N,) int64, of each point's nearest sample, as `nearest` returns them
    samples, normals
        (S, 2) float64, the samples, and the unit normal to the path at each
    reach
        (S,) float64, the distance from which a point does not count for its sample

    Returns
    -------
    count, total : (S,) float64 each; the offsets are signed along the normals
    """
    count, total = np.zeros(samples.shape[0]), np.zeros(samples.shape[0])
    for n in range(points.shape[0]):
        s = index[n]
        if distance[n] < reach[s]:
            count[s] += 1
            total[s] += (points[n, 0] - samples[s, 0]) * normals[s, 0] + (points[n, 1] - samples[s, 1]) * normals[s, 1]
    return count, total


@numba.njit(cache=True)
def points_near_line(points, origin, direction, half_edge, max_offset):  # type: ignore[no-untyped-def]
    """Select the points about an origin that lie near a line through it.

    Parameters
    ----------
    points
        (N, D) float64
    origin, direction
        (D,) float64, a point of the line, and its unit direction
    half_edge
        half the edge of the box about the origin in which points are taken
    max_offset
        the distance from the line below which points are taken

    Returns
    -------
    kept : (K, D) float64, those points
    along : (K,) float64, their positions along the line, 0 at the origin
    offset : (K,) float64, their distances from the line
    """
    dim = points.shape[1]
    kept, along, offsets = np.empty_like(points), np.empty(points.shape[0]), np.empty(points.shape[0])
    size = 0
    for n in range(points.shape[0]):
        inside, ahead, square = True, 0.0, 0.0
        for d in range(dim):
            step = points[n, d] - origin[d]
            inside = inside and abs(step) < half_edge
            ahead += step * direction[d]
        if not inside:
            continue
        for d in range(dim):
            square += (points[n, d] - origin[d] - ahead * direction[d]) ** 2
        if square < max_offset * max_offset:
            kept[size] = points[n]
            along[size], offsets[size] = ahead, np.sqrt(square)
            size += 1
    return kept[:size], along[:size], offsets[:size]
