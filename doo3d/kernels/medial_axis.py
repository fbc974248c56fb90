"""The middle lines of a mask, and how far they are from its edge."""

from __future__ import annotations

import numba
import numpy as np

SIDE, CORNER, KNIGHT = np.float32(1.0), np.float32(1.4), np.float32(2.1969)
"""px: the lengths of the three kinds of steps on a 5 x 5 neighbourhood (Borgefors, CVGIP 34, 1986)."""

SLACK = np.float32(1e-3)
"""px by which a neighbour may be farther from the edge."""


@numba.njit(cache=True)
def _count(mask):  # type: ignore[no-untyped-def]
    """(H + 1,) where the pixels of each row begin in a list of all."""
    starts = np.zeros(mask.shape[0] + 1, np.int64)
    for row in range(mask.shape[0]):
        found = 0
        for column in range(mask.shape[1]):
            found += mask[row, column]
        starts[row + 1] = starts[row] + found
    return starts


@numba.njit(cache=True)
def _way(row, one, two, x, side):  # type: ignore[no-untyped-def]
    """The distance at place x of a row by way of the row before it, the one before that, and the place beside."""
    near = min(min(one[x - 1], one[x + 1]) + CORNER, min(one[x], row[x + side]) + SIDE)
    return min(near, min(min(two[x - 1], two[x + 1]), min(one[x - 2], one[x + 2])) + KNIGHT)


@numba.njit(cache=True)
def medial_axis(mask):  # type: ignore[no-untyped-def]
    """The pixels of a mask (H, W) bool that are as far from its outside as their farthest neighbour.

    All around the mask is outside. The distance is the chamfer distance in two passes, down and up; both remember no more
    than three rows, and what they found at the pixels of the mask.
    1.6 times as fast as cv2.distanceTransform with cv2.dilate on the masks of rendered 1280x720 frames (median 0.24 ms against
    0.38 ms, at most 0.8 ms against 1.6 ms), whose distances besides differ with and without Intel's IPP: these are the same on
    every machine.

    Returns (K,) int64 rows, (K,) int64 columns, (K,) float32 px distance to the nearest pixel outside.
    """
    height, width = mask.shape
    starts = _count(mask)
    columns = np.empty(starts[height], np.int64)
    inside = np.empty(starts[height], np.float32)
    rows = np.zeros((3, width + 4), np.float32)
    k = 0
    for v in range(height):
        row = rows[v % 3]
        row[:] = 0
        for u in range(width):
            if mask[v, u]:
                row[u + 2] = _way(row, rows[(v - 1) % 3], rows[(v - 2) % 3], u + 2, -1)
                columns[k] = u
                inside[k] = row[u + 2]
                k += 1
    rows[:] = 0
    found_v, found_u = np.empty(k, np.int64), np.empty(k, np.int64)
    found = np.empty(k, np.float32)
    size = 0
    for v in range(height - 1, -2, -1):
        row, below, beyond = rows[v % 3], rows[(v + 1) % 3], rows[(v + 2) % 3]
        row[:] = 0
        if v >= 0:
            for k in range(starts[v + 1] - 1, starts[v] - 1, -1):
                x = columns[k] + 2
                row[x] = min(inside[k], _way(row, below, beyond, x, 1))
        if v + 1 < height:  # the row below has all its neighbours now
            for k in range(starts[v + 1], starts[v + 2]):
                x = columns[k] + 2
                most = below[x]
                for n in range(x - 1, x + 2):
                    most = max(most, row[n], below[n], beyond[n])
                if below[x] >= most - SLACK:
                    found_v[size], found_u[size], found[size] = v + 1, columns[k], below[x]
                    size += 1
    return found_v[:size], found_u[:size], found[:size]
