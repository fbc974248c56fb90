"""Choose links among all pairs of ends, given their costs: the matching of the least total cost, and links that are forced."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

import numpy as np

from ..config import MergeConfig
from ..types import Bools, Floats, Ints
from .candidates import FORCED_COST_FACTOR, End, Link
from .greedy import ChainGroups, CheapestFirst, GapCosts, greedy, with_gap
from .matching import find_rings, heaviest_matching

StraightGaps: TypeAlias = "Callable[[Floats], Floats] | None"
"""Function from costs (E, E) without gap paths to costs with straight gaps; or None."""

MAX_GAP_PATHS = 2000
"""Gap paths at most that are made to find the best matching: each takes 0.1 ms. A frame of an object needs some hundreds."""


def solve(
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
    if config.strategy == "greedy":
        links = greedy(allowed, gap_costs, config)
    else:
        links = _global(allowed, gap_costs, config, with_straight_gaps)
    if config.chains is not None:
        links += force_merges(links, cost, sizes, forced_gap_costs or gap_costs, config)
    return links


def _global(cost: Floats, gap_costs: GapCosts, config: MergeConfig, with_straight_gaps: StraightGaps = None) -> list[Link]:
    """Choose the connections with the largest total of (max_cost - cost): a maximum-weight matching of the ends.

    Only the gap paths of pairs that a matching chose are made, and the matching then made again: as they only add to a cost,
    nothing better is missed. After MAX_GAP_PATHS of them all other gaps are taken as straight. A matching that closes rings is
    made again without the costliest connection of each, unless rings are allowed. If a number of chains is wanted and
    fewer are left, the costliest connections are undone.
    """
    total = cost.copy()
    limit = config.max_cost if np.isfinite(config.max_cost) else 2 * float(total[np.isfinite(total)].max(initial=0.0)) + 1
    complete = np.zeros(total.shape, dtype=bool)
    while True:
        pairs = heaviest_matching(limit - total)
        missing = [pair for pair in pairs if not complete[pair]]
        if missing and with_straight_gaps is not None and np.count_nonzero(complete) + len(missing) > MAX_GAP_PATHS:
            others = np.isfinite(total) & ~complete
            total[others] += with_straight_gaps(cost)[others] - cost[others]
            complete[:] = True
            continue
        added = gap_costs([(_end(a), _end(b)) for a, b in missing])
        for pair, gap_cost in zip(missing, added, strict=True):
            complete[pair] = True
            total[pair] += gap_cost
        rings = [] if config.allow_closed_chains or any(added) else find_rings(pairs)
        for ring in rings:
            total[max(ring, key=lambda pair: float(total[pair]))] = np.inf
        if not (any(added) or rings):
            break
    links = sorted(Link(float(total[a, b]), _end(a), _end(b)) for a, b in pairs)
    if config.chains is None:
        return links
    surplus = len(links) - len(find_rings(pairs)) - (len(cost) // 2 - config.chains)
    return links[: len(links) - max(0, surplus)]


def _end(row: int) -> End:
    """Return the end at a row of arrays over all ends of all chains."""
    return End(*divmod(row, 2))


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
    candidates = CheapestFirst(cost)

    def is_possible(first: Ints, second: Ints) -> Bools:
        return np.asarray(~(used[first] | used[second]) & groups.are_apart(first, second))

    def are_large(first: Ints, second: Ints) -> Bools:
        return np.asarray(large[first // 2] & large[second // 2])

    while len(groups) > (config.chains or 1):
        large = groups.in_large(sizes)
        candidates.drop(is_possible)
        link = _cheapest(candidates.select(are_large), gap_costs, config.max_cost * FORCED_COST_FACTOR)
        if link is None:
            break
        used[[link.first.row, link.second.row]] = True
        forced.append(link)
        groups.join(link.first.chain, link.second.chain)
    return forced


def _cheapest(candidates: Iterable[Link], gap_costs: GapCosts, limit: float) -> Link | None:
    """Return the candidate that costs least with its gap path, if that is below the limit; candidates are sorted by cost."""
    best = None
    for link in candidates:
        if link.cost >= (limit if best is None else best.cost):
            break
        complete = with_gap(link, gap_costs)
        if complete.cost < limit and (best is None or complete < best):
            best = complete
    return best
