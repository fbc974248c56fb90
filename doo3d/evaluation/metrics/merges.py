"""Count the connections made by merging that join parts which do not belong together."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...types import Chain
from .alignment import ChainAlignment

MAX_SEGMENTS_FROM_FILL = 3.0
"""Segments beside a filled gap within which a break of the order is blamed on the connection."""


def wrong_merges(chain: Chain, alignment: ChainAlignment) -> int:
    """Return the number of wrong merges in a chain.

    A merge is a place where the detection joined two pieces to one chain. It is wrong if the joint before or after it is on no
    cable, or if the chain jumps or turns back at it. A jump or turn is blamed on the nearest merge, or on none if that is more
    than 3 segments away.

    Parameters
    ----------
    chain
        the chain; its `connections` are the merges.
    alignment
        the alignment of the chain with the true cables, from `align_chain`.
    """
    spans = [_filled_span(chain, connection.segment) for connection in chain.connections]
    wrong = {k for k, span in enumerate(spans) if not all(_is_aligned(alignment, joint) for joint in _joints_beside(chain, span))}
    for before, after in pairwise(alignment.stretches):
        first, last = float(before.joints[-1]), float(after.joints[0])
        distances = [max(low - last, first - high, 0.0) for low, high in spans]
        if distances and min(distances) <= MAX_SEGMENTS_FROM_FILL:
            wrong.add(int(np.argmin(distances)))
    return len(wrong)


def _filled_span(chain: Chain, segment: int) -> tuple[int, int]:
    """Return the first and the last joint of the filled gap that a segment is in."""
    low, high = segment, segment + 1
    while low > 0 and chain.occluded[low - 1]:
        low -= 1
    while high < len(chain.occluded) and chain.occluded[high]:
        high += 1
    return low, high


def _joints_beside(chain: Chain, span: tuple[int, int]) -> tuple[int, int]:
    return max(span[0] - 1, 0), min(span[1] + 1, len(chain.joints) - 1)


def _is_aligned(alignment: ChainAlignment, joint: int) -> bool:
    return any(stretch.joints[0] - 1 <= joint <= stretch.joints[-1] + 1 for stretch in alignment.stretches)
