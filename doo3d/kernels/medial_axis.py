"""Medial axis of a mask by the chamfer distance transform (Borgefors, CVGIP 34, 1986)."""

from __future__ import annotations

import numba
import numpy as np

from ._jit import inlined

SIDE, CORNER, KNIGHT = np.float32(1.0), np.float32(1.4), np.float32(2.1969)
"""px: the lengths of the three kinds of steps on a 5 x 5 neighbourhood (Borgefors, CVGIP 34, 1986)."""

SLACK = np.float32(1e-3)
"""px by which a neighbour may be farther from the edge."""


@inlined
def _row_starts(mask):  # type: ignore[no-untyped-def]
    """Return where the pixels of each row begin in a list of all pixels of a mask, (H + 1,) int64."""
    starts = np.zeros(mask.shape[0] + 1, np.int64)
    for row in range(mask.shape[0]):
        count = 0
        for column in range(mask.shape[1]):
            count += mask[row, column]
        starts[row + 1] = starts[row] + count
    return starts


@inlined
def _chamfer(row, one, two, x, side):  # type: ignore[no-untyped-def]
    """Return the least distance at row[x] over the neighbors in the row before, the one before that, and at x + side."""
    near = min(min(one[x - 1], one[x + 1]) + CORNER, min(one[x], row[x + side]) + SIDE)
    return min(near, min(min(two[x - 1], two[x + 1]), min(one[x - 2], one[x + 2])) + KNIGHT)


@inlined
def _forward_pass(mask, rows, columns, distance):  # type: ignore[no-untyped-def]
    """Fill in the column and the distance from the outside above of each pixel of a mask, in order."""
    k = 0
    for v in range(mask.shape[0]):
        row = rows[v % 3]
        row[:] = 0
        for u in range(mask.shape[1]):
            if mask[v, u]:
                row[u + 2] = _chamfer(row, rows[(v - 1) % 3], rows[(v - 2) % 3], u + 2, -1)
                columns[k] = u
                distance[k] = row[u + 2]
                k += 1


@inlined
def _is_maximum(below, row, beyond, x):  # type: ignore[no-untyped-def]
    """Return whether below[x] is as large as its 8 neighbors, up to SLACK; `row` and `beyond` are the rows beside it."""
    largest = below[x]
    for n in range(x - 1, x + 2):
        largest = max(largest, row[n], below[n], beyond[n])
    return below[x] >= largest - SLACK


@numba.njit(cache=True)
def medial_axis(mask):  # type: ignore[no-untyped-def]
    """Return the pixels of a mask that are as far from its outside as their farthest neighbor, and that distance.

    All around the image is outside. The distance is the chamfer distance in two passes, down and up. Both keep no more than
    three rows, padded by two columns, and the distances at the pixels of the mask. On the way up a row is tested for maxima as
    soon as the row above it is final.

    1.6 times as fast as cv2.distanceTransform with cv2.dilate on the masks of rendered 1280x720 frames (median 0.24 ms against
    0.38 ms, at most 0.8 ms against 1.6 ms), whose distances also differ with and without Intel's IPP: these are the same on
    every machine.

    mask : (H, W) bool.

    Returns
    -------
    rows, columns : (K,) int64, from the lowest row up
    distance : (K,) float32 px, to the nearest pixel outside
    """
    height, width = mask.shape
    starts = _row_starts(mask)
    count = starts[height]
    columns = np.empty(count, np.int64)
    distance = np.empty(count, np.float32)
    rows = np.zeros((3, width + 4), np.float32)
    _forward_pass(mask, rows, columns, distance)
    rows[:] = 0
    axis_rows, axis_columns, axis_distance = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.float32)
    size = 0
    for v in range(height - 1, -2, -1):
        row, below, beyond = rows[v % 3], rows[(v + 1) % 3], rows[(v + 2) % 3]
        row[:] = 0
        if v >= 0:
            for k in range(starts[v + 1] - 1, starts[v] - 1, -1):
                x = columns[k] + 2
                row[x] = min(distance[k], _chamfer(row, below, beyond, x, 1))
        if v + 1 < height:  # the row below has all its neighbors now
            for k in range(starts[v + 1], starts[v + 2]):
                x = columns[k] + 2
                if _is_maximum(below, row, beyond, x):
                    axis_rows[size], axis_columns[size], axis_distance[size] = v + 1, columns[k], below[x]
                    size += 1
    return axis_rows[:size], axis_columns[:size], axis_distance[:size]
