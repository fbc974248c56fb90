"""The confidence of connections of chain ends: what each saves against the best alternative without it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels import second_best_rise
from ...types import Floats
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
    pairs, costs = np.array([(link.first.row, link.second.row) for link in links]), np.array([link.cost for link in links])
    alternatives = len(cost) if len(cost) <= FEW_ENDS else MAX_ALTERNATIVES
    rise = second_best_rise(cost, pairs, costs, float(max_cost), allow_rings, alternatives)
    return [min(max(value / max_cost, 0.0), 1.0) for value in rise.tolist()]
