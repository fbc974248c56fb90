"""Attach and join ends in clouds, where no camera shows empty space.

Where part of the surface was not measured, the two sides are joined straight across the gap, at a low cost per length, unless
they are connected otherwise.
"""

from __future__ import annotations

import numpy as np

from ...geometry.polyline import angle
from ...geometry.radii import NODE_RADII
from ...types import Floats
from .costs import JOIN_COST, TIP_COST, TURN_COST
from .strands import FreeEnds, Meeting, SampledChain

HIDDEN_WEIGHT = 0.1
"""Weight of the gain of a connection across a gap of a cloud: it is made where nothing else connects the end."""

GAP_COST = 0.3
"""Cost units per mm of a gap between parts that nothing else connects: a gap of 0.25 m leaves room for a bend of 30 degrees."""


def hidden_attachment(point: Floats, tangent: Floats, strand: SampledChain, max_gap: float) -> tuple[float, float] | None:
    """Find the position on a strand that an end points at across a gap without points.

    Parameters
    ----------
    point, tangent
        (3,) m and unit, the end and its direction.
    strand
        the other strand.
    max_gap
        m, longest gap.

    Returns
    -------
    Gain of the junction in cost units, and arc length on the strand, m. None if leaving the end free costs less.
    """
    offset = strand.points - point
    distance = np.linalg.norm(offset, axis=1)
    turn = angle(np.broadcast_to(tangent, offset.shape), offset)
    cost = np.where(distance <= max_gap, 1000 * GAP_COST * distance + TURN_COST * turn, np.inf)
    best = int(cost.argmin())
    at = float(strand.along[best])
    if cost[best] >= TIP_COST or strand.is_near_end(at, NODE_RADII * float(strand.radii[best])):
        return None
    return HIDDEN_WEIGHT * (TIP_COST - float(cost[best])), at


def end_joins(ends: FreeEnds, max_gap: float) -> list[Meeting]:
    """Return the possible joins of two free ends across a gap of at most `max_gap`, m."""
    offset = ends.points[None] - ends.points[:, None]
    distance = np.linalg.norm(offset, axis=2)
    outward = np.broadcast_to(ends.tangents[:, None], offset.shape)
    bend = angle(outward, offset)
    turn = angle(outward, -outward.swapaxes(0, 1))
    cost = 1000 * GAP_COST * distance + TURN_COST * (turn + np.maximum(bend, bend.T))
    possible = np.triu((cost < JOIN_COST) & (distance <= max_gap), 1)
    return [
        Meeting(HIDDEN_WEIGHT * (JOIN_COST - float(cost[a, b])), (ends.points[a] + ends.points[b]) / 2, (), (a, b))
        for a, b in np.argwhere(possible).tolist()
    ]
