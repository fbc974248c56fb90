"""The confidence of connections of chain ends: what each saves against the best alternative without it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels import second_best_rise
from ...types import Floats, Ints
from .candidates import Link

FEW_ENDS = 256
"""Ends up to which all others are tried as alternatives; the work grows as their number to the power of three."""

MAX_ALTERNATIVES = 32
"""Other ends that are tried for each of the two ends of a connection where there are more: those that promise the lowest cost."""


def confidences(links: Sequence[Link], cost: Floats, max_cost: float, allow_rings: bool = False) -> list[float]:
    """Return the confidence of each connection, 0 to 1: how much the best solution without the connection costs more.

    The confidence is the rise of the total cost divided by `max_cost`. The total is the cost of all connections, plus half of
    `max_cost` for each end that stays free. In the solution without a connection each of its two ends stays free or is connected
    to another end. If that other end was connected itself, its former partner stays free or is connected elsewhere.

    Parameters
    ----------
    links
        the chosen connections.
    cost
        (E, E) cost units, cost of connecting each pair of E ends, gap path included. Only entries [i, j] with i < j are used;
        infinite where a connection is not allowed.
    max_cost
        cost of leaving both ends of a connection free. If infinite, a little over twice the largest finite cost is used.
    allow_rings
        True if an alternative may connect the two ends of one chain.

    Returns
    -------
    One confidence per connection, in the order of the links; 0 if a solution without the connection costs no more,
    1 - cost / `max_cost` if the only alternative is to leave both ends free.
    """
    if not np.isfinite(max_cost):
        max_cost = 2 * max([float(cost[np.isfinite(cost)].max(initial=0.0)), *(link.cost for link in links)]) + 1
    if not links:
        return []
    total = np.minimum(cost, cost.T)
    total[total > max_cost] = np.inf
    partner = np.full(len(total), -1)
    pairs = np.array([(link.first.row, link.second.row) for link in links])
    for (a, b), link in zip(pairs, links, strict=True):
        partner[[a, b]] = b, a
        total[a, b] = total[b, a] = link.cost
    spare, settled = _spare_ends(total, partner, max_cost)
    alternatives = len(total) if len(total) <= FEW_ENDS else MAX_ALTERNATIVES
    rise = second_best_rise(total, partner, float(max_cost), spare, settled, pairs, allow_rings, alternatives)
    return [float(confidence) for confidence in np.clip(rise / max_cost, 0.0, 1.0)]


def _spare_ends(total: Floats, partner: Ints, max_cost: float) -> tuple[Ints, Floats]:
    """Return where ends may be joined instead, in the terms of `kernels.second_best`.

    Parameters
    ----------
    total
        (E, E), cost of joining any two ends.
    partner
        (E,), the end that each is joined to; -1 for none.
    max_cost
        cost of leaving two ends free.

    Returns
    -------
    spare : (E,), the free end that each end would be joined to at the least cost; -1 where none is worth it.
    settled : (E,), the cost of taking each end away from what it is joined to, or from being free.
    """
    matched, free = np.flatnonzero(partner >= 0), np.flatnonzero(partner < 0)
    spare, spare_cost = np.full(len(total), -1), np.full(len(total), np.inf)
    if len(free):
        best = total[:, free].argmin(axis=1)
        spare_cost = total[np.arange(len(total)), free[best]]
        spare = np.where(spare_cost < max_cost, free[best], -1)
    settled = np.full(len(total), -max_cost / 2)
    left = partner[matched]
    settled[matched] = np.minimum(max_cost / 2, spare_cost[left] - max_cost / 2) - total[matched, left]
    return spare, settled
