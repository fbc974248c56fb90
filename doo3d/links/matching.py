"""Maximum-weight matching of chain ends, and the rings of chains that pairs of ends close."""

from collections.abc import Iterable

import numpy as np
import rustworkx

from ..types import Floats

FEW_ENDS, RIVALS = 256, 8
"""Number of ends up to which all pairs are tried. Of more ends, each is tried with the 8 of largest weight: 50 ms for 1,000."""

BITS = 40
"""Bits of the heaviest weight, since rustworkx matches by whole numbers; and bits of a random number that is added below. With it
hardly two matchings are equally heavy (isolation lemma of Mulmuley, Vazirani and Vazirani, 1987), between which rustworkx would
choose differently from run to run."""

Rows = tuple[int, int]
"""Rows of two ends in arrays over all ends of all chains, the lower first."""


def heaviest_matching(weight: Floats) -> list[Rows]:
    """Return the pairs of E ends, each end in one at most, whose total weight is the largest, in the order of their rows.

    weight : (E, E), of which the entries [i, j] with i < j count; only ends of a weight above 0 are paired.
    """
    weight = np.triu(weight, 1)
    if len(weight) > FEW_ENDS:
        both = np.maximum(weight, weight.T)
        least = np.partition(both, -RIVALS, axis=1)[:, -RIVALS]
        weight[(weight < least) & (weight < least[:, None])] = 0.0
    pairs = np.argwhere(weight > 0)
    if not len(pairs):
        return []
    steps = np.rint(weight[tuple(pairs.T)] * (2**BITS / weight.max())).astype(np.int64).tolist()
    ties = np.random.default_rng(0).integers(2**BITS // len(weight), size=len(pairs)).tolist()
    graph = rustworkx.PyGraph(multigraph=False)
    graph.extend_from_weighted_edge_list(
        [(a, b, (step << BITS) + tie) for (a, b), step, tie in zip(pairs.tolist(), steps, ties, strict=True)]
    )
    return sorted((min(pair), max(pair)) for pair in rustworkx.max_weight_matching(graph, weight_fn=int))


def find_rings(pairs: Iterable[Rows]) -> list[list[Rows]]:
    """Return the pairs of each ring of chains that pairs of ends close; rows 2 c and 2 c + 1 are the two ends of chain c."""
    pair_of = {row: pair for pair in pairs for row in pair}
    rings = []
    for start in list(pair_of):
        ring, row = [], start
        while row in pair_of:
            pair = pair_of.pop(row)
            other = sum(pair) - row
            del pair_of[other]
            ring.append(pair)
            row = other ^ 1  # the other end of the same chain
        if ring and row == start:
            rings.append(ring)
    return rings
