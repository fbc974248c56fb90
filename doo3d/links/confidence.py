"""The confidence of links: what each saves against the best alternative without it."""

from collections.abc import Sequence

import numpy as np

from ..types import Floats, Ints
from .ends import Link
from .matching import Rows, find_rings

MAX_ALTERNATIVES = 32
"""Other ends that are tried for each of the two ends of a link: those that promise the lowest cost."""


def confidences(links: Sequence[Link], cost: Floats, max_cost: float, allow_rings: bool = False) -> list[float]:
    """Return the confidence of each link, 0 to 1: how much the best solution without the link costs more.

    The confidence is the rise of the total cost divided by `max_cost`. The total is the cost of all links, plus half of
    `max_cost` for each end that stays free. In the solution without a link each of its two ends stays free or is linked to
    another end. If that other end was linked itself, its former partner stays free or is linked to a third end.

    Parameters
    ----------
    links
        the chosen links.
    cost
        (E, E) cost units, cost of linking each pair of E ends, gap path included. Only entries [i, j] with i < j are used;
        infinite where a link is not allowed.
    max_cost
        cost of leaving both ends of a link free. If infinite, a little over twice the largest finite cost is used.
    allow_rings
        True if an alternative may link the two ends of one chain.

    Returns
    -------
    One confidence per link, in the order of the links; 0 if a solution without the link costs no more,
    1 - cost / `max_cost` if the only alternative is to leave both ends free.
    """
    if not np.isfinite(max_cost):
        max_cost = 2 * max([float(cost[np.isfinite(cost)].max(initial=0.0)), *(link.cost for link in links)]) + 1
    if not links:
        return []
    exchanges = Exchanges(links, cost, float(max_cost))
    return [min(max(rise / max_cost, 0.0), 1.0) for rise in exchanges.rises_without(allow_rings)]


class Exchanges:
    """Other matchings of the ends, in which up to three links are exchanged. Row -1, the last of the arrays, is no end.

    Attributes
    ----------
    free
        cost of leaving two ends free.
    pairs
        the ends of each link.
    total
        (E + 1, E + 1), cost of each pair; half of `free` with no end.
    partner, loss
        (E + 1,), the end that each end is linked to, -1 for none, and what that costs of the total.
    host, alone
        (E + 1,), the free end to which each end would be linked if it lost its partner, -1 for none, and the cost of that.
    """

    def __init__(self, links: Sequence[Link], cost: Floats, free: float) -> None:
        """Prepare the exchanges; links, cost : as for `confidences`."""
        count = len(cost)
        self.free, self.pairs = free, [link.rows for link in links]
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

    def rises_without(self, allow_rings: bool) -> list[float]:
        """Return the least rise of the total cost without each link, of its ends a and b.

        Then a is linked to c and b to d, or to no end. Their partners e and f are linked to each other, to the free ends g and h,
        or to no end. All exchanges of all links are weighed at once: (L, A + 1, A + 1) for A alternatives each.
        """
        a, b = np.array(self.pairs).T[:, :, None, None]
        c, d = self._others(a), self._others(b).swapaxes(1, 2)
        e, f = self.partner[c], self.partner[d]
        g, h = np.where(self.host[e] == d, -1, self.host[e]), np.where(self.host[f] == c, -1, self.host[f])
        h = np.where(h == g, -1, h)
        swap = (e == d) & (d >= 0)
        meet = (e >= 0) & (f >= 0) & ~swap & (self.total[e, f] < self.free)
        apart = sum(np.where(other < 0, self.free / 2 * (end >= 0), self.alone[end]) for end, other in ((e, g), (f, h)))
        rise = self.total[a, c] + self.total[b, d] - self.total[a, b] - self.loss[c] - self.loss[d]
        rise = rise + np.where(meet, self.total[e, f], apart)
        rise = np.where((c == d) & (c >= 0), np.inf, rise)
        rise = np.where(swap, self.total[a, c] + self.total[b, d] - self.total[a, b] - self.loss[c], rise)
        every = [each.reshape(len(rise), -1) for each in np.broadcast_arrays(c, d, e, f, g, h, swap, meet)]

        def pairs_after(link: int, k: int) -> list[Rows]:
            to_c, to_d, of_c, of_d, host_e, host_f, swaps, meets = (int(each[link, k]) for each in every)
            left = [] if swaps else [(of_c, of_d)] if meets else [(of_c, host_e), (of_d, host_f)]
            made = [made for made in [(self.pairs[link][0], to_c), (self.pairs[link][1], to_d), *left] if min(made) >= 0]
            return [other for other in self.pairs if {*self.pairs[link], to_c, to_d}.isdisjoint(other)] + made

        least = []
        for link, own in enumerate(rise.reshape(len(rise), -1)):
            order = np.argsort(own, kind="stable").tolist()
            least.append(next(float(own[k]) for k in order if allow_rings or not find_rings(pairs_after(link, k))))
        return least

    def _others(self, ends: Ints) -> Ints:
        """Return the ends that each of L linked ends (L, 1, 1) may be linked to instead, the cheapest first, (L, A, 1).

        The last is -1, no end; fewer than A are padded with -1.
        """
        rows = ends.ravel()
        total = self.total[rows, :-1].copy()
        total[np.arange(len(rows)), rows] = total[np.arange(len(rows)), self.partner[rows]] = np.inf
        promise = np.where(np.isfinite(total), total - self.loss[:-1] + self.alone[self.partner[:-1]], np.inf)
        order = np.argsort(promise, axis=1, kind="stable")[:, :MAX_ALTERNATIVES]
        others = np.where(np.isfinite(np.take_along_axis(total, order, axis=1)), order, -1)
        return np.pad(others, ((0, 0), (0, 1)), constant_values=-1)[:, :, None]
