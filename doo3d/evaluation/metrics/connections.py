"""Count the connections and merges of a frame, and the wrong ones among them."""

from itertools import pairwise
from typing import Any

import numpy as np

from ...types import Chain
from .alignment import ChainAlignment
from .observed import Observed
from .record import Metric, added, amount, parts, share

MAX_SEGMENTS_FROM_FILL = 3.0
"""Distance from a merge in segments within which a jump or turn of the chain counts as its fault."""


def measure(match: Observed) -> dict[str, Any]:
    """Return the numbers of connections and merges, and of the wrong ones.

    A connection is a pair of successive joints on cables; it is wrong where the chain jumps or turns back. A merge is a place
    where the detection joined two pieces to one chain.
    """
    both = zip(match.chains, match.alignments, strict=True)
    return {
        "merges": sum(len(chain.connections) for chain in match.chains),
        "merges_wrong": sum(wrong_merges(chain, alignment) for chain, alignment in both),
        "connections": sum(alignment.connections for alignment in match.alignments),
        "connections_wrong": sum(alignment.wrong for alignment in match.alignments),
    }


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


CONNECTIONS = parts("connections", wrong="connections_wrong")
METRIC = Metric(
    measure,
    (
        share(("merges", "correct"), 15, "merges", parts("merges", wrong="merges_wrong")),
        share(("connections", "correct"), 20, "connections", CONNECTIONS, "{}/{} {:.2f} %"),
        amount(("", "wrong"), 6, "connections_wrong", added("connections_wrong")),
    ),
)
