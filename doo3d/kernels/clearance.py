"""Where a line leaves the others behind."""

from __future__ import annotations

import math

import numba
import numpy as np


@numba.njit(cache=True)
def first_clear(points, others, distance):  # type: ignore[no-untyped-def]
    """The first of the points (P, D) float64 that is farther than `distance` from all others (Q, D); the last if none is."""
    for i in range(points.shape[0]):
        nearest = np.inf
        for j in range(others.shape[0]):
            squared = 0.0
            for d in range(points.shape[1]):
                squared += (points[i, d] - others[j, d]) ** 2
            nearest = min(nearest, squared)
        if math.sqrt(nearest) > distance:
            return i
    return points.shape[0] - 1
