"""Intersections of polylines in the view, and values along polylines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..kernels import interpolate_polylines, polyline_crossings
from ..types import Bools, Floats, Ints


@dataclass(frozen=True)
class Intersections:
    """C intersections of polylines in the view; each is where one segment (column 0 of the arrays) crosses another (column 1).

    Attributes
    ----------
    chain
        (C, 2) int, index of the polyline that each of the two segments belongs to.
    segment
        (C, 2) int, index of each segment in its polyline.
    t
        (C, 2), position of the intersection along each segment, from 0 at its first joint to 1 at its second.
    angle
        (C,) radians between the two segments in the view, 0 to pi / 2.
    point
        (C, 2) position of the intersection in the view, in the unit of the polylines.
    """

    chain: Ints
    segment: Ints
    t: Floats
    angle: Floats
    point: Floats


def find_intersections(lines: Sequence[Floats], closed: Sequence[bool]) -> Intersections:
    """Find every point where two segments of some polylines cross in the view.

    Neighboring segments of one polyline, which share a joint, do not count. Segments with a NaN joint (not visible) are skipped.

    Parameters
    ----------
    lines
        polylines in the view, each (N + 1, 2) for N segments; there may be none.
    closed
        for each polyline, True if its last joint repeats its first, so that its last segment is a neighbor of its first.

    Returns
    -------
    The intersections, each once; `Intersections` with C = 0 if there are none. They are sorted by the first segment (in the
    order of the polylines and along them), then by the second.
    """
    points = np.concatenate(lines) if len(lines) else np.zeros((0, 2))
    bounds = np.cumsum([0, *map(len, lines)])
    line, segment, t = polyline_crossings(points, bounds, np.array(closed, dtype=bool))
    row = bounds[line] + segment
    start, step = points[row[:, 0]], points[row + 1] - points[row]
    size = np.linalg.norm(step[:, 0], axis=1) * np.linalg.norm(step[:, 1], axis=1)
    angle = np.arcsin(np.clip(np.abs(_cross(step[:, 0], step[:, 1])) / size, 0, 1))
    return Intersections(line, segment, t, angle, start + t[:, :1] * step[:, 0])


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products (N,) of vectors (N, 2)."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


@dataclass(frozen=True)
class PolylineSet:
    """Values at the joints of L polylines, for interpolation between the joints.

    Attributes
    ----------
    values
        (J, K), K values at each of the J joints of all polylines, one polyline after the other.
    bounds
        (L + 1,) int, row of each polyline's first joint in `values`, and J.
    closed
        (L,) bool, True for a ring, whose last joint repeats the first.
    """

    values: Floats
    bounds: Ints
    closed: Bools

    @staticmethod
    def from_polylines(lines: Sequence[Floats], closed: Sequence[bool]) -> PolylineSet:
        """Return the set of some polylines.

        Parameters
        ----------
        lines
            L >= 1 arrays, each (N + 1, K): K values at each joint of a polyline of N segments.
        closed
            for each polyline, True if it is a ring, whose last joint repeats the first.
        """
        bounds = np.cumsum([0, *map(len, lines)])
        return PolylineSet(np.ascontiguousarray(np.concatenate(lines)), bounds, np.array(closed, dtype=bool))

    def interpolate(self, line: Ints, joint: Floats) -> Floats:
        """Interpolate the values linearly at positions along polylines.

        Parameters
        ----------
        line
            int array of any shape, index of the polyline of each position.
        joint
            array of the same shape, position along the polyline counted in joints: 2.5 is half way between joints 2 and 3.

        Returns
        -------
        (..., K), the K values at each position, ... being the shape of `joint`; NaN beyond the ends of an open polyline.
        Positions on a ring wrap around.
        """
        found = interpolate_polylines(self.values, self.bounds, self.closed, line.ravel(), joint.ravel())
        return found.reshape(*joint.shape, self.values.shape[1])
