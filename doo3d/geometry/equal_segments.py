"""Equal segments along a curve, from end to end."""

from __future__ import annotations

import numpy as np

from ..kernels.equal_chords import cover_with_chords, lay_equal_chords
from ..types import Floats
from .polyline import arc_length, resample, steps, unit

ROUNDS = 50
"""Steps of Newton's method at most; a handful is usual."""


def extrapolated(axis: Floats, shift: float) -> Floats:
    """The polyline (P, D) made longer by `shift` m straight on at its last point, or shorter."""
    if shift >= 0:
        return np.concatenate((axis, [axis[-1] + shift * unit(axis[-1] - axis[-2])]))
    along = arc_length(axis)
    keep = max(along[-1] + shift, along[1])
    return np.concatenate((axis[along < keep], resample(axis, np.array([keep]))))


def sagitta_compensated(points: Floats, length: float) -> Floats:
    """The curve (P, D) moved outwards by length^2 / 12 of its curvature: chords of `length` then lie about it, not inside.

    The sagitta of a chord is length^2 / 8R, two thirds of it the mean distance of the chord from the arc. Bends of less than
    two segments' radius are left as they are.
    """
    spacing = float(np.median(steps(points)))
    bend = np.zeros_like(points)
    bend[1:-1] = (points[2:] - 2 * points[1:-1] + points[:-2]) / spacing**2
    curvature = np.linalg.norm(bend, axis=1, keepdims=True)
    return np.asarray(points - length**2 / 12 * bend / np.maximum(1.0, 2 * length * curvature))


def equal_segments(points: Floats, length: float) -> Floats:
    """Joints exactly `length` apart from end to end of a polyline (P, D); what is over is shared by both ends.

    The polyline is carried straight on at its ends, and the whole number of segments that fits best is laid so that
    the chain is as much too long, or too short, at one end as at the other. Returns (N + 1, D), or (0, D) for a
    polyline of less than half a segment.
    """
    total = float(arc_length(points)[-1])
    if total < length / 2:
        return points[:0]
    before, after = points[0] - length * unit(points[1] - points[0]), points[-1] + length * unit(points[-1] - points[-2])
    return np.asarray(cover_with_chords(np.concatenate(([before], points, [after])), length))


def equal_ring(points: Floats, length: float) -> Floats:
    """A closed chain of segments of exactly `length` round a closed polyline (P, D), whose last joint is its first.

    The whole number of segments that fits best is laid as equal chords, the ring is scaled about its middle to their length,
    by at most half a segment over the whole way round, and `_closed` takes out what is over where it closes. Returns
    (N + 1, D), N >= 3, or (0, D).
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
    middle = joints.mean(axis=0)
    joints = _closed(middle + (joints - middle) * (length / low), length)
    return np.concatenate((joints, joints[:1]))


def _closed(joints: Floats, length: float) -> Floats:
    """Joints (N, D) of a ring moved as little as makes all of its N segments exactly `length` long.

    Newton's method on (|d|^2 - length^2) / 2 = 0 for each segment d: a chord walked round a rough line may close the ring short
    of its first joint, or beside it.
    """
    for _ in range(ROUNDS):
        d = np.roll(joints, -1, axis=0) - joints
        error = (np.einsum("ij,ij->i", d, d) - length**2) / 2
        if np.abs(error).max() < 1e-12 * length**2:
            break
        beside = np.roll(np.arange(len(d)), -1)
        normal = np.diag(2 * np.einsum("ij,ij->i", d, d) + 1e-12 * length**2)
        shared = np.einsum("ij,ij->i", d, d[beside])
        normal[np.arange(len(d)), beside] -= shared
        normal[beside, np.arange(len(d))] -= shared
        share = np.linalg.solve(normal, error)[:, None] * d
        joints = joints + share - np.roll(share, 1, axis=0)
    return joints
