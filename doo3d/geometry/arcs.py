"""The way across a gap: an arc, a straight line, an arc, tangent to both ends (paper, section III-G).

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


@dataclass(frozen=True)
class Turn:
    """An arc: from `start` (D,) in `direction` (D,) unit, bending towards `normal` (D,) unit, by `angle` radians."""

    start: Floats
    direction: Floats
    normal: Floats
    angle: float
    radius: float

    def at(self, turned: Array) -> Floats:
        """Points of the arc after turning by (S,) radians -> (S, D)."""
        turned = np.asarray(turned)[:, None]
        along, across = np.sin(turned) * self.direction, (1 - np.cos(turned)) * self.normal
        return np.asarray(self.start + self.radius * (along + across))

    @property
    def end(self) -> Floats:
        """(D,) where the arc ends."""
        return np.asarray(self.at(np.array([self.angle]))[0])

    @property
    def heading(self) -> Floats:
        """(D,) unit direction at its end."""
        return np.asarray(math.cos(self.angle) * self.direction + math.sin(self.angle) * self.normal)


def turn_towards(start: Floats, direction: Floats, target: Floats, radius: float, inside: bool = False) -> Turn | None:
    """The arc that leaves `start` in `direction` and ends heading straight for `target`; None where target is in the circle.

    It bends to the side of the target, or with `inside` to the other.
    """
    flat = len(start) == 2
    found, turn = kernel.turn_towards(_vector(start), _vector(direction), _vector(target), float(radius), inside, flat)
    return _turn(turn, flat) if found else None


def connect(e1: Floats, d1: Floats, e2: Floats, d2: Floats, radius: float, inside: bool = False) -> tuple[Turn, Turn] | None:
    """Arc + line + arc of one radius between two ends.

    e1, e2 : (D,) ends. d1, d2 : (D,) unit, pointing out of either chain. Returns the arc at e1 and the arc at e2, both
    pointing into the gap; the line lies between their ends. None where no member of this radius is found,
    the shorter one where both orders of looking for it find different ones.
    """
    flat = len(e1) == 2
    found, first, second = kernel.connect(_vector(e1), _vector(d1), _vector(e2), _vector(d2), float(radius), inside, flat)
    return (_turn(first, flat), _turn(second, flat)) if found else None


def _vector(array: Floats) -> Vector:
    """(D,) as the kernel has it."""
    x, y, *z = map(float, array)
    return x, y, z[0] if z else 0.0


def _turn(turn: tuple[Vector, Vector, Vector, float, float], flat: bool) -> Turn:
    start, direction, normal = (np.array(vector[:2] if flat else vector) for vector in turn[:3])
    return Turn(start, direction, normal, turn[3], turn[4])


def corner_radius(e1: Floats, d1: Floats, e2: Floats, d2: Floats) -> float | None:
    """Radius of the largest circle that touches both end lines between the ends and where the lines meet ahead.

    The tangents from the corner to a circle are equally long, so the nearer end decides: r tan(turn / 2) is its
    distance from the corner. Lines that are skew are taken at their closest points. None where the corner is not
    ahead of both ends or the lines are parallel.
    """
    radius = float(kernel.corner_radius(_vector(e1), _vector(d1), _vector(e2), _vector(d2)))
    return radius if radius > 0 else None


def tangent_path(
    e1: Floats,
    d1: Floats,
    e2: Floats,
    d2: Floats,
    spacing: float,
    radius: float | None = None,
    max_deviation: float = 20.0,
    inside: bool = False,
) -> Floats:
    """Points of the way across a gap, ends included, at most `spacing` apart.

    e1, e2 : (D,) ends, m (px in 2-D). d1, d2 : (D,) unit, pointing out of either chain.
    radius : of the arcs where it is free; None: the largest, up to half the gap, whose line turns away from the straight
    way across by at most `max_deviation` degrees. A radius too large for the gap is halved until there is a way.
    inside : ends that turn away from each other are joined through the inside of the gap instead of round it.
    Returns (P, D), P >= 2, or (1, D) where the ends touch.
    """
    ends = np.array((e1, d1, e2, d2), dtype=float)
    way: Floats = kernel.path(ends, float(spacing), float(radius or 0.0), math.radians(max_deviation), inside)
    return way
