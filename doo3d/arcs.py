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

from .geometry import TINY, angle, perpendicular, unit
from .types import Array, Floats

ROUNDS = 200
CONVERGED = 1e-13
BISECTIONS = 3
"""Of the step of sqrt 2 in which a radius is searched for: to 5 percent."""


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
    way = target - start
    x = float(way @ direction)
    across = way - x * direction
    y = float(np.linalg.norm(across))
    scale = float(np.linalg.norm(way))
    if y <= 1e-12 * max(scale, 1e-300):
        if x >= 0:
            return Turn(start, direction, perpendicular(direction), 0.0, radius)
        normal, y = perpendicular(direction), 0.0
    else:
        normal = across / y
    if inside:
        normal, y = -normal, -y
    reach2 = x * x + (y - radius) ** 2 - radius * radius
    if reach2 < 0:
        return None
    theta = (math.atan2(y - radius, x) + math.atan2(radius, math.sqrt(reach2))) % (2 * math.pi)
    return Turn(start, direction, normal, 0.0 if theta > 2 * math.pi - 1e-9 else theta, radius)


def connect(e1: Floats, d1: Floats, e2: Floats, d2: Floats, radius: float, inside: bool = False) -> tuple[Turn, Turn] | None:
    """Arc + line + arc of one radius between two ends.

    e1, e2 : (D,) ends. d1, d2 : (D,) unit, pointing out of either chain. Returns the arc at e1 and the arc at e2, both
    pointing into the gap; the line lies between their ends. None where no member of this radius is found,
    the shorter one where both orders of looking for it find different ones.
    """
    there, back = _aimed(e1, d1, e2, d2, radius, inside), _aimed(e2, d2, e1, d1, radius, inside)
    if there and back:
        return there if _length(there) <= _length(back) * (1 + 1e-9) else back[::-1]
    if there or back:
        return there or (back and back[::-1])
    return None if inside else _cornered(e1, d1, e2, d2, radius)


def _length(turns: tuple[Turn, Turn]) -> float:
    first, second = turns
    return first.radius * (first.angle + second.angle) + float(np.linalg.norm(second.end - first.end))


def _aimed(e1: Floats, d1: Floats, e2: Floats, d2: Floats, radius: float, inside: bool) -> tuple[Turn, Turn] | None:
    """The member of the family found by aiming each arc at the end of the other in turn.

    It finds turns of any angle, but not members whose first arc reaches round the end that it is aimed at first.
    """
    scale = float(np.linalg.norm(e2 - e1))
    target = e2
    moved = math.inf
    first = second = None
    for _ in range(ROUNDS):
        first = turn_towards(e1, d1, target, radius, inside)
        second = turn_towards(e2, d2, first.end, radius, inside) if first else None
        if first is None or second is None:
            return None
        moved = float(np.linalg.norm(second.end - target))
        target = second.end
        if moved <= CONVERGED * scale:
            break
    if moved > 1e-6 * scale or first is None or second is None or first.heading @ second.heading > 1e-9 - 1:
        return None
    return (first, second) if (second.end - first.end) @ first.heading >= -1e-9 * scale else None


def _cornered(e1: Floats, d1: Floats, e2: Floats, d2: Floats, radius: float) -> tuple[Turn, Turn] | None:
    """The member of the family found by its two corners, where the end lines meet the line, in turn with its direction.

    A corner lies r tan(turn / 2) ahead of its end. It finds members with large arcs, but no turns of nearly 180 degrees.
    """
    way = e2 - e1
    scale = math.sqrt(float(way @ way))
    line, length, ahead = way / scale, scale, 0.0
    moved = math.inf
    for _ in range(ROUNDS):
        cosine1, cosine2 = float(d1 @ line), -float(d2 @ line)
        if min(cosine1, cosine2) < -0.999:
            return None
        ahead1 = radius * math.sqrt(max(0.0, 1 - cosine1) / (1 + cosine1))
        ahead2 = radius * math.sqrt(max(0.0, 1 - cosine2) / (1 + cosine2))
        between = way + ahead2 * d2 - ahead1 * d1
        length, ahead = math.sqrt(float(between @ between)), ahead1 + ahead2
        if length <= TINY * scale:
            return None
        before, line = line, between / length
        moved = math.sqrt(float((line - before) @ (line - before)))
        if moved <= CONVERGED:
            break
    if moved > 1e-10 or length < ahead - 1e-9 * scale:
        return None
    return _bent(e1, d1, line, radius), _bent(e2, d2, -line, radius)


