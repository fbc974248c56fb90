"""Choose connections among all pairs of ends, given their costs.

By the greedy rule of Keipour et al. (RA-L 2022), or by a global matching.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...config import MergeConfig
from ...types import Floats
from .costs import FORCED_COST_FACTOR
from .ends import End, Pair, ends_of
from .matching import maximum_weight_matching

GapCosts = Callable[[Sequence[Pair]], list[float]]
"""Costs of the gap paths of pairs, on top of the costs that are known of all pairs; never negative."""

FORCED_MIN_LENGTH_RATIO = 0.1
"""Fraction of the longest chain's length below which a chain is not joined by force: it is clutter rather than a part."""


class Link(NamedTuple):
    """A connection (join) of two chain ends and its cost. Links sort by cost.

    Attributes
    ----------
    cost
        in cost units: 1 per mm of gap (1 per px in 2-D), plus angles in radians times their weights (section `merge` of the
        settings).
    first, second
        the two ends. `first` has the lower chain number or, in one chain, side 0.
    """

    cost: float
    first: End
    second: End

    @property
    def pair(self) -> Pair:
        """The two ends, (first, second)."""
        return self.first, self.second


class ChainGroups:
    """The grouping of chains into connected groups: chains connected directly or through other chains share a group.

    Attributes
    ----------
    group
        for each chain the number of its group. Numbers are arbitrary; equal numbers mean the same group.
    """

    def __init__(self, count: int, links: Iterable[Link] = ()) -> None:
        """Put each of `count` chains in a group of its own, then unite the groups that the links connect."""
        self.group = list(range(count))
        for link in links:
            self.join(link.pair)

    def __len__(self) -> int:
        """Return the number of groups."""
        return len(set(self.group))

    def of(self, end: End) -> int:
        """Return the number of the group of connected chains to which the chain of an end belongs."""
        return self.group[end.chain]

    def join(self, pair: Pair) -> None:
        """Unite the groups of the two chains whose ends are given; changes the grouping in place."""
        kept, gone = self.of(pair[0]), self.of(pair[1])
        self.group = [kept if group == gone else group for group in self.group]

    def large(self, sizes: Sequence[int]) -> set[int]:
        """Return the numbers of the groups that have at least a tenth as many segments as the largest group.

        Parameters
        ----------
        sizes
            number of segments of each chain.
        """
        total = dict.fromkeys(self.group, 0)
        for group, size in zip(self.group, sizes, strict=True):
            total[group] += size
        return {group for group in total if total[group] >= FORCED_MIN_LENGTH_RATIO * max(total.values())}


def assign(cost: Floats, sizes: Sequence[int], gap_costs: GapCosts, config: MergeConfig) -> list[Link]:
    """Choose which chain ends to connect, by the configured strategy.

    Each connection costs at most `max_cost`. If `chains` is set and more chains are left, further connections are forced, each of
    which may cost up to three times `max_cost`.

    Parameters
    ----------
    cost
        (E, E) cost units, cost of connecting each pair of E ends, without the gap path. Only entries [i, j] with i < j are used;
        infinite where a connection is not allowed.
    sizes
        number of segments of each chain.
    gap_costs
        function from pairs of ends to the costs of their gap paths, which are added to `cost` and are not negative.
    config
        section `merge` of the settings: `strategy`, `chains`, `max_cost`, `allow_closed_chains`.

    Returns
    -------
    The chosen connections, each with its cost including the gap path; no end is in two of them.
    """
    links = STRATEGIES[config.strategy](np.where(cost <= config.max_cost, cost, np.inf), gap_costs, config)
    if config.chains is not None:
        links += force_merges(links, cost, sizes, gap_costs, config)
    return links


