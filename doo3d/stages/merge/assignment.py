"""Choose connections among all pairs of ends, given their costs.

By the greedy rule of Keipour et al. (RA-L 2022), or by a global matching.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ...config import MergeConfig
from ...geometry.disjoint_set import DisjointSet
from ...geometry.limits import AT_ONCE
from ...kernels import match_by_blossoms
from ...types import Array, Bools, Floats, Ints
from .costs import FORCED_COST_FACTOR
from .ends import End, Pair, ends_of

GapCosts = Callable[[Sequence[Pair]], list[float]]
"""Costs of the gap paths of pairs, on top of the costs that are known of all pairs; never negative."""

StraightGaps: TypeAlias = "Callable[[Floats], Floats] | None"
"""Function from costs (E, E) without gap paths to costs with straight gaps; or None."""

MAX_GAP_PATHS = 2000
"""Gap paths at most that are made to find the best matching: each takes 0.1 ms. A frame of an object needs some hundreds."""

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


class _Candidates:
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


def assign(
    cost: Floats,
    sizes: Sequence[int],
    gap_costs: GapCosts,
    config: MergeConfig,
    with_straight_gaps: StraightGaps = None,
    forced_gap_costs: GapCosts | None = None,
) -> list[Link]:
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
    with_straight_gaps
        function from `cost` to the costs (E, E) with those of straight gaps added. The strategy `global` takes them for all pairs
        that are left when it has made MAX_GAP_PATHS (2000) gap paths; None makes all the gap paths it needs.
    forced_gap_costs
        as `gap_costs`, for connections that `chains` forces: infinite for those that may not be forced. None takes `gap_costs`.

    Returns
    -------
    The chosen connections, each with its cost including the gap path; no end is in two of them.
    """
    allowed = np.where(cost <= config.max_cost, cost, np.inf)
    links = STRATEGIES[config.strategy](allowed, gap_costs, config, with_straight_gaps)
    if config.chains is not None:
        links += force_merges(links, cost, sizes, forced_gap_costs or gap_costs, config)
    return links


def _greedy(cost: Floats, gap_costs: GapCosts, config: MergeConfig, _: StraightGaps = None) -> list[Link]:
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

    for link in _Candidates(cost).select(is_possible):
        join_complete(link)
        if used[link.first.row] or used[link.second.row]:
            continue
        if not config.allow_closed_chains and len(groups) <= (config.chains or 1):
            break
        with_gap = _with_gap(link, gap_costs)
        if with_gap.cost <= config.max_cost:
            heapq.heappush(complete, with_gap)
    join_complete(None)
    return links + [ring for ring in rings if config.allow_closed_chains and not used[[ring.first.row, ring.second.row]].any()]


def _global(cost: Floats, gap_costs: GapCosts, config: MergeConfig, with_straight_gaps: StraightGaps = None) -> list[Link]:
    """Choose the connections with the largest total of (max_cost - cost): a maximum-weight matching of the ends.

    Only the gap paths of pairs that a matching chose are made, and the matching then made again: as they only add to a cost,
    nothing better is missed. After MAX_GAP_PATHS of them all other gaps are taken as straight. A matching that closes a ring is
    made again without the costliest of the ring's connections, unless rings are allowed. If a number of chains is wanted and
    fewer are left, the costliest connections are undone.
    """
    total = np.minimum(cost, cost.T)
    limit = config.max_cost if np.isfinite(config.max_cost) else 2 * float(total[np.isfinite(total)].max(initial=0.0)) + 1
    ends = ends_of(len(total) // 2)
    complete: set[Pair] = set()
    pairs: list[Pair] = []
    all_complete = False

    def lowered(partner: Ints) -> tuple[Ints, Floats]:
        nonlocal all_complete
        pairs[:] = [(ends[a], ends[b]) for a, b in enumerate(partner.tolist()) if a < b]
        changed = [] if all_complete else [pair for pair in pairs if pair not in complete]
        if changed and with_straight_gaps is not None and len(complete) + len(changed) > MAX_GAP_PATHS:
            all_complete = True
            rows = _take_straight_gaps(total, cost, with_straight_gaps(cost), complete)
            return rows, np.maximum(limit - total[rows[:, 0], rows[:, 1]], 0.0)
        complete.update(changed)
        if not _add_gap_costs(total, changed, gap_costs):
            ring = None if config.allow_closed_chains else find_ring(pairs)
            if ring is None:
                return np.zeros((0, 2), dtype=np.int64), np.zeros(0)
            a, b = max(ring, key=lambda pair: float(total[pair[0].row, pair[1].row]))
            total[a.row, b.row] = total[b.row, a.row] = np.inf
            changed = [(a, b)]
        rows = np.array([(a.row, b.row) for a, b in changed])
        return rows, np.maximum(limit - total[rows[:, 0], rows[:, 1]], 0.0)

    match_by_blossoms(np.maximum(limit - total, 0.0), lowered)
    links = sorted(Link(float(total[a.row, b.row]), a, b) for a, b in pairs)
    if config.chains is None:
        return links
    rings = 0 if find_ring(pairs) is None else 1
    surplus = len(links) - rings - (len(cost) // 2 - config.chains)
    return links[: len(links) - max(0, surplus)]


STRATEGIES: dict[str, Callable[[Floats, GapCosts, MergeConfig, StraightGaps], list[Link]]] = {
    "greedy": _greedy,
    "global": _global,
}


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
    used = np.zeros(len(cost), dtype=bool)
    used[[end.row for link in links for end in link.pair]] = True
    forced: list[Link] = []
    if len(groups) <= (config.chains or 1):
        return forced
    candidates = _Candidates(cost)

    def is_possible(first: Ints, second: Ints) -> Bools:
        return np.asarray(~(used[first] | used[second]) & groups.are_apart(first, second))

    def are_large(first: Ints, second: Ints) -> Bools:
        return np.asarray(is_possible(first, second) & large[first // 2] & large[second // 2])

    merges_per_cleanup = 32
    while len(groups) > (config.chains or 1):
        large = groups.in_large(sizes)
        link = _cheapest(candidates.select(are_large), gap_costs, config.max_cost * FORCED_COST_FACTOR)
        if link is None:
            break
        used[[link.first.row, link.second.row]] = True
        forced.append(link)
        groups.join(link.first.chain, link.second.chain)
        if len(forced) % merges_per_cleanup == 0:  # forget the pairs that may no longer be joined
            candidates.drop(is_possible)
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


def _with_gap(link: Link, gap_costs: GapCosts) -> Link:
    """Return the link with the cost of its gap path added."""
    return link._replace(cost=link.cost + gap_costs([link.pair])[0])


def _take_straight_gaps(total: Floats, cost: Floats, straight: Floats, complete: set[Pair]) -> Ints:
    """Add to `total` (E, E) what a straight gap adds to the cost of each pair without a gap path; return these pairs, (K, 2)."""
    allowed = np.isfinite(cost) & np.isfinite(total)
    for a, b in complete:
        allowed[a.row, b.row] = False
    rows = np.argwhere(allowed)
    first, second = rows.T
    total[first, second] += straight[first, second] - cost[first, second]
    total[second, first] = total[first, second]
    return rows


def _add_gap_costs(total: Floats, pairs: Sequence[Pair], gap_costs: GapCosts) -> bool:
    """Add the costs of the gap paths of pairs to `total` (E, E), and tell whether any is above zero."""
    added = gap_costs(pairs)
    for (a, b), cost in zip(pairs, added, strict=True):
        total[a.row, b.row] += cost
        total[b.row, a.row] = total[a.row, b.row]
    return any(added)
