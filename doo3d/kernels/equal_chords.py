"""Equal steps along a curve."""

from __future__ import annotations

import math

import numba
import numpy as np


@numba.njit(cache=True)
def _distance(a, b):  # type: ignore[no-untyped-def]
    total = 0.0
    for d in range(a.shape[0]):
        total += (a[d] - b[d]) ** 2
    return math.sqrt(total)


@numba.njit(cache=True)
def lay_equal_chords(points, length):  # type: ignore[no-untyped-def]
    """Lay chords of exactly `length` along a polyline, the first from its first point.

    A chord ends where the polyline first leaves the sphere of that radius about its start, and is put on it exactly.
    points : (P, D) float64. Returns (N + 1, D) joints, and (N + 1,) the arc length at which each lies.
    """
    count, dim = points.shape
    total = 0.0
    for i in range(1, count):
        total += _distance(points[i], points[i - 1])
    joints = np.empty((int(total / length) + 2, dim))
    at = np.zeros(joints.shape[0])
    joints[0] = points[0]
    size, i = 1, 1
    before = 0.0  # arc length of the vertex before points[i]
    here = points[0].copy()
    while i < count:
        start = joints[size - 1]
        away, along, half, inside = 0.0, 0.0, 0.0, length * length
        for d in range(dim):
            offset, step = here[d] - start[d], points[i, d] - here[d]
            away += (points[i, d] - start[d]) ** 2
            along += step * step
            half += step * offset
            inside -= offset * offset
        if math.sqrt(away) < length:
            before += _distance(points[i], points[i - 1])
            here[:] = points[i]
            i += 1
            continue
        part = min(1.0, (math.sqrt(half * half + along * max(inside, 0.0)) - half) / along)
        norm = 0.0
        for d in range(dim):
            here[d] += part * (points[i, d] - here[d])
            norm += (here[d] - start[d]) ** 2
        for d in range(dim):
            joints[size, d] = start[d] + (here[d] - start[d]) * length / math.sqrt(norm)
        here[:] = joints[size]
        at[size] = before + _distance(here, points[i - 1])
        size += 1
    return joints[:size], at[:size]


@numba.njit(cache=True)
def cover_with_chords(points, length):  # type: ignore[no-untyped-def]
    """Chords of exactly `length` along a polyline that begins and ends `length` before and behind the curve to be covered.

    The whole number of chords that fits the curve best is laid so that they are as much too long, or too short, at one end
    as at the other. points : (P, D) float64. Returns (N + 1, D) joints.
    """
    size, dim = points.shape
    along = np.zeros(size)
    for i in range(1, size):
        along[i] = along[i - 1] + _distance(points[i], points[i - 1])
    total = along[-1] - 2 * length
    joints, start, count = points[:0], length, 0
    for _ in range(4):
        edge = max(1, min(size - 1, np.searchsorted(along, start, side="right")))
        step = along[edge] - along[edge - 1]
        rest = np.empty((size - edge + 1, dim))
        rest[0] = points[edge - 1] + (points[edge] - points[edge - 1]) * ((start - along[edge - 1]) / step if step > 0 else 0.0)
        rest[1:] = points[edge:]
        joints, at = lay_equal_chords(rest, length)
        at += start - length
        if count == 0:
            last = np.searchsorted(at, total, side="right") - 1
            count = max(1, round(last + (total - at[last]) / length))
        count = min(count, joints.shape[0] - 1)
        shift = start - length - (start - length + at[count] - total) / 2
        start = length + min(max(shift, -length / 2), length / 2)
    return joints[: count + 1]
