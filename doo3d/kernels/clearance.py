"""Clearance of a path from other paths."""

from __future__ import annotations

import math

import numba
import numpy as np


@numba.njit(cache=True)
def first_clear(points, others, clearance):  # type: ignore[no-untyped-def]
    """Return the index of the first point that is farther than `clearance` from all others; the last index if none is.

    Parameters
    ----------
    points
        (P, D) float64
    others
        (N, D) float64; none: the first point is clear
    clearance
        in the unit of the points

    Returns
    -------
    int, 0 to P - 1
    """
    for i in range(points.shape[0]):
        least = np.inf
        for j in range(others.shape[0]):
            square = 0.0
            for d in range(points.shape[1]):
                square += (points[i, d] - others[j, d]) ** 2
            least = min(least, square)
        if math.sqrt(least) > clearance:
            return i
    return points.shape[0] - 1
