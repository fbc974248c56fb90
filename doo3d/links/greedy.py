"""Join the cheapest pair of ends first: the strategy of Keipour et al. (RA-L 2022)."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from ..config import MergeConfig
from ..geometry.disjoint_set import DisjointSet
from ..geometry.limits import AT_ONCE
from ..types import Array, Bools, Floats, Ints
from .candidates import End, Link, Pair, ends_of

GapCosts = Callable[[Sequence[Pair]], list[float]]
"""Costs of the gap paths of pairs, on top of the costs that are known of all pairs; never negative."""

FORCED_MIN_LENGTH_RATIO = 0.1
"""Fraction of the longest chain's length below which a chain is not joined by force: it is clutter rather than a part."""


class ChainGroups(DisjointSet):
    """The grouping of chains into connected groups: chains connected directly or through other chains share a group."""

    def __init__(self, count: int, links: Iterable[Link] = ()) -> None:
        """Put each of `count` chains in a group of its own, then unite the groups that the links connect."""
        super().__init__(range(count))
        for link in links:
            self.join(link.first.chain, link.second.chain)

    def of(self, end: End) -> int:
        """Return the number of the group of connected chains to which the chain of an end belongs."""
        return int(self.group[end.chain])

    def are_apart(self, first: Ints, second: Ints) -> Bools:
        """Tell which pairs of ends, given by two arrays of their indices (K,), are in two groups: (K,) bool."""
        return np.asarray(self.group[first // 2] != self.group[second // 2])

    def in_large(self, sizes: Sequence[int]) -> Bools:
        """Tell which chains are in a group that has at least a tenth as many segments as the largest group: (C,) bool.

        Parameters
        ----------
        sizes
            number of segments of each chain.
        """
        total = np.bincount(self.group, weights=sizes)
        return np.asarray(total[self.group] >= FORCED_MIN_LENGTH_RATIO * total.max())


class CheapestFirst:
    """The pairs of ends that may be joined, the cheapest first; of equal cost in the order of `Link`."""

    def __init__(self, cost: Floats) -> None:
        self.first, self.second = np.nonzero(np.isfinite(cost))
        self.cost = cost[self.first, self.second]
        self._keep(np.argsort(self.cost, kind="stable"))
        self.ends = ends_of(len(cost) // 2)

    def __len__(self) -> int:
        return len(self.cost)

    def _keep(self, rows: Array) -> None:
        self.first, self.second, self.cost = self.first[rows], self.second[rows], self.cost[rows]

    def select(self, is_possible: Callable[[Ints, Ints], Bools]) -> Iterator[Link]:
        """Yield the pairs for which `is_possible` holds, given the indices of their ends, each part of the list anew."""
        for start in range(0, len(self), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            for i in start + np.flatnonzero(is_possible(self.first[part], self.second[part])):
                yield Link(float(self.cost[i]), self.ends[self.first[i]], self.ends[self.second[i]])

    def drop(self, is_possible: Callable[[Ints, Ints], Bools]) -> None:
        """Forget all pairs for which `is_possible` does not hold."""
        self._keep(np.flatnonzero(is_possible(self.first, self.second)))


def greedy(cost: Floats, gap_costs: GapCosts, config: MergeConfig) -> list[Link]:
    """Join the cheapest pair first, as Keipour et al. (RA-L 2022) do.

    Gap paths only ever add to a cost, so only the gap path of the pair that would be next is made.
    """
    groups = ChainGroups(len(cost) // 2)
    used = np.zeros(len(cost), dtype=bool)
    links: list[Link] = []
    rings: list[Link] = []
    complete: list[Link] = []

    def is_possible(first: Ints, second: Ints) -> Bools:
        free = ~(used[first] | used[second])
        return free if config.allow_closed_chains else free & groups.are_apart(first, second)

    def join_complete(limit: Link | None) -> None:
        while complete and (limit is None or complete[0] < limit):
            link = heapq.heappop(complete)
            if used[link.first.row] or used[link.second.row]:
                continue
            if groups.of(link.first) == groups.of(link.second):
                rings.append(link)
            elif config.chains is None or len(groups) > config.chains:
                used[[link.first.row, link.second.row]] = True
                links.append(link)
                groups.join(link.first.chain, link.second.chain)

    for link in CheapestFirst(cost).select(is_possible):
        join_complete(link)
        if used[link.first.row] or used[link.second.row]:
            continue
        if not config.allow_closed_chains and len(groups) <= (config.chains or 1):
            break
        whole = with_gap(link, gap_costs)
        if whole.cost <= config.max_cost:
            heapq.heappush(complete, whole)
    join_complete(None)
    return links + [ring for ring in rings if config.allow_closed_chains and not used[[ring.first.row, ring.second.row]].any()]


def with_gap(link: Link, gap_costs: GapCosts) -> Link:
    """Return the link with the cost of its gap path added."""
    return link._replace(cost=link.cost + gap_costs([link.pair])[0])
