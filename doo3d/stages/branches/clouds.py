"""Attach and join ends in clouds, where no camera shows empty space.

Where part of the surface was not measured, the two sides are joined straight across the gap, at a low cost per length, unless
they are connected otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...geometry.disjoint_set import DisjointSet
from ...geometry.polyline import angle
from ...types import Bools, Floats
from .costs import JOIN_COST, TURN_COST
from .strands import MIN_ANGLE, FreeEnds, SampledChain

GAP_COST = 0.3
"""Cost units per mm of a gap between parts that nothing else connects: a gap of 0.25 m leaves room for a bend of 30 degrees."""


def hidden_place(point: Floats, tangent: Floats, strand: SampledChain, max_gap: float) -> tuple[int, float] | None:
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
    Index of the strand's sample, and the cost of the attachment in cost units; None if all samples are farther than `max_gap`.
    """
    offset = strand.points - point
    distance = np.linalg.norm(offset, axis=1)
    if distance.min() > max_gap:
        return None
    turn = angle(np.broadcast_to(tangent, offset.shape), offset)
    aside = angle(offset, np.gradient(strand.points, axis=0))
    possible = (distance <= max_gap) & (np.minimum(aside, np.pi - aside) > MIN_ANGLE)
    cost = np.where(possible, 1000 * GAP_COST * distance + TURN_COST * turn, np.inf)
    best = int(cost.argmin())
    return best, float(cost[best])


def gap_links(ends: FreeEnds, is_free: Bools, group: Sequence[int], max_gap: float) -> list[tuple[int, int, float]]:
    """Choose pairs of free ends to join across gaps, if their strands belong to different objects so far.

    Parameters
    ----------
    ends
        the E free ends of all strands.
    is_free
        (E,) bool, False for an end that meets a strand.
    group
        number of the object of each strand.
    max_gap
        m, longest gap.

    Returns
    -------
    (row, row, cost) of each join by ascending cost: rows of the two ends, and cost units. An end is joined at most once, and no
    join connects an object with itself.
    """
    rows = np.flatnonzero(is_free)
    points, tangents = ends.points[rows], ends.tangents[rows]
    offset = points[None] - points[:, None]
    distance = np.linalg.norm(offset, axis=2)
    turn = angle(np.broadcast_to(tangents[:, None], offset.shape), -np.broadcast_to(tangents[None], offset.shape))
    bend = angle(np.broadcast_to(tangents[:, None], offset.shape), offset)
    cost = 1000 * GAP_COST * distance + TURN_COST * (turn + np.maximum(bend, bend.T))
    cost[distance > max_gap] = np.inf
    objects = DisjointSet(group)
    links, used = [], np.zeros(len(rows), dtype=bool)
    first, second = np.triu_indices(len(rows), 1)
    order = np.argsort(cost[first, second], kind="stable")
    for a, b in zip(first[order].tolist(), second[order].tolist(), strict=True):
        if cost[a, b] > JOIN_COST:
            break
        if not (used[a] or used[b]) and objects.join(ends.strand[rows[a]], ends.strand[rows[b]]):
            used[[a, b]] = True
            links.append((int(rows[a]), int(rows[b]), float(cost[a, b])))
    return links
