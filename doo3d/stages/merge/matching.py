"""Maximum-weight matching: pairs of ends with the largest total weight."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...kernels import match_by_blossoms, match_by_subsets, settle_dominant_pairs
from ...types import Floats, Ints

MAX_SUBSET_ENDS = 16
"""Ends of a connected component up to which all its subsets are tried: 2.5 times as fast as Edmonds' blossoms for 16 ends of a
tangle (0.35 ms against 0.95 ms), no faster from 17."""

MAX_SETTLED_ENDS = 128
"""Ends up to which dominant pairs are settled first. Among more of them few pairs dominate, and to begin anew after each change
takes longer than to mend the last matching."""

Lowered = Callable[[Ints], tuple[Ints, Floats]]
"""From a matching (E,) to pairs (K, 2) int64 of ends and their new weights (K,), none larger than before; K = 0 accepts it."""


def maximum_weight_matching(weight: Floats, lowered: Lowered | None = None) -> Ints:
    """Pair E ends so that the total weight of the pairs is largest, each end in at most one pair.

    Up to MAX_SETTLED_ENDS (128) ends, pairs that are in the best matching whatever the rest is are settled first. The rest, often
    nothing, falls into connected components: small ones are matched by trying all subsets, larger ones by Edmonds' blossom
    algorithm. More ends are matched by blossoms at once, and where weights are lowered, the matching before is mended.

    Parameters
    ----------
    weight
        (E, E), weight of each pair, not negative and symmetric; 0 where two ends may not be paired.
    lowered
        is given each matching, and lowers weights, after which the ends are matched again; None accepts the first matching.

    Returns
    -------
    (E,) int64, index of the end that each end is paired with; -1 for an end without a partner.
    """
    if len(weight) > MAX_SETTLED_ENDS:
        return np.asarray(match_by_blossoms(weight, lowered))
    partner = _match_settled(weight)
    if lowered is None:
        return partner
    weight = weight.copy()
    while True:
        pairs, weights = lowered(partner)
        if not len(pairs):
            return partner
        weight[pairs[:, 0], pairs[:, 1]] = weight[pairs[:, 1], pairs[:, 0]] = weights
        partner = _match_settled(weight)


def _match_settled(weight: Floats) -> Ints:
    partner: Ints
    partner, component = settle_dominant_pairs(weight)
    for number in range(component.max(initial=-1) + 1):
        members = np.flatnonzero(component == number)
        sub = weight[np.ix_(members, members)]
        local = match_by_subsets(sub) if len(members) <= MAX_SUBSET_ENDS else match_by_blossoms(sub)
        paired = local >= 0
        partner[members[paired]] = members[local[paired]]
    return partner
