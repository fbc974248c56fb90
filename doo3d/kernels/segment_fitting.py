"""Chains of segments along ordered points: the paper's Algorithm 2 (Keipour et al.)."""

from __future__ import annotations

import math

import numba
import numpy as np

from ._jit import helper


@helper
def _distance(a, b):  # type: ignore[no-untyped-def]
    total = 0.0
    for d in range(a.size):
        total += (a[d] - b[d]) ** 2
    return math.sqrt(total)


@helper
def _cosine(a, b, c, d):  # type: ignore[no-untyped-def]
    """Return the cosine of the angle between a -> b and c -> d."""
    dot = 0.0
    for k in range(a.size):
        dot += (b[k] - a[k]) * (d[k] - c[k])
    return dot / (_distance(a, b) * _distance(c, d))


@numba.njit(cache=True)
def traverse_contour(points, length, min_cosine):  # type: ignore[no-untyped-def]
    """Lay chains of segments of equal length along points; a sharp turn ends a chain.

    The names are the paper's: p_s start of the current segment, p_c point being traversed, p_e its end, p_t the
    tip: the farthest point from p_s so far, from which a new chain starts after a sharp turn.

    Parameters
    ----------
    points
        (P, D) float64, P >= 1, no two in a row farther apart than `length`
    length
        of a segment, in the unit of the points
    min_cosine
        of the turn between two segments of a chain; a turn with a smaller cosine ends the chain

    Returns
    -------
    joints : (J, D) float64, of all chains one after the other
    bounds : (C + 1,) int64, where each chain begins in `joints`
    """
    count, dim = points.shape
    joints = np.empty((2 * count, dim))  # at most a start and an end for every point
    bounds = np.zeros(count + 1, np.int64)
    size, chains = 0, 0
    p_s, p_t, p_e = points[0].copy(), points[0].copy(), np.empty(dim)
    update_tip = True
    for i in range(count):
        p_c = points[i]
        distance = _distance(p_c, p_s)
        if distance >= length:
            for d in range(dim):
                p_e[d] = p_s[d] + (p_c[d] - p_s[d]) * length / distance
            first = size == bounds[chains]
            if first or _cosine(joints[size - 2], joints[size - 1], p_s, p_e) >= min_cosine:
                if first:
                    joints[size] = p_s
                    size += 1
                joints[size] = p_e
                size += 1
                p_s[:] = p_e
                p_t[:] = p_e
            else:
                chains += 1
                bounds[chains] = size
                p_s[:] = p_t
            update_tip = True
        elif distance >= _distance(p_t, p_s):
            if update_tip:
                p_t[:] = p_c
        else:
            update_tip = False
    if size > bounds[chains]:
        chains += 1
        bounds[chains] = size
    return joints[:size], bounds[: chains + 1]
