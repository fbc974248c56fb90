"""Find the intersections of curves in a view."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..types import Floats, Ints
from .curves import Curves


@dataclass(frozen=True)
class Intersections:
    """C intersections of two segments of curves in the view.

    Column 0 of the arrays is the first segment, column 1 the second.

    Attributes
    ----------
    chain
        (C, 2) int, index of the curve of each segment.
    segment
        (C, 2) int, index of each segment in its curve.
    t
        (C, 2), position of the intersection along each segment, from 0 at its first joint to 1 at its second.
    angle
        (C,) radians between the two segments in the view, 0 to pi / 2.
    point
        (C, 2) position of the intersection in the view, in the unit of the view.
    """

    chain: Ints
    segment: Ints
    t: Floats
    angle: Floats
    point: Floats


def find_intersections(curves: Curves) -> Intersections:
    """Find every point where two segments of curves cross in the view.

    Neighboring segments of one curve, which share a joint, do not count. Segments with a NaN joint (not visible) are skipped.

    Parameters
    ----------
    curves
        the curves in the view: u and v are the first two values of each point. The last point of a ring repeats its first, so
        its last segment is a neighbor of its first. There may be no curves.

    Returns
    -------
    The intersections, each once; `Intersections` with C = 0 if there are none. They are sorted by the first
    segment (in the order of the curves and along them), then by the second.
    """
    points = curves.points[:, :2]
    is_seen = np.asarray(np.isfinite(points).all(axis=1))
    shown = curves.segments[is_seen[curves.segments] & is_seen[curves.segments + 1]]
    start, step, chain = points[shown], points[shown + 1] - points[shown], curves.owner[shown]
    first, second = _near_pairs(start + step / 2, 1.000001 * float(np.linalg.norm(step, axis=1).max(initial=0.0)))
    apart = shown[second] - shown[first]
    ring = curves.closed[chain[first]] & (apart == curves.counts[chain[first]] - 2)
    may_meet = (chain[first] != chain[second]) | ((apart > 1) & ~ring)
    sine = _cross(step[first], step[second])
    first, second, sine = (values[may_meet & (sine != 0)] for values in (first, second, sine))
    offset = start[second] - start[first]
    t = np.column_stack((_cross(offset, step[second]), _cross(offset, step[first]))) / sine[:, None]
    found = ((t >= 0) & (t < 1)).all(axis=1)
    both, t = np.column_stack((first, second))[found], t[found]
    length = np.linalg.norm(step[both], axis=2).prod(axis=1)
    return Intersections(
        chain[both],
        shown[both] - curves.bounds[chain[both]],
        t,
        np.arcsin(np.minimum(np.abs(sine[found]) / length, 1.0)),
        start[both[:, 0]] + t[:, :1] * step[both[:, 0]],
    )


def _near_pairs(middles: Floats, reach: float) -> tuple[Ints, Ints]:
    """Return the ordered pairs of segments whose middles (N, 2) are within `reach`."""
    if not len(middles):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    first, second = cKDTree(middles).query_pairs(reach, output_type="ndarray").T
    order = np.lexsort((second, first))
    return first[order], second[order]


def _cross(first: Floats, second: Floats) -> Floats:
    """Return the cross product of each pair of 2-D vectors, (N,)."""
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
