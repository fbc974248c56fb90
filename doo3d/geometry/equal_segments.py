"""Divide curves into segments of equal length, from end to end."""

import numpy as np

from .. import kernels
from ..types import Floats
from .curves import Curves

MAX_ITERATIONS = 50
"""Largest number of iterations of Newton's method; a few suffice."""

MAX_SAMPLES_PER_CHORD = 100
"""Number of points of a curve per chord up to which curvature is measured at neighboring points."""


def chains_along(curves: Curves, shifts: Floats, length: float) -> Curves:
    """Return the joints of chains of segments of exactly `length` along curves.

    The chords of a curve are inside its bends. So the curve is first moved outwards by two thirds of the sagitta.

    Parameters
    ----------
    curves
        K curves through evenly spaced points.
    shifts
        (2 K,) length by which each curve is extended straight ahead, or shortened, at its first and at its last point; in the
        unit of the points. Not used for rings.
    length
        length of a segment, in the unit of the points.

    Returns
    -------
    The joints along each curve; none for a curve shorter than half a segment or curled up within one, and for
    a ring of fewer than three segments.
    """
    joints = Curves(
        *kernels.equal_segments(curves.points, curves.bounds, curves.closed, shifts, length, MAX_SAMPLES_PER_CHORD), curves.closed
    )
    if not curves.closed.any():
        return joints
    flags = curves.closed.tolist()
    lines = zip(curves, joints, flags, strict=True)
    return Curves.of([equal_ring(line, length) if is_ring else chain for line, chain, is_ring in lines], flags)


def equal_segments(points: Floats, length: float) -> Floats:
    """Return the joints of a chain of segments of exactly `length` along a polyline.

    The number of segments is the one that fits best. The chain is longer or shorter than the polyline by the same length at
    both ends; where it is longer, it continues straight.

    Parameters
    ----------
    points
        (P, D), P >= 2 points of the polyline.
    length
        length of a segment, in the unit of the points.

    Returns
    -------
    (N + 1, D), joints of N segments, in the unit of the points; (0, D) for a polyline shorter than half a
    segment or curled up within one.
    """
    curve = Curves.of([points])
    return kernels.equal_segments(curve.points, curve.bounds, curve.closed, np.zeros(2), length, 0)[0]


def equal_ring(points: Floats, length: float) -> Floats:
    """Return the joints of a ring of segments of exactly `length` along a polyline.

    The number of segments is the one that fits best, so the perimeter changes by half a segment at most.

    Parameters
    ----------
    points
        (P, D), P points of the polyline; the first point is not repeated at the end.
    length
        length of a segment, in the unit of the points.

    Returns
    -------
    (N + 1, D), joints of N >= 3 segments, the last joint equal to the first, in the unit of the points; (0, D)
    if fewer than three segments fit, or none do, as around a polyline that folds back and forth.

    Notes
    -----
    Equal chords are placed around the polyline (their length by bisection), the ring is scaled about its centroid
    to the exact length, and Newton's method removes the rest of the misfit.
    """
    loop = np.concatenate((points, points[:1]))
    joints = kernels.lay_equal_chords(loop, length)[0]
    count = len(joints) - 1 + round(float(np.linalg.norm(loop[-1] - joints[-1])) / length)
    if count < 3:
        return points[:0]
    low, high = 0.5 * length, 1.5 * length
    for _ in range(60):
        chord = (low + high) / 2
        joints, _ = kernels.lay_equal_chords(loop, chord)
        low, high = (chord, high) if len(joints) - 1 >= count else (low, chord)
    joints = kernels.lay_equal_chords(loop, low)[0][:count]
    centroid = joints.mean(axis=0)
    ring = close_ring(centroid + (joints - centroid) * (length / low), length)
    is_even = np.allclose(np.linalg.norm(np.diff(ring, axis=0), axis=1), length, rtol=1e-6, atol=0)
    return ring if is_even else points[:0]


def close_ring(joints: Floats, length: float) -> Floats:
    """Move the joints (N, D) of a ring until N segments are exactly `length` long.

    Each step is the smallest motion (Newton's method on (|d|^2 - length^2) / 2 = 0 for each segment d). It closes chords
    around a rough polyline that end short of the first joint, or next to it.

    Returns
    -------
    (N + 1, D), the last joint equal to the first; with segments of other lengths if there is no such ring.
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
    return np.concatenate((joints, joints[:1]))
