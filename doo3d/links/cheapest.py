"""Link the cheapest pair of ends first, as Keipour et al. (RA-L 2022) do, down to a number of chains."""

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from ..geometry.disjoint_set import DisjointSet
from ..geometry.limits import AT_ONCE
from ..types import Bools, Floats, Ints
from .ends import End, Link, Pair, ends_of

GapCosts = Callable[[Sequence[Pair]], list[float]]
"""Function from pairs of ends to the costs of their gap paths, which are never negative."""

Rows: TypeAlias = "Ints | int"
"""Rows of ends in arrays over all ends of all chains: (K,), or one."""

MIN_LENGTH_RATIO = 0.1
"""Share of the longest group's segments below which a group of chains is clutter, and not linked to reach a number of chains."""

NO_LINK = Link(np.inf, End(0, 0), End(0, 0))
"""A link that sorts behind all others."""


class Groups(DisjointSet):
    """The links chosen so far, and the groups of chains that they connect.

    Attributes
    ----------
    links
        the links, in the order in which they were added.
    used
        (E,) bool, True for an end that is linked.
    is_large
        (C,) bool, True for a chain whose group has at least a tenth as many segments as the largest one.
    """

    def __init__(self, sizes: Sequence[int] | Ints, links: Iterable[Link] = ()) -> None:
        """Put each of C chains in a group of its own, then add links; sizes : (C,), the number of segments of each chain."""
        super().__init__(range(len(sizes)))
        self.sizes, self.used = sizes, np.zeros(2 * len(sizes), dtype=bool)
        self.links: list[Link] = []
        self._compare()
        for link in links:
            self.add(link)

    def add(self, link: Link) -> None:
        """Add a link, and unite the groups of its two chains."""
        self.links.append(link)
        self.used[list(link.rows)] = True
        if self.join(link.first.chain, link.second.chain):
            self._compare()

    def _compare(self) -> None:
        total = np.bincount(self.group, weights=self.sizes)
        self.is_large: Bools = (total >= MIN_LENGTH_RATIO * total.max())[self.group]

    def are_apart(self, first: Rows, second: Rows) -> Bools:
        """Return which pairs of ends, given by their rows, are in two groups: (K,) bool."""
        return np.asarray(self.group[first // 2] != self.group[second // 2])

    def are_linkable(self, first: Rows, second: Rows) -> Bools:
        """Return which pairs of ends, given by their rows, are free and in large groups: (K,) bool."""
        large = self.is_large[first // 2] & self.is_large[second // 2]
        return np.asarray(~(self.used[first] | self.used[second]) & large)


def cheapest_first(
    groups: Groups, cost: Floats, gap_costs: GapCosts, limit: float, fewest: int, allow_rings: bool = False
) -> list[Link]:
    """Add links to groups of chains, the cheapest first, and return all their links.

    Gap paths only ever add to a cost, so only the gap path of the pair that would be next is made.

    Parameters
    ----------
    groups
        the groups of the links chosen before, which the new links unite.
    cost
        (E, E) cost units, cost of linking each pair of E ends, without the gap path. Only entries [i, j] with i < j are used;
        infinite where a link is not allowed.
    gap_costs
        function from pairs of ends to the costs of their gap paths, which are added to `cost`.
    limit
        cost units, the largest cost of a link with its gap path.
    fewest
        number of groups at which no others are united.
    allow_rings
        True also links the two free ends of a group to a ring, after all others.
    """
    complete: list[Link] = []
    rings: list[Link] = []

    def is_possible(first: Rows, second: Rows) -> Bools:
        linkable = groups.are_linkable(first, second)
        return linkable if allow_rings else linkable & groups.are_apart(first, second)

    def decide(following: Link) -> None:
        while complete and complete[0] < following:
            link = heapq.heappop(complete)
            if link.cost > limit or not groups.are_linkable(*link.rows):
                continue
            if not groups.are_apart(*link.rows):
                rings.append(link)
            elif len(groups) > fewest:
                groups.add(link)

    for link in _sorted_pairs(np.where(cost <= limit, cost, np.inf), is_possible):
        decide(link)
        if len(groups) <= fewest and not allow_rings:
            break
        if is_possible(*link.rows):
            heapq.heappush(complete, link._replace(cost=link.cost + gap_costs([link.pair])[0]))
    decide(NO_LINK)
    for ring in rings if allow_rings else ():
        if groups.are_linkable(*ring.rows):
            groups.add(ring)
    return groups.links


def _sorted_pairs(cost: Floats, is_possible: Callable[[Rows, Rows], Bools]) -> Iterator[Link]:
    """Yield the pairs of a finite cost, the cheapest first, without those that are not possible when their part is reached."""
    first, second = np.nonzero(np.isfinite(cost))
    order = np.argsort(cost[first, second], kind="stable")
    ends = ends_of(len(cost) // 2)
    for start in range(0, len(order), AT_ONCE):
        part = order[start : start + AT_ONCE]
        for i in part[is_possible(first[part], second[part])].tolist():
            yield Link(float(cost[first[i], second[i]]), ends[first[i]], ends[second[i]])
