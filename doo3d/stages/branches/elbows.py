"""Bridge elbows: sharp bends where two branches were joined to each other, since their common trunk was not measured.

A trunk that was not measured leaves an elbow on each side of the gap, and both point into it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...geometry.curves import runs
from ...geometry.disjoint_set import DisjointSet
from ...geometry.equal_segments import equal_segments
from ...geometry.polyline import angle, unit
from ...types import Chain, Floats
from .clouds import GAP_COST, hidden_place
from .costs import JOIN_COST, TURN_COST
from .strands import ARM_RADII, SampledChain

MIN_TURN = 0.9
"""Smallest turn of an elbow, radians: a cable turns less over such a short length, two joined branches of one trunk turn more."""


@dataclass(frozen=True)
class Elbow:
    """A sharp bend of a strand.

    Attributes
    ----------
    strand
        index of the strand.
    point
        (3,) m, position of the bend.
    direction
        (3,) unit, away from the inside of the bend, towards the missing trunk.
    """

    strand: int
    point: Floats
    direction: Floats


def bridges(strands: Sequence[SampledChain], group: Sequence[int], max_gap: float, length: float) -> list[Chain]:
    """Return a hidden chain for each pair of elbows that point at each other, to connect otherwise separate objects.

    A bridge costs its length and the angles between it and the directions of the elbows. The cheapest bridges are made first.

    Parameters
    ----------
    strands
        all strands, m.
    group
        number of the object of each strand.
    max_gap
        m, longest bridge.
    length
        segment length, m.

    Returns
    -------
    Straight chains whose segments are all occluded; they connect each pair of objects at most once.
    """
    elbows = [elbow for number, strand in enumerate(strands) for elbow in _elbows(number, strand)]
    found = []
    for one, other in itertools.combinations(elbows, 2):
        offset = other.point - one.point
        distance = float(np.linalg.norm(offset))
        if group[one.strand] != group[other.strand] and length < distance <= max_gap:
            turn = float(angle(one.direction, offset)) + float(angle(other.direction, -offset))
            found.append((1000 * GAP_COST * distance + TURN_COST * turn, one, other))
    for one, (number, strand) in itertools.product(elbows, enumerate(strands)):
        place = hidden_place(one.point, one.direction, strand, max_gap) if group[one.strand] != group[number] else None
        if place is not None and np.linalg.norm(strand.points[place[0]] - one.point) > length:
            found.append((place[1], one, Elbow(number, strand.points[place[0]], -one.direction)))
    objects = DisjointSet(group)
    result = []
    for cost, one, other in sorted(found, key=lambda item: item[0]):
        if cost < JOIN_COST and objects.join(one.strand, other.strand):
            joints = equal_segments(np.stack((one.point, other.point)), length)
            radius = max(strands[one.strand].radius, strands[other.strand].radius)
            result.append(Chain(joints, length, radius, occluded=np.ones(len(joints) - 1, dtype=bool)))
    return result


def _elbows(number: int, strand: SampledChain) -> Iterator[Elbow]:
    """Yield the elbows of a strand: where it turns sharply across a gap, or from one place to the next."""
    gaps = [(first, end - 1) for first, end in runs(strand.occluded)]
    steps = max(1, round(ARM_RADII[1] * strand.radius / max(float(strand.along[1]), 1e-9)))
    places = [(i, i) for i in range(steps, len(strand.along) - steps)]
    turned = []
    for low, high in [*gaps, *places]:
        middle, half = (strand.along[low] + strand.along[high]) / 2, (strand.along[high] - strand.along[low]) / 2
        clear = float(half + ARM_RADII[0] * strand.radius)
        if min(middle, strand.length - middle) < clear + ARM_RADII[0] * strand.radius:
            continue
        before, after = strand.arm(float(middle), -1, clear), strand.arm(float(middle), 1, clear)
        turned.append((float(angle(-before, after)), float(middle), clear + ARM_RADII[1] * strand.radius, -(before + after)))
    used: list[tuple[float, float]] = []
    for turn, middle, reach, direction in sorted(turned, key=lambda item: -item[0]):
        if turn > MIN_TURN and all(abs(middle - place) > max(reach, width) for place, width in used):
            used.append((middle, reach))
            yield Elbow(number, strand.at(middle), unit(direction))
