"""Maximum-weight matching: pairs of ends with the largest total weight, each end in one pair at most."""

from __future__ import annotations

import numba
import numpy as np

from ..errors import require
from ..types import Floats, Ints
from ._jit import helper

MAX_SUBSET_ENDS = 16
"""Ends of a connected component up to which all its subsets are tried: 2.5 times as fast as Edmonds' blossoms for 16 ends of a
tangle (0.35 ms against 0.95 ms), no faster from 17."""


@helper
def _heaviest(weight, unsettled, a):  # type: ignore[no-untyped-def]
    """Return the heaviest partner of an end among the unsettled, -1 for none, its weight, and the second largest weight."""
    b, largest, second = -1, 0.0, 0.0
    for end in range(len(weight)):
        if unsettled[end] and weight[a, end] > largest:
            b, largest, second = end, weight[a, end], largest
        elif unsettled[end] and weight[a, end] > second:
            second = weight[a, end]
    return b, largest, second


@helper
def _largest_beside(weight, unsettled, a, b):  # type: ignore[no-untyped-def]
    """Return the largest weight of b with an unsettled end other than a."""
    largest = 0.0
    for end in range(len(weight)):
        if unsettled[end] and end != a and weight[b, end] > largest:
            largest = weight[b, end]
    return largest


@helper
def _label_components(weight, unsettled):  # type: ignore[no-untyped-def]
    """Label the connected components of the unsettled ends, (E,) int64; -1 where an end is settled."""
    count = len(weight)
    component = np.full(count, -1)
    stack = np.empty(count, np.int64)
    components = 0
    for seed in range(count):
        if not unsettled[seed] or component[seed] >= 0:
            continue
        component[seed] = components
        stack[0] = seed
        size = 1
        while size:
            size -= 1
            a = stack[size]
            for b in range(count):
                if unsettled[b] and weight[a, b] > 0 and component[b] < 0:
                    component[b] = components
                    stack[size] = b
                    size += 1
        components += 1
    return component


@numba.njit(cache=True)
def settle_dominant_pairs(weight):  # type: ignore[no-untyped-def]
    """Pair the ends whose pair belongs to a maximum-weight matching whatever the rest of the matching is.

    A pair dominates if it weighs at least as much as the best other pair of its one end and the best other pair of its other end
    together: in a matching without it, it can replace those two. Without the ends of settled pairs more pairs dominate, so the
    search repeats until none is settled.

    weight : (E, E) float64, symmetric, 0 where there is no pair.

    Returns
    -------
    partner : (E,) int64, the end that each is paired with, -1 for none
    component : (E,) int64, the connected component of the unsettled ends to which each belongs, -1 for a settled end
    """
    count = len(weight)
    partner = np.full(count, -1)
    unsettled = np.ones(count, np.bool_)
    changed = True
    while changed:
        changed = False
        for a in range(count):
            if not unsettled[a]:
                continue
            b, largest, second = _heaviest(weight, unsettled, a)
            if b < 0:
                unsettled[a] = False
            elif largest >= second + _largest_beside(weight, unsettled, a, b):
                partner[a], partner[b] = b, a
                unsettled[a] = unsettled[b] = False
                changed = True
    return partner, _label_components(weight, unsettled)


@numba.njit(cache=True)
def match_by_subsets(weight):  # type: ignore[no-untyped-def]
    """Return a maximum-weight matching by dynamic programming over all subsets of the ends.

    The best total of a subset, a bit set, is that without its last end, or that of the last end with one of the others plus the
    best total without both. The pairs are then read back from the full set. Time and memory grow as 2^E.

    weight : (E, E) float64, symmetric, 0 where there is no pair. Returns (E,) int64, the end that each is paired with, -1 for
    none.
    """
    count = len(weight)
    total = np.zeros(1 << count)
    for last in range(count):
        possible = np.flatnonzero(weight[last, :last])
        for rest in range(1 << last):
            most = total[rest]
            for end in possible:
                if rest >> end & 1:
                    most = max(most, total[rest ^ 1 << end] + weight[last, end])
            total[rest | 1 << last] = most
    partner = np.full(count, -1)
    chosen = (1 << count) - 1
    for last in range(count - 1, -1, -1):
        if not chosen >> last & 1:
            continue
        most = total[chosen]
        chosen ^= 1 << last
        if most == total[chosen]:
            continue
        for other in range(last):
            if chosen >> other & 1 and total[chosen ^ 1 << other] + weight[last, other] >= most:
                partner[last], partner[other] = other, last
                chosen ^= 1 << other
                break
    return partner


def maximum_weight_matching(weight: Floats) -> Ints:
    """Return a maximum-weight matching.

    Dominant pairs are settled first. The rest, often nothing, falls into connected components: small ones are matched by all
    their subsets, larger ones by Edmonds' blossom algorithm (networkx). 20 times as fast as networkx.max_weight_matching alone
    on the ends of knots (0.006 ms against 0.14 ms), which are matched again for every connection whose cost proves higher than
    expected.

    weight : (E, E), symmetric, 0 where two ends may not be paired. Returns (E,) the end that each is paired with, -1 for none.
    """
    partner: Ints
    partner, component = settle_dominant_pairs(weight)
    for number in range(component.max(initial=-1) + 1):
        members = np.flatnonzero(component == number)
        sub = weight[np.ix_(members, members)]
        local = match_by_subsets(sub) if len(members) <= MAX_SUBSET_ENDS else _match_by_blossoms(sub)
        paired = local >= 0
        partner[members[paired]] = members[local[paired]]
    return partner


def _match_by_blossoms(weight: Floats) -> Ints:
    nx = require("networkx")
    graph = nx.Graph()
    graph.add_weighted_edges_from((a, b, weight[a, b]) for a, b in np.argwhere(np.triu(weight) > 0).tolist())
    partner = np.full(len(weight), -1)
    for a, b in nx.max_weight_matching(graph):
        partner[a], partner[b] = b, a
    return partner
