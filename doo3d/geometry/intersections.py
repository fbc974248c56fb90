"""Intersections of curves in the view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels import polyline_crossings
from ..types import Floats, Ints
from .curves import Curves


@dataclass(frozen=True)
class Intersections:
    """C intersections of curves in the view; each is where one segment (column 0 of the arrays) crosses another (column 1).

    Attributes
    ----------
    chain
        (C, 2) int, index of the curve that each of the two segments belongs to.
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
    """Find every point where two segments of some curves cross in the view.

    Neighboring segments of one curve, which share a joint, do not count. Segments with a NaN joint (not visible) are skipped.

    Parameters
    ----------
    curves
        the curves as the view shows them: u and v are the first two values of each point. A ring's last point repeats its first,
        so that its last segment is a neighbor of its first. There may be no curves.

    Returns
    -------
    The intersections, each once; `Intersections` with C = 0 if there are none. They are sorted by the first segment (in the
    order of the curves and along them), then by the second.
    """
    return Intersections(*polyline_crossings(np.ascontiguousarray(curves.points[:, :2]), curves.bounds, curves.closed))
