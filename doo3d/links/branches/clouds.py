"""Attach and link ends in clouds, where no camera shows empty space.

Where part of the surface was not measured, the two sides are linked straight across the gap, at a low cost per length, unless
they are connected otherwise.
"""

import numpy as np

from ...geometry.polyline import angle
from ...geometry.radii import NODE_RADII
from ..costs import GAP_LINK_COST, TIP_COST
from ..ends import End, Ends
from .strands import ContactCandidate, SampledChain

HIDDEN_WEIGHT = 0.1
"""Weight of the gain of a contact or a link across a gap of a cloud: it is chosen where nothing else connects the end."""

GAP_COST = 0.3
"""Cost units per mm of a gap between parts that nothing else connects: a gap of 0.25 m leaves room for a bend of 30 degrees."""


def hidden_attachment(ends: Ends, row: int, host: SampledChain) -> tuple[float, float]:
    """Find the position on a strand at which an end points across a gap without points.

    ends, row : the ends of all strands, and the row of the end. host : the other strand.

    Returns
    -------
    Gain of the contact in cost units, and arc length on the strand, m. Both are 0 if leaving the end free costs less.
    """
    offset = host.points - ends.points[row]
    distance = np.linalg.norm(offset, axis=1)
    turn = angle(np.broadcast_to(ends.tangents[row], offset.shape), offset)
    per_length, per_radian = 1000 * GAP_COST, ends.config.angle_weights[0]
    cost = np.where(distance <= ends.max_gap, per_length * distance + per_radian * turn, np.inf)
    best = int(cost.argmin())
    at = float(host.along[best])
    if cost[best] >= TIP_COST or host.is_near_end(at, NODE_RADII * float(host.radii[best])):
        return 0.0, 0.0
    return HIDDEN_WEIGHT * (TIP_COST - float(cost[best])), at


def gap_links(ends: Ends) -> list[ContactCandidate]:
    """Return the possible links of two ends across a gap of at most `merge.max_gap`."""
    distance, turn, bend = ends.pairs
    cost = 1000 * GAP_COST * distance + ends.config.angle_weights[0] * (turn + bend)
    allowed = (cost < GAP_LINK_COST) & (distance <= ends.max_gap) & ~(ends.closed | ends.closed[:, None])
    return [
        ContactCandidate(
            HIDDEN_WEIGHT * (GAP_LINK_COST - float(cost[a, b])),
            (ends.points[a] + ends.points[b]) / 2,
            ends=(End.at(a), End.at(b)),
        )
        for a, b in np.argwhere(np.triu(allowed, 1)).tolist()
    ]