def _bent(start: Floats, direction: Floats, heading: Floats, radius: float) -> Turn:
    """The arc from `start` that turns from one unit direction to another."""
    across = heading - float(heading @ direction) * direction
    if not across.any():
        return Turn(start, direction, perpendicular(direction), 0.0, radius)
    return Turn(start, direction, unit(across), float(angle(direction, heading)), radius)


def corner_radius(e1: Floats, d1: Floats, e2: Floats, d2: Floats) -> float | None:
    """Radius of the largest circle that touches both end lines between the ends and where the lines meet ahead.

    The tangents from the corner to a circle are equally long, so the nearer end decides: r tan(turn / 2) is its
    distance from the corner. Lines that are skew are taken at their closest points. None where the corner is not
    ahead of both ends or the lines are parallel.
    """
    cosine = float(d1 @ d2)
    sine2 = 1 - cosine * cosine
    if sine2 < 1e-12:
        return None
    way = e2 - e1
    a = (way @ d1 - cosine * (way @ d2)) / sine2
    b = (cosine * (way @ d1) - way @ d2) / sine2
    if a <= 0 or b <= 0:
        return None
    return float(min(a, b)) / math.tan(float(angle(d1, -d2)) / 2)


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
    gap = float(np.linalg.norm(e2 - e1))
    if gap < 1e-12:
        return np.asarray(e1, dtype=float)[None]
    turns = _turns(e1, unit(d1), e2, unit(d2), gap, radius, math.radians(max_deviation), inside)
    if turns is None:
        return np.array([e1, e2], dtype=float)
    first, second = turns
    length = float(np.linalg.norm(second.end - first.end))
    line = np.linspace(first.end, second.end, max(2, math.ceil(length / spacing) + 1))
    parts = [_sampled(first, spacing)[:-1], line, _sampled(second, spacing)[::-1][1:]]
    return np.concatenate(parts)


def _sampled(turn: Turn, spacing: float) -> Floats:
    count = max(1, math.ceil(turn.angle * turn.radius / spacing)) if turn.angle > 0 else 0
    return turn.at(np.linspace(0.0, turn.angle, count + 1))


def _turns(
    e1: Floats, d1: Floats, e2: Floats, d2: Floats, gap: float, radius: float | None, deviation: float, inside: bool
) -> tuple[Turn, Turn] | None:
    away = max(float(d1 @ (e2 - e1)), float(d2 @ (e1 - e2))) < 0
    corner = corner_radius(e1, d1, e2, d2)
    if corner is not None:
        return _largest(e1, d1, e2, d2, corner, math.pi, False)
    if radius is not None:
        return _largest(e1, d1, e2, d2, radius, math.pi, inside and away)
    return _largest(e1, d1, e2, d2, gap / 2, deviation, inside and away)


def _largest(
    e1: Floats, d1: Floats, e2: Floats, d2: Floats, radius: float, deviation: float, inside: bool
) -> tuple[Turn, Turn] | None:
    """The member with about the largest radius up to `radius` that exists and keeps its direction."""

    def member(radius: float) -> tuple[Turn, Turn] | None:
        turns = connect(e1, d1, e2, d2, radius, inside)
        if turns is None:
            return None
        line = turns[1].end - turns[0].end
        none = np.linalg.norm(line) <= 1e-9 * np.linalg.norm(e2 - e1)
        return turns if none or float(angle(line, e2 - e1)) <= deviation else None

    found = member(radius)
    if found is not None:
        return found
    for _ in range(40):
        radius /= math.sqrt(2)
        found = member(radius)
        if found is not None:
            break
    step = 2**0.25
    for _ in range(BISECTIONS):
        larger = member(radius * step)
        if larger is not None:
            found, radius = larger, radius * step
        step = math.sqrt(step)
    return found
