"""Gap paths: an arc, a straight line, an arc, tangent to both ends (paper, section III-G); Dubins paths of the CSC kind.

The paper closes a gap in the plane with circles that touch the two end lines. One family covers its cases and ends
whose lines are skew: arc, line, arc, of one radius, each arc in the plane of its end direction and the line. Where
the end lines meet ahead of both ends (the paper's first case: exactly one touching point lies ahead of the other
end) the radius is the one of the circle that touches both lines, and in the plane the second arc then turns by
nothing: arc + line. Elsewhere the radius is free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..kernels import arcs as kernel
from ..types import Array, Floats

Vector = tuple[float, float, float]
Arc = tuple[Vector, Vector, Vector, float, float]
"""A Turn as the kernel has it: start, direction, normal, angle, radius."""

MAX_DEVIATION_DEG = 20.0
"""Degrees between the line and the straight connection of the ends, at most, when the radius of the arcs is chosen."""


@dataclass(frozen=True)
class Turn:
    """An arc: from `start` (D,) m (px in 2-D) in `direction` (D,) unit, towards `normal` (D,) unit, by `angle` radians."""

    start: Floats
    direction: Floats
    normal: Floats
    angle: float
    radius: float

    def at(self, turned: Array) -> Floats:
        """Return the points (S, D) of the arc after turning by (S,) radians."""
        turned = np.asarray(turned)[:, None]
        along, across = np.sin(turned) * self.direction, (1 - np.cos(turned)) * self.normal
        return np.asarray(self.start + self.radius * (along + across))

    @property
    def end(self) -> Floats:
        """The point (D,) at which the arc ends."""
        return np.asarray(self.at(np.array([self.angle]))[0])

    @property
    def heading(self) -> Floats:
        """The unit direction (D,) at the end of the arc."""
        return np.asarray(math.cos(self.angle) * self.direction + math.sin(self.angle) * self.normal)


def turn_towards(start: Floats, direction: Floats, target: Floats, radius: float, inside: bool = False) -> Turn | None:
    """Return the arc that leaves `start` in `direction` and ends heading straight for `target`.

    The arc bends to the side of the target, or with `inside` to the other. None where the target lies in the circle.

    Parameters
    ----------
    start, target : (D,) m (px in 2-D).
    direction : (D,) unit.
    radius : m (px in 2-D).
    inside : bend away from the target.
    """
    flat = len(start) == 2
    found, turn = kernel.turn_towards(_vector(start), _vector(direction), _vector(target), float(radius), inside, flat)
    return _turn(turn, flat) if found else None


def connect(e1: Floats, d1: Floats, e2: Floats, d2: Floats, radius: float, inside: bool = False) -> tuple[Turn, Turn] | None:
    """Return the arcs of the path arc, line, arc of one radius between two ends: the one at e1 and the one at e2.

    Both point into the gap; the line lies between their ends. None where no path of this radius is found; the shorter
    path where both orders of looking for it find different ones.

    Parameters
    ----------
    e1, e2 : (D,) ends, m (px in 2-D).
    d1, d2 : (D,) unit, pointing out of either chain.
    radius : m (px in 2-D).
    inside : lead the path through the inside of the gap.
    """
    flat = len(e1) == 2
    found, first, second = kernel.connect(_vector(e1), _vector(d1), _vector(e2), _vector(d2), float(radius), inside, flat)
    return (_turn(first, flat), _turn(second, flat)) if found else None


def _vector(array: Floats) -> Vector:
    """Return a vector (D,) as the kernel takes it: three numbers, the third 0 in the plane."""
    x, y, *z = map(float, array)
    return x, y, z[0] if z else 0.0


def _turn(turn: Arc, flat: bool) -> Turn:
    start, direction, normal = (np.array(vector[:2] if flat else vector) for vector in turn[:3])
    return Turn(start, direction, normal, turn[3], turn[4])


def corner_radius(e1: Floats, d1: Floats, e2: Floats, d2: Floats) -> float | None:
    """Return the radius of the largest circle that touches both end lines between the ends and where the lines meet ahead.

    The tangents from the corner to a circle are equally long, so the nearer end decides: r tan(turn / 2) is its
    distance from the corner. Lines that are skew are taken at their closest points. None where the corner is not
    ahead of both ends or the lines are parallel.
    """
    radius = float(kernel.corner_radius(_vector(e1), _vector(d1), _vector(e2), _vector(d2)))
    return radius if radius > 0 else None


@dataclass(frozen=True)
class GapPath:
    """The path across a gap, decided once: its arcs and line, of which points are taken at any spacing.

    ends : (2, D) m (px in 2-D), where the path starts and ends; (1, D) where the ends touch.
    arcs : the arc at either end, both pointing into the gap; None where the path is the straight connection.
    """

    ends: Floats
    arcs: tuple[Arc, Arc] | None = None

    @property
    def turns(self) -> tuple[Turn, Turn] | None:
        """The arcs, the line lying between their ends; None where the path is the straight connection."""
        if self.arcs is None:
            return None
        flat = self.ends.shape[1] == 2
        return _turn(self.arcs[0], flat), _turn(self.arcs[1], flat)

    def points(self, spacing: float) -> Floats:
        """Return points along the path, (P, D), at most `spacing` m (px in 2-D) apart on arcs and line, ends included.

        The straight connection is its two ends; one point remains where the ends touch.
        """
        if self.arcs is None:
            return self.ends
        points: Floats = kernel.sample_gap(*self.arcs, float(spacing), self.ends.shape[1])
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
    e1, e2 : (D,) ends, m (px in 2-D).
    d1, d2 : (D,) unit, pointing out of either chain.
    inside : lead the path of ends that turn away from each other through the inside of the gap, not round it.
    radius : of the arcs where it is free, m (px in 2-D); None takes the largest, up to half the gap, whose line deviates from the
        straight connection by at most `max_deviation`. A radius too large for the gap is halved until there is a path.
    max_deviation : degrees.
    """
    ends = np.array((e1, d1, e2, d2), dtype=float)
    touch, found, *arcs = kernel.solve_gap(ends, float(radius or 0.0), math.radians(max_deviation), inside)
    return GapPath(ends[:1].copy() if touch else ends[:3:2].copy(), (arcs[0], arcs[1]) if found else None)
