"""Which pairs of chain ends are joined, given what each costs: the paper's way, and all of them together."""

from __future__ import annotations

import heapq
from collections.abc import Callable

import numpy as np

from ...config import MergeConfig
from ...kernels.matching import maximum_weight_matching
from ...types import Floats
from .confidence import Link
from .costs import FORCED_COST_FACTOR

Pair = tuple[int, int]
Price = Callable[[list[Pair]], list[float]]
"""What pairs cost beside what is known of all of them."""


FORCED_MIN_LENGTH_RATIO = 0.1
"""Fraction of the longest chain's length below which a chain is not joined by force: it is clutter rather than a part."""


def _greedy(cost: Floats, extra: Price, config: MergeConfig) -> list[Link]:
    """The paper's rule. Free space only ever adds to a cost, so it is asked for only of the pair that would be next."""
    group = list(range(len(cost) // 2))  # scipy's DisjointSet is no shorter here, and takes 60 ms to import
    used: set[int] = set()
    links: list[Link] = []
    rings: list[Link] = []
    heap = [(float(cost[a, b]), int(a), int(b), False) for a, b in zip(*np.nonzero(np.isfinite(cost)), strict=True)]
    heapq.heapify(heap)
    while heap:
        price, a, b, known = heapq.heappop(heap)
        if a in used or b in used:
            continue
        if not known:
            price += extra([(a, b)])[0]
            if price <= config.max_cost:
                heapq.heappush(heap, (price, a, b, True))
            continue
        one, other = group[a // 2], group[b // 2]
        if one == other:
            rings.append((a, b, price))
        elif config.chains is None or len(set(group)) > config.chains:
            used |= {a, b}
            links.append((a, b, price))
            group = [one if g == other else g for g in group]
    return links + [ring for ring in rings if config.allow_closed_chains and not used & set(ring[:2])]


def _global(cost: Floats, extra: Price, config: MergeConfig) -> list[Link]:
    """The set of connections with the largest total of (max_cost - cost): every end used once at most, no rings unless wanted.

    A maximum-weight matching of the ends. Free space is asked for only of the pairs that a matching chose, and the matching
    then made again: as it only adds to a cost, nothing better is missed. A matching that closes a ring is made again without
    the dearest of the ring's connections. With a number of chains wanted and fewer found, the dearest connections are undone.
    """
    prices = np.minimum(cost, cost.T)
    top = config.max_cost if np.isfinite(config.max_cost) else 2 * float(prices[np.isfinite(prices)].max(initial=0.0)) + 1
    known: set[Pair] = set()
    while True:
        partner = maximum_weight_matching(np.maximum(top - prices, 0.0))
        pairs = [(a, b) for a, b in enumerate(partner.tolist()) if a < b]
        new = [pair for pair in pairs if pair not in known]
        added = extra(new)
        known |= set(new)
        for (a, b), price in zip(new, added, strict=True):
            prices[a, b] += price
            prices[b, a] = prices[a, b]
        if any(added):
            continue
        ring = _ring(pairs) if not config.allow_closed_chains else None
        if ring is None:
            break
        a, b = max(ring, key=lambda pair: float(prices[pair]))
        prices[a, b] = prices[b, a] = np.inf
    links = sorted(((a, b, float(prices[a, b])) for a, b in pairs), key=lambda link: link[2])
    rings = 0 if _ring(pairs) is None else 1
    surplus = len(links) - rings - (len(cost) // 2 - config.chains) if config.chains is not None else 0
    return links[: len(links) - surplus] if surplus > 0 else links


def insist(links: list[Link], cost: Floats, sizes: list[int], extra: Price, config: MergeConfig) -> list[Link]:
    """What more to join where fewer chains are wanted than there are: the cheapest pair, up to `patience` times `max_cost`.

    Only chains that are not small beside the longest: remnants are better dropped. sizes : segments of each chain.
    """
    group = list(range(len(sizes)))
    for a, b, _ in links:
        group = [group[a // 2] if g == group[b // 2] else g for g in group]
    used = {end for a, b, _ in links for end in (a, b)}
    pairs = sorted((float(cost[a, b]), int(a), int(b)) for a, b in zip(*np.nonzero(np.isfinite(cost)), strict=True))
    more: list[Link] = []
    while len(set(group)) > (config.chains or 1):
        size = {g: sum(s for s, of in zip(sizes, group, strict=True) if of == g) for g in set(group)}
        large = {g for g in size if size[g] >= FORCED_MIN_LENGTH_RATIO * max(size.values())}
        best = (config.max_cost * FORCED_COST_FACTOR, -1, -1)
        for price, a, b in pairs:
            if price >= best[0]:
                break
            one, other = group[a // 2], group[b // 2]
            if one != other and not used & {a, b} and {one, other} <= large:
                best = min(best, (price + extra([(a, b)])[0], a, b))
        if best[1] < 0:
            break
        price, a, b = best
        used |= {a, b}
        more.append((a, b, price))
        group = [group[a // 2] if g == group[b // 2] else g for g in group]
    return more


def _ring(pairs: list[Pair]) -> list[Pair] | None:
    """The connections of a ring that they close, if they close one."""
    partner = {a: b for a, b in pairs} | {b: a for a, b in pairs}
    seen: set[int] = set()
    for start, _ in pairs:
        ring, e = [], start
        while e in partner and e not in seen:
            seen.add(e)
            ring.append((min(e, partner[e]), max(e, partner[e])))
            e = partner[e] ^ 1
        if ring and e == start:
            return ring
    return None


STRATEGIES: dict[str, Callable[[Floats, Price, MergeConfig], list[Link]]] = {"greedy": _greedy, "global": _global}
