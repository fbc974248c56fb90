"""The confidence of connections of chain ends: what each saves against the best alternative without it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...types import Floats, Ints
from .candidates import Link
from .matching import Rows, find_rings

MAX_ALTERNATIVES = 32
"""Other ends that are tried for each of the two ends of a connection: those that promise the lowest cost."""


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
    exchanges = Exchanges(links, cost, float(max_cost))
    return [min(max(exchanges.rise_without(pair, allow_rings) / max_cost, 0.0), 1.0) for pair in exchanges.pairs]


class Exchanges:
    """Other matchings of the ends, in which up to three connections are exchanged. Row -1, the last of the arrays, is no end.

    Attributes
    ----------
    free
        cost of leaving two ends free.
    pairs
        the ends of each connection.
    total
        (E + 1, E + 1), cost of each pair; half of `free` with no end.
    partner, loss
        (E + 1,), what each end is connected to, -1 for nothing, and the cost that this takes in the total.
    host, alone
        (E + 1,), the free end to which each end would be connected if it lost its partner, -1 for none, and the cost of that.
    """

    def __init__(self, links: Sequence[Link], cost: Floats, free: float) -> None:
        """Prepare the exchanges; links, cost : as for `confidences`."""
        count = len(cost)
        self.free, self.pairs = free, [(link.first.row, link.second.row) for link in links]
        self.total = np.full((count + 1, count + 1), free / 2)
        self.total[:-1, :-1] = np.minimum(cost, cost.T)
        self.total[self.total > free] = np.inf
        self.partner = np.full(count + 1, -1)
        for (a, b), link in zip(self.pairs, links, strict=True):
            self.total[a, b] = self.total[b, a] = link.cost
            self.partner[[a, b]] = b, a
        to_free = np.where(self.partner[:-1] < 0, self.total[:, :-1], np.inf)
        self.host = np.where(to_free.min(axis=1) < free, to_free.argmin(axis=1), -1)
        self.alone = np.minimum(to_free.min(axis=1) - free / 2, free / 2)
        self.loss = np.where(self.partner < 0, free / 2, self.total[np.arange(count + 1), self.partner])
        self.host[-1], self.alone[-1], self.loss[-1] = -1, 0.0, 0.0

    def _others(self, end: int, pair: Rows) -> Ints:
        """Return what one end of a pair may be connected to instead, the cheapest first, and no end."""
        others = np.flatnonzero(np.isfinite(self.total[end, :-1]))
        others = others[~np.isin(others, pair)]
        order = np.argsort((self.total[end] - self.loss + self.alone[self.partner])[others], kind="stable")
        return np.append(others[order[:MAX_ALTERNATIVES]], -1)

    def rise_without(self, pair: Rows, allow_rings: bool) -> float:
        """Return the least rise of the total cost without a connection, of its ends a and b.

        Then a is connected to c and b to d, or to nothing. Their partners e and f are connected to each other, to the free ends g
        and h, or to nothing.
        """
        a, b = pair
        c, d = np.meshgrid(self._others(a, pair), self._others(b, pair), indexing="ij")
        e, f = self.partner[c], self.partner[d]
        g, h = np.where(self.host[e] == d, -1, self.host[e]), np.where(self.host[f] == c, -1, self.host[f])
        h = np.where(h == g, -1, h)
        swap = (e == d) & (d >= 0)
        meet = (e >= 0) & (f >= 0) & ~swap & (self.total[e, f] < self.free)
        apart = sum(np.where(other < 0, self.free / 2 * (end >= 0), self.alone[end]) for end, other in ((e, g), (f, h)))
        rise = self.total[a, c] + self.total[b, d] - self.total[a, b] - self.loss[c] - self.loss[d]
        rise += np.where(meet, self.total[e, f], apart)
        rise[(c == d) & (c >= 0)] = np.inf
        rise[swap] = (self.total[a, c] + self.total[b, d] - self.total[a, b] - self.loss[c])[swap]

        def pairs_after(k: int) -> list[Rows]:
            to_c, to_d, of_c, of_d, host_e, host_f = (int(each.flat[k]) for each in (c, d, e, f, g, h))
            left = [] if swap.flat[k] else [(of_c, of_d)] if meet.flat[k] else [(of_c, host_e), (of_d, host_f)]
            made = [made for made in [(a, to_c), (b, to_d), *left] if min(made) >= 0]
            return [other for other in self.pairs if {a, b, to_c, to_d}.isdisjoint(other)] + made

        order = np.argsort(rise, axis=None, kind="stable").tolist()
        return next(float(rise.flat[k]) for k in order if allow_rings or not find_rings(pairs_after(k)))
