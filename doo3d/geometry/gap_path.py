"""Gap paths: an arc, a straight line, an arc, tangent to both ends (paper, section III-G); Dubins paths of the CSC kind.

The paper closes a gap in the plane with circles that touch the two end lines. One family covers its cases and ends
whose lines are skew: arc, line, arc, of one radius, each arc in the plane of its end direction and the line. Where
the end lines meet ahead of both ends (the paper's first case: exactly one touching point lies ahead of the other
end) the radius is the one of the circle that touches both lines, and in the plane the second arc then has no
length: arc + line. Elsewhere the radius is free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..kernels import arcs as kernel
from ..types import Array, Floats

MAX_DEVIATION_DEG = 20.0
"""Degrees between the line and the straight connection of the ends, at most, when the radius of the arcs is chosen."""


@dataclass(frozen=True)
class Arc:
    """An arc: from `start` (D,) m (px in 2-D) in `direction` (D,) unit, towards `normal` (D,) unit, by `angle` radians."""

    start: Floats
    direction: Floats
    normal: Floats
    angle: float
    radius: float

    @staticmethod
    def from_row(row: Floats) -> Arc:
        """Return an arc from the row (3 D + 2,) of a kernel."""
        start, direction, normal = row[:-2].reshape(3, -1)
        return Arc(start, direction, normal, float(row[-2]), float(row[-1]))

    def at(self, angles: Array) -> Floats:
        """Return the points (S, D) of the arc after turning by angles (S,) in radians."""
        angles = np.asarray(angles)[:, None]
        along, across = np.sin(angles) * self.direction, (1 - np.cos(angles)) * self.normal
        return np.asarray(self.start + self.radius * (along + across))

    @property
    def end(self) -> Floats:
        """The point (D,) where the arc ends."""
        return np.asarray(self.at(np.array([self.angle]))[0])

    @property
    def end_direction(self) -> Floats:
        """The unit direction (D,) at the arc's end."""
        return np.asarray(math.cos(self.angle) * self.direction + math.sin(self.angle) * self.normal)


def arc_towards(start: Floats, direction: Floats, target: Floats, radius: float, opposite: bool = False) -> Arc | None:
    """Return the arc that leaves a point in a direction and ends pointing straight at a target.

    Parameters
    ----------
    start, direction, target
        (D,), the direction a unit vector
    radius
        of the arc, in the unit of the points
    opposite
        bend to the side where the target is not

    Returns
    -------
    The arc, or None if the target is inside the circle.
    """
    start, direction, target = (np.asarray(vector, dtype=float) for vector in (start, direction, target))
    rows = kernel.arc_towards(start, direction, target, float(radius), opposite)
    return Arc.from_row(rows[0]) if len(rows) else None


def arc_line_arc(e1: Floats, d1: Floats, e2: Floats, d2: Floats, radius: float, inside: bool = False) -> tuple[Arc, Arc] | None:
    """Join two ends by an arc, a straight line and an arc of one radius.

    Parameters
    ----------
    e1, e2
        (D,) ends
    d1, d2
        (D,) unit directions, out of either chain
    radius
        of both arcs, in the unit of the ends
    inside
        bend each arc to the side where its target is not

    Returns
    -------
    The arcs at e1 and at e2, both pointing into the gap, with the line between their ends; of the paths found from either end
    the shorter. None if no path of this radius is found.
    """
    rows = kernel.arc_line_arc(np.array((e1, d1, e2, d2), dtype=float), float(radius), inside)
    return (Arc.from_row(rows[0]), Arc.from_row(rows[1])) if len(rows) else None


def corner_radius(e1: Floats, d1: Floats, e2: Floats, d2: Floats) -> float | None:
    """Return the radius of the largest circle that touches both end lines between the ends and the lines' corner.

    The tangents from the corner to a circle are equally long, so the nearer end decides: r tan(angle / 2) is its
    distance from the corner. Skew lines have their corner where they are closest.

    Parameters
    ----------
    e1, e2
        (D,) ends
    d1, d2
        (D,) unit directions, out of either chain

    Returns
    -------
    In the unit of the ends; None if the corner is not ahead of both ends or the lines are parallel.
    """
    radius = float(kernel.corner_radius(np.array((e1, d1, e2, d2), dtype=float)))
    return radius if radius > 0 else None


@dataclass(frozen=True)
class GapPath:
    """The path across a gap, decided once: its arcs and line, of which points are taken at any spacing.

    ends : (2, D) m (px in 2-D), where the path starts and ends; (1, D) where the ends touch.
    rows : (2, 3 D + 2), the arc at either end as the kernels have it, both pointing into the gap; (0, 3 D + 2) where the path is
    the straight connection.
    """

    ends: Floats
    rows: Floats

    @property
    def arcs(self) -> tuple[Arc, Arc] | None:
        """The arcs, with the line between their ends; None where the path is the straight connection."""
        return (Arc.from_row(self.rows[0]), Arc.from_row(self.rows[1])) if len(self.rows) else None

    def points(self, spacing: float) -> Floats:
        """Return points along the path, (P, D), at most `spacing` m (px in 2-D) apart on arcs and line, ends included.

        The straight connection is its two ends; one point remains where the ends touch.
        """
        points: Floats = kernel.sample_gap(self.rows, float(spacing)) if len(self.rows) else self.ends
        return points


def gap_path(
    e1: Floats,
    d1: Floats,
    e2: Floats,
    d2: Floats,
    *,
    inside: bool = False,
    radius: float | None = None,
    max_deviation: float = MAX_DEVIATION_DEG,
) -> GapPath:
    """Return the gap path from one end to another.

    Parameters
    ----------
    e1, e2
        (D,) ends, m (px in 2-D)
    d1, d2
        (D,) unit directions, out of either chain
    inside
        join ends that point away from each other through the inside of the gap instead of around it
    radius
        of the arcs where it is free, m (px in 2-D); None takes the largest, up to half the gap, whose line deviates from the
        straight connection by at most `max_deviation`. A radius too large for the gap is made smaller until there is a path
    max_deviation
        degrees
    """
    ends = np.array((e1, d1, e2, d2), dtype=float)
    touch, rows = kernel.solve_gap(ends, float(radius or 0.0), math.radians(max_deviation), inside)
    return GapPath(ends[:1].copy() if touch else ends[:3:2].copy(), rows)
