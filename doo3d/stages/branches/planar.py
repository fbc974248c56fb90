"""Tell crossings from opposite branches in an image without depth, by the turns and widths of the two strands."""

from __future__ import annotations

import math

from ...geometry.polyline import unit
from ...types import Floats
from .strands import SampledChain, stretch_inside

RADIUS_TOLERANCE = 0.3
"""Change of a strand's width at a crossing without cost, e-folds (logarithm of the ratio): masks are ragged."""

BEND_WEIGHT = 1.5
"""Weight of a bend beyond the curvature on both sides: below 0.3 rad at crossings of rendered cables, and 0.4 to 1.6 rad where
two branches leave a trunk opposite each other."""


def radius_change(strand: SampledChain, position: float) -> float:
    """Return the absolute logarithm of the ratio of a strand's radii after and before a position (arc length, m; px in 2-D)."""
    return abs(math.log(strand.radius_near(position, -1) / strand.radius_near(position, 1)))


def planar_radius_change(first: SampledChain, at: float, second: SampledChain, place: float) -> float:
    """Return the sum of the logarithmic changes of width of two strands at their contact, beyond the noise of a mask.

    first, at, second, place : each strand, and the arc length on it at the contact, px.
    """
    changes = radius_change(first, at), radius_change(second, place)
    return sum(max(0.0, change - RADIUS_TOLERANCE) for change in changes)


def planar_turn(first: SampledChain, at: float, second: SampledChain, place: float) -> float:
    """Return the larger of the angles in radians by which two strands turn inside each other in an image.

    The thicker strand is the trunk in either case, so its turn is weighted by the ratio of the cross-sections.

    first, at, second, place : each strand, and the arc length on it at the contact, px.
    """
    radii = [max(strand.radius_near(s, -1), strand.radius_near(s, 1)) for strand, s in ((first, at), (second, place))]
    turns = _turn_inside(first, at, second, place), _turn_inside(second, place, first, at)
    thinner = min(radii)
    return max(turn * (thinner / radius) ** 2 for turn, radius in zip(turns, radii, strict=True))


def _turn_inside(strand: SampledChain, at: float, other: SampledChain, place: float) -> float:
    """Return the angle in radians by which a strand turns where it runs inside another one.

    Two branches that were joined along the trunk turn to one side where they come in, and to the other where they go out: that
    counts in full. A bend to one side counts as far as the curvature of the strand on both sides does not explain it.
    """
    low, high = stretch_inside(strand, at, other)
    line = unit(strand.at(high) - strand.at(low))
    entering = _signed_angle(-strand.arm(low, -1, strand.radius), line)
    leaving = _signed_angle(line, strand.arm(high, 1, strand.radius))
    bend = abs(entering + leaving)
    both = strand.radius_near(at, 1) + other.radius_near(place, 1)
    return abs(entering) + abs(leaving) - bend + BEND_WEIGHT * min(bend, strand.kink(at, both, None))


def _signed_angle(first: Floats, second: Floats) -> float:
    """Return the angle in radians from one direction (2,) to another."""
    return math.atan2(float(first[0] * second[1] - first[1] * second[0]), float(first @ second))
