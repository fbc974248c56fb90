"""Choose the links among all pairs of ends, given their costs, and reach the wanted number of chains by the same rule."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from ..config import MergeConfig
from ..types import Floats, Ints
from .cheapest import GapCosts, Groups, cheapest_first
from .ends import FORCED_COST_FACTOR, End, Link
from .matching import find_rings, heaviest_matching

StraightGaps: TypeAlias = "Callable[[Floats], Floats]"
"""Function from costs (E, E) without gap paths to costs with straight gaps."""

MAX_GAP_PATHS = 2000
"""Gap paths at most that are made to find the best matching: each takes 0.1 ms. A frame of an object needs some hundreds."""


def solve(
    cost: Floats,
    sizes: Sequence[int] | Ints,
    gap_costs: GapCosts,
    config: MergeConfig,
    with_straight_gaps: StraightGaps,
    forced_gap_costs: GapCosts,
) -> list[Link]:
    """Choose which chain ends to link, by the configured strategy.

    Of all pairs, or of those of the best matching, the cheapest are linked first, at `max_cost` each at most. If `chains` is set,
    no chains are linked below that number; and while more are left, further links may cost up to FORCED_COST_FACTOR (3) times
    `max_cost`, between chains that are not clutter.

    Parameters
    ----------
    cost
        (E, E) cost units, cost of linking each pair of E ends, without the gap path. Only entries [i, j] with i < j are used;
        infinite where a link is not allowed.
    sizes
        (C,) number of segments of each chain.
    gap_costs
        function from pairs of ends to the costs of their gap paths, which are added to `cost` and are not negative.
    config
        section `merge` of the settings: `strategy`, `chains`, `max_cost`, `allow_closed_chains`.
    with_straight_gaps
        function from `cost` to the costs (E, E) with those of straight gaps added. The strategy `global` takes them for all pairs
        that are left when it has made MAX_GAP_PATHS (2000) gap paths.
    forced_gap_costs
        as `gap_costs`, for links that only the number of chains makes.

    Returns
    -------
    The chosen links, each with its cost including the gap path; no end is in two of them. More chains than wanted are left if no
    other link is cheap enough.
    """
    limit, rings, fewest = config.max_cost, config.allow_closed_chains, config.chains or 1
    allowed, costs_of_gaps = np.where(cost <= limit, cost, np.inf), gap_costs
    if config.strategy == "global":
        allowed, costs_of_gaps = best_matching(allowed, gap_costs, config, with_straight_gaps), _no_costs
    links = cheapest_first(Groups([0] * len(sizes)), allowed, costs_of_gaps, limit, fewest, rings)
    if config.chains is None:
        return links
    return cheapest_first(Groups(sizes, links), cost, forced_gap_costs, FORCED_COST_FACTOR * limit, fewest)


def best_matching(cost: Floats, gap_costs: GapCosts, config: MergeConfig, with_straight_gaps: StraightGaps) -> Floats:
    """Return the cost of the pairs with the largest total of (max_cost - cost), with their gap paths; infinite for all others.

    They are a maximum-weight matching of the ends. Only the gap paths of pairs that a matching chose are made, and the matching
    then made again: as they only add to a cost, nothing better is missed. After MAX_GAP_PATHS of them all other gaps are taken as
    straight. A matching that closes rings is made again without the costliest link of each, unless rings are allowed.

    cost, gap_costs, config, with_straight_gaps : as for `solve`.
    """
    total = cost.copy()
    limit = config.max_cost if np.isfinite(config.max_cost) else 2 * float(total[np.isfinite(total)].max(initial=0.0)) + 1
    complete = np.zeros(total.shape, dtype=bool)
    is_settled = False
    while not is_settled:
        pairs = heaviest_matching(limit - total)
        missing = [pair for pair in pairs if not complete[pair]]
        if missing and np.count_nonzero(complete) + len(missing) > MAX_GAP_PATHS:
            others = np.isfinite(total) & ~complete
            total[others] += with_straight_gaps(cost)[others] - cost[others]
            complete[:] = True
            continue
        added = gap_costs([(End.at(a), End.at(b)) for a, b in missing])
        for pair, gap_cost in zip(missing, added, strict=True):
            complete[pair] = True
            total[pair] += gap_cost
        rings = [] if config.allow_closed_chains or any(added) else find_rings(pairs)
        for ring in rings:
            total[max(ring, key=lambda pair: float(total[pair]))] = np.inf
        is_settled = not (any(added) or rings)
    best = np.full_like(total, np.inf)
    for pair in pairs:
        best[pair] = total[pair]
    return best


def _no_costs(pairs: Sequence[object]) -> list[float]:
    """Return 0 for each pair: the costs of their gap paths are known already."""
    return [0.0] * len(pairs)
