"""Chords of one length along polylines."""

from __future__ import annotations

import math

import numba
import numpy as np

from ._jit import helper, inlined


@inlined
def _distance(a, b):  # type: ignore[no-untyped-def]
    total = 0.0
    for d in range(a.shape[0]):
        total += (a[d] - b[d]) ** 2
    return math.sqrt(total)


@inlined
def _leave_sphere(joints, j, radius, position, points, i):  # type: ignore[no-untyped-def]
    """Return whether the edge from `position` to points[i] leaves the sphere about joints[j], and the parameter t where.

    The larger root of |position + t (points[i] - position) - joints[j]|^2 = radius^2; `position` is inside.
    """
    square, step2, half, inside = 0.0, 0.0, 0.0, radius * radius
    for d in range(points.shape[1]):
        offset, step = position[d] - joints[j, d], points[i, d] - position[d]
        square += (points[i, d] - joints[j, d]) ** 2
        step2 += step * step
        half += step * offset
        inside -= offset * offset
    if math.sqrt(square) < radius:
        return False, 0.0
    return True, min(1.0, (math.sqrt(half * half + step2 * max(inside, 0.0)) - half) / step2)


@numba.njit(cache=True)
def lay_equal_chords(points, length):  # type: ignore[no-untyped-def]
    """Lay chords of exactly `length` along a polyline, the first from its first point.

    A chord ends where the polyline first leaves the sphere of radius `length` about the chord's start. The end is scaled to lie
    on the sphere exactly, so that rounding does not add up. What is left of the polyline after the last whole chord has no joint.

    Parameters
    ----------
    points
        (P, D) float64
    length
        in the unit of the points

    Returns
    -------
    joints : (J, D) float64, J >= 1
    arc_lengths : (J,) float64, the position of each joint along the polyline
    """
    count, dim = points.shape
    total = 0.0
    for i in range(1, count):
        total += _distance(points[i], points[i - 1])
    joints = np.empty((int(total / length) + 2, dim))
    arc_lengths = np.zeros(joints.shape[0])
    joints[0] = points[0]
    size, i = 1, 1
    passed = 0.0  # arc length at points[i - 1]
    position = points[0].copy()
    while i < count:
        start = joints[size - 1]
        leaves, t = _leave_sphere(joints, size - 1, length, position, points, i)
        if not leaves:
            passed += _distance(points[i], points[i - 1])
            position[:] = points[i]
            i += 1
            continue
        norm = 0.0
        for d in range(dim):
            position[d] += t * (points[i, d] - position[d])
            norm += (position[d] - start[d]) ** 2
        for d in range(dim):
            joints[size, d] = start[d] + (position[d] - start[d]) * length / math.sqrt(norm)
        position[:] = joints[size]
        arc_lengths[size] = passed + _distance(position, points[i - 1])
        size += 1
    return joints[:size], arc_lengths[:size]


@helper
def _cut_before(points, arc_lengths, start):  # type: ignore[no-untyped-def]
    """Return the polyline from the arc length `start` on."""
    count = points.shape[0]
    edge = max(1, min(count - 1, np.searchsorted(arc_lengths, start, side="right")))
    step = arc_lengths[edge] - arc_lengths[edge - 1]
    t = (start - arc_lengths[edge - 1]) / step if step > 0 else 0.0
    rest = np.empty((count - edge + 1, points.shape[1]))
    rest[0] = points[edge - 1] + (points[edge] - points[edge - 1]) * t
    rest[1:] = points[edge:]
    return rest


@numba.njit(cache=True)
def cover_with_chords(points, length):  # type: ignore[no-untyped-def]
    """Cover a curve with the whole number of chords of exactly `length` that fits best, centered on the curve.

    The chords are laid four times. The first time, from the curve's beginning, fixes their number. Each time the start is then
    moved by half of what the last joint is beyond the curve's end, or short of it, so that the excess is the same at both ends.

    points : (P, D) float64, the curve, extrapolated by `length` at both ends. Returns (J, D) float64 joints, J >= 2.
    """
    size = points.shape[0]
    arc_lengths = np.zeros(size)
    for i in range(1, size):
        arc_lengths[i] = arc_lengths[i - 1] + _distance(points[i], points[i - 1])
    total = arc_lengths[-1] - 2 * length
    joints, start, count = points[:0], length, 0
    for _ in range(4):
        joints, at = lay_equal_chords(_cut_before(points, arc_lengths, start), length)
        at += start - length
        if count == 0:
            last = np.searchsorted(at, total, side="right") - 1
            count = max(1, round(last + (total - at[last]) / length))
        count = min(count, joints.shape[0] - 1)
        shift = start - length - (start - length + at[count] - total) / 2
        start = length + min(max(shift, -length / 2), length / 2)
    return joints[: count + 1]
