"""Whether the connections that merging made hold together what belongs together."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...types import Chain
from .alignment import Walk

AROUND = 3.0  # segments beside what a connection filled in, within which a break of the order is its doing


def wrong_merges(chain: Chain, walk: Walk) -> int:
    """How many of the chain's connections are wrong: the order along the cables breaks there, or one side follows nothing.

    A break belongs to the nearest connection, and to none where that is farther than AROUND segments.
    """
    spans = [_span(chain, connection.segment) for connection in chain.connections]
    wrong = {k for k, span in enumerate(spans) if not all(_followed(walk, joint) for joint in _beside(chain, span))}
    for before, after in pairwise(walk.tracks):
        first, last = float(before.joints[-1]), float(after.joints[0])
        away = [max(low - last, first - high, 0.0) for low, high in spans]
        if away and min(away) <= AROUND:
            wrong.add(int(np.argmin(away)))
    return len(wrong)


def _span(chain: Chain, segment: int) -> tuple[int, int]:
    """The first and the last joint of what was filled in round a segment."""
    low, high = segment, segment + 1
    while low > 0 and chain.occluded[low - 1]:
        low -= 1
    while high < len(chain.occluded) and chain.occluded[high]:
        high += 1
    return low, high


def _beside(chain: Chain, span: tuple[int, int]) -> tuple[int, int]:
    return max(span[0] - 1, 0), min(span[1] + 1, len(chain.joints) - 1)


def _followed(walk: Walk, joint: int) -> bool:
    return any(track.joints[0] - 1 <= joint <= track.joints[-1] + 1 for track in walk.tracks)
