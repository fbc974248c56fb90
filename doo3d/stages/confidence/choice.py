"""Which chains are given if a number of them is wanted, and nobody said what the object is."""

from __future__ import annotations

from collections.abc import Sequence

from ...types import Chain
from .interpretations import CERTAIN


def most_probable_chains(chains: Sequence[Chain], count: int) -> list[int]:
    """Return the indices of the most probable chains, in ascending order; of those at CERTAIN (0.7) or above, the longest.

    There, differences in confidence are noise, and a long piece of the object is worth more than a short one.

    chains : the chains of one frame. count : number of chains wanted; all are returned if there are fewer.
    """
    order = sorted(range(len(chains)), key=lambda k: (-min(chains[k].confidence, CERTAIN), -chains[k].length))
    return sorted(order[:count])
