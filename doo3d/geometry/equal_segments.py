"""Equal segments along a curve, from end to end."""

from __future__ import annotations

import numpy as np

from ..kernels import cover_with_chords, lay_equal_chords
from ..types import Floats
from .polyline import arc_length, resample, steps, unit

MAX_ITERATIONS = 50
"""Iterations of Newton's method at most; a handful is usual."""

MAX_SAMPLES_PER_CHORD = 100
"""Points of a curve per chord up to which bends are taken from points side by side."""


def extrapolated(axis: Floats, shift: float) -> Floats:
    """Return a polyline lengthened or shortened at its last point.

    Parameters
    ----------
    axis
        (P, D), P >= 2 points.
    shift
        length in the unit of the points: positive adds a point straight ahead of the last one, negative cuts the polyline. The
        first segment always stays.

    Returns
    -------
    (Q, D), Q points; a lengthened polyline has one more than the given one.
    """
    if shift >= 0:
        return np.concatenate((axis, [axis[-1] + shift * unit(axis[-1] - axis[-2])]))
    along = arc_length(axis)
    end = max(along[-1] + shift, along[1])
    return np.concatenate((axis[along < end], resample(axis, np.array([end]))))


def sagitta_compensated(points: Floats, length: float) -> Floats:
    """Return a curve moved outwards at its bends, so that chords laid on it lie about the given curve.

    Chords laid on the given curve itself would lie inside its bends.

    Parameters
    ----------
    points
        (P, D), P >= 2 evenly spaced points.
    length
        length of the chords, in the unit of the points.

    Returns
    -------
    (P, D): each point is moved away from the center of its bend, of radius R, by length^2 / 12R, at most length / 24. The ends
    stay.

    Notes
    -----
    length^2 / 12R is the mean distance of a chord from its arc, two thirds of the sagitta length^2 / 8R. Where the points
    are over a hundred times as dense as chords, the bend is taken from points a quarter of a chord apart, since their noise would
    be multiplied by the square of that ratio.
    """
    spacing = float(np.median(steps(points)))
    apart = 1 if length <= MAX_SAMPLES_PER_CHORD * spacing else min(round(length / spacing / 4), (len(points) - 1) // 2)
    bend = np.zeros_like(points)
    bend[apart:-apart] = (points[2 * apart :] - 2 * points[apart:-apart] + points[: -2 * apart]) / (apart * spacing) ** 2
    bend[:apart], bend[-apart:] = bend[apart], bend[-apart - 1]
    bend[[0, -1]] = 0
    curvature = np.linalg.norm(bend, axis=1, keepdims=True)
    return np.asarray(points - length**2 / 12 * bend / np.maximum(1.0, 2 * length * curvature))


def equal_segments(points: Floats, length: float) -> Floats:
    """Return the joints of a chain of segments of exactly `length` along a polyline from end to end.

    The whole number of segments that fits best is used. The chain is longer or shorter than the polyline by the same length at
    both ends; where it is longer, it continues straight.

    Parameters
    ----------
    points
        (P, D), P >= 2 points of the polyline.
    length
        length of a segment, in the unit of the points.

    Returns
    -------
    (N + 1, D), joints of N segments, in the unit of the points; (0, D) for a polyline shorter than half a segment.
    """
    total = float(arc_length(points)[-1])
    if total < length / 2:
        return points[:0]
    # an end that is repeated has no direction to continue in
    moved = np.flatnonzero(steps(points) > 0)
    points = points[moved[0] : moved[-1] + 2]
    before, after = points[0] - length * unit(points[1] - points[0]), points[-1] + length * unit(points[-1] - points[-2])
    return np.asarray(cover_with_chords(np.concatenate(([before], points, [after])), length))


def equal_ring(points: Floats, length: float) -> Floats:
    """Return the joints of a closed chain of segments of exactly `length` around a closed polyline.

    The whole number of segments that fits best is used, so the perimeter changes by half a segment at most.

    Parameters
    ----------
    points
        (P, D), P points of the polyline; the first point is not repeated at the end.
    length
        length of a segment, in the unit of the points.

    Returns
    -------
    (N + 1, D), joints of N >= 3 segments, the last joint equal to the first, in the unit of the points; (0, D) if fewer than
    three segments fit.

    Notes
    -----
    Equal chords are laid around the polyline, the ring is scaled about its centroid until they have the exact length, and
    Newton's method removes the rest of the misfit.
    """
    loop = np.concatenate((points, points[:1]))
    joints = lay_equal_chords(loop, length)[0]
    count = len(joints) - 1 + round(float(np.linalg.norm(loop[-1] - joints[-1])) / length)
    if count < 3:
        return points[:0]
    low, high = 0.5 * length, 1.5 * length
    for _ in range(60):
        chord = (low + high) / 2
        joints, _ = lay_equal_chords(loop, chord)
        low, high = (chord, high) if len(joints) - 1 >= count else (low, chord)
    joints = lay_equal_chords(loop, low)[0][:count]
    centroid = joints.mean(axis=0)
    joints = _close_ring(centroid + (joints - centroid) * (length / low), length)
    return np.concatenate((joints, joints[:1]))


def _close_ring(joints: Floats, length: float) -> Floats:
    """Move the joints (N, D) of a ring by the least that makes all of its N segments exactly `length` long.

    Newton's method on (|d|^2 - length^2) / 2 = 0 for each segment d: the last of the chords around a rough polyline may end short
    of the ring's first joint, or beside it.
    """
    for _ in range(MAX_ITERATIONS):
        d = np.roll(joints, -1, axis=0) - joints
        error = (np.einsum("ij,ij->i", d, d) - length**2) / 2
        if np.abs(error).max() < 1e-12 * length**2:
            break
        following = np.roll(np.arange(len(d)), -1)
        normal = np.diag(2 * np.einsum("ij,ij->i", d, d) + 1e-12 * length**2)
        shared = np.einsum("ij,ij->i", d, d[following])
        normal[np.arange(len(d)), following] -= shared
        normal[following, np.arange(len(d))] -= shared
        share = np.linalg.solve(normal, error)[:, None] * d
        joints = joints + share - np.roll(share, 1, axis=0)
    return joints