def _greedy(cost: Floats, gap_costs: GapCosts, config: MergeConfig) -> list[Link]:
    """Join the cheapest pair first, as Keipour et al. (RA-L 2022) do.

    Gap paths only ever add to a cost, so only the gap path of the pair that would be next is made.
    """
    groups = ChainGroups(len(cost) // 2)
    used: set[End] = set()
    links: list[Link] = []
    rings: list[Link] = []
    heap = [(link, False) for link in _finite(cost)]
    heapq.heapify(heap)
    while heap:
        link, is_complete = heapq.heappop(heap)
        if link.first in used or link.second in used:
            continue
        if not is_complete:
            complete = _with_gap(link, gap_costs)
            if complete.cost <= config.max_cost:
                heapq.heappush(heap, (complete, True))
        elif groups.of(link.first) == groups.of(link.second):
            rings.append(link)
        elif config.chains is None or len(groups) > config.chains:
            used |= set(link.pair)
            links.append(link)
            groups.join(link.pair)
    return links + [ring for ring in rings if config.allow_closed_chains and not used & set(ring.pair)]


def _global(cost: Floats, gap_costs: GapCosts, config: MergeConfig) -> list[Link]:
    """Choose the connections with the largest total of (max_cost - cost): a maximum-weight matching of the ends.

    Only the gap paths of pairs that a matching chose are made, and the matching then made again: as they only add to a cost,
    nothing better is missed. A matching that closes a ring is made again without the costliest of the ring's connections,
    unless rings are allowed. If a number of chains is wanted and fewer are left, the costliest connections are undone.
    """
    total = np.minimum(cost, cost.T)
    limit = config.max_cost if np.isfinite(config.max_cost) else 2 * float(total[np.isfinite(total)].max(initial=0.0)) + 1
    complete: set[Pair] = set()
    while True:
        pairs = _matched_pairs(total, limit)
        new = [pair for pair in pairs if pair not in complete]
        complete |= set(new)
        if _add_gap_costs(total, new, gap_costs):
            continue
        ring = None if config.allow_closed_chains else find_ring(pairs)
        if ring is None:
            break
        a, b = max(ring, key=lambda pair: float(total[pair[0].index, pair[1].index]))
        total[a.index, b.index] = total[b.index, a.index] = np.inf
    links = sorted(Link(float(total[a.index, b.index]), a, b) for a, b in pairs)
    if config.chains is None:
        return links
    rings = 0 if find_ring(pairs) is None else 1
    surplus = len(links) - rings - (len(cost) // 2 - config.chains)
    return links[: len(links) - max(0, surplus)]


STRATEGIES: dict[str, Callable[[Floats, GapCosts, MergeConfig], list[Link]]] = {"greedy": _greedy, "global": _global}


def force_merges(
    links: Sequence[Link], cost: Floats, sizes: Sequence[int], gap_costs: GapCosts, config: MergeConfig
) -> list[Link]:
    """Choose further connections, the cheapest first, until `config.chains` groups of connected chains are left.

    Each connection may cost up to FORCED_COST_FACTOR (3) times `max_cost`. A group with less than a tenth as many segments as the
    largest group is not connected: it is probably clutter.

    Parameters
    ----------
    links
        the connections chosen before.
    cost
        (E, E) cost units, cost of connecting each pair of E ends, without the gap path. Only entries [i, j] with i < j are used;
        infinite where a connection is not allowed.
    sizes
        number of segments of each chain.
    gap_costs
        function from pairs of ends to the costs of their gap paths, which are added to `cost` and are not negative.
    config
        section `merge` of the settings: `chains` (1 if not set) and `max_cost`.

    Returns
    -------
    The further connections, without `links`. There are too few of them if no other connection is cheap enough.
    """
    groups = ChainGroups(len(sizes), links)
    used = {end for link in links for end in link.pair}
    candidates = sorted(_finite(cost))
    forced: list[Link] = []
    while len(groups) > (config.chains or 1):
        large = groups.large(sizes)
        allowed = (
            link
            for link in candidates
            if not used & set(link.pair)
            and groups.of(link.first) != groups.of(link.second)
            and {groups.of(link.first), groups.of(link.second)} <= large
        )
        link = _cheapest(allowed, gap_costs, config.max_cost * FORCED_COST_FACTOR)
        if link is None:
            break
        used |= set(link.pair)
        forced.append(link)
        groups.join(link.pair)
    return forced


def _cheapest(candidates: Iterable[Link], gap_costs: GapCosts, limit: float) -> Link | None:
    """Return the candidate that costs least with its gap path, if that is below the limit; candidates are sorted by cost."""
    best = None
    for link in candidates:
        if link.cost >= (limit if best is None else best.cost):
            break
        complete = _with_gap(link, gap_costs)
        if complete.cost < limit and (best is None or complete < best):
            best = complete
    return best


def find_ring(pairs: Sequence[Pair]) -> list[Pair] | None:
    """Return the connections that together close a ring of chains (the first ring found); None if there is no ring.

    Parameters
    ----------
    pairs
        connections, each of two chain ends, the lower first; no end is in two of them.
    """
    partner = {a: b for a, b in pairs} | {b: a for a, b in pairs}
    visited: set[End] = set()
    for start, _ in pairs:
        ring: list[Pair] = []
        end = start
        while end in partner and end not in visited:
            visited.add(end)
            ring.append((min(end, partner[end]), max(end, partner[end])))
            end = partner[end].other
        if ring and end == start:
            return ring
    return None


def _finite(cost: Floats) -> list[Link]:
    """Return the pairs of ends that may be joined, with their costs from (E, E)."""
    ends = ends_of(len(cost) // 2)
    return [Link(float(cost[a, b]), ends[a], ends[b]) for a, b in zip(*np.nonzero(np.isfinite(cost)), strict=True)]


def _with_gap(link: Link, gap_costs: GapCosts) -> Link:
    """Return the link with the cost of its gap path added."""
    return link._replace(cost=link.cost + gap_costs([link.pair])[0])


def _matched_pairs(total: Floats, limit: float) -> list[Pair]:
    """Return the maximum-weight matching of the ends, the weight being what a connection costs less than the limit."""
    partner = maximum_weight_matching(np.maximum(limit - total, 0.0)).tolist()
    ends = ends_of(len(total) // 2)
    return [(ends[a], ends[b]) for a, b in enumerate(partner) if a < b]


def _add_gap_costs(total: Floats, pairs: Sequence[Pair], gap_costs: GapCosts) -> bool:
    """Add the costs of the gap paths of pairs to `total` (E, E), and tell whether any is above zero."""
    added = gap_costs(pairs)
    for (a, b), cost in zip(pairs, added, strict=True):
        total[a.index, b.index] += cost
        total[b.index, a.index] = total[a.index, b.index]
    return any(added)
