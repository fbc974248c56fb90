"""Choose the chains that show an object whole, and their directions, so that the object moves little from one to the next."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.distance import cdist

from ..config import TrackingConfig
from ..types import Chain
from .chain_matching import MIN_MOTION_RADII
from .junction_vote import ChainInFrame
from .observations import MIN_JOINED_CONFIDENCE

COMPARED_NODES = 20
"""Number of points of a chain at which its positions in two frames are compared."""

EARLIER_CHAINS = 12
"""Number of earlier chains from which a path may continue: so many in a row may be wrong."""


def consistent_chains(items: Sequence[ChainInFrame], tracking: TrackingConfig, is_reversible: bool) -> list[ChainInFrame]:
    """Return the chains of an object along the best path through the frames, each in the direction of the path.

    Parameters
    ----------
    items
        chains that show the object whole, in the order of frames; several of one frame are alternatives.
    tracking
        the section `tracking` of a Config.
    is_reversible
        whether a chain may run in either direction; False keeps the given directions, which junctions decide.

    Notes
    -----
    Viterbi algorithm over chains and directions. A path gains the confidence of each of its chains, at least
    MIN_JOINED_CONFIDENCE since all have the right length, and loses that much for each change of direction within a track. From
    each chain to the next it loses m^2 / (1 - m^2): m is the mean distance of the two as a fraction of the largest motion that
    `tracking` allows in the time between them.
    """
    if not items:
        return []
    nodes = np.array([[item.nodes(COMPARED_NODES), item.reversed().nodes(COMPARED_NODES)] for item in items])
    nodes = nodes.reshape(len(items), 2, -1)
    frames, tracks = (np.array([getattr(item, name) for item in items]) for name in ("frame", "track"))
    gains = np.maximum([item.chain.confidence for item in items], MIN_JOINED_CONFIDENCE)
    allowed = np.array([True, is_reversible])
    best = np.where(allowed, gains[:, None], -np.inf)
    before = np.full((len(items), 2), -1)
    turns = ~np.eye(2, dtype=bool)[:, None]
    for k in range(1, len(items)):
        first = max(0, k - EARLIER_CHAINS)
        moved = cdist(nodes[k], nodes[first:k].reshape(2 * (k - first), -1)).reshape(2, k - first, 2) / np.sqrt(COMPARED_NODES)
        share = moved / _largest_motion(items[k].chain, tracking) / np.maximum(frames[k] - frames[first:k], 1)[:, None]
        follows = (share < 1) & (frames[first:k] < frames[k])[:, None]
        loss = share**2 / np.maximum(1 - share**2, np.finfo(float).eps)
        loss += MIN_JOINED_CONFIDENCE * (turns & (tracks[first:k] == tracks[k])[:, None])
        total = np.where(follows, best[first:k] - loss, -np.inf).reshape(2, -1)
        at = total.argmax(axis=1)
        gained = total[[0, 1], at]
        is_longer = (gained > 0) & allowed
        best[k, is_longer] = gained[is_longer] + gains[k]
        before[k, is_longer] = 2 * first + at[is_longer]
    at, path = int(best.argmax()), []
    while at >= 0:
        path.append(items[at // 2].reversed() if at % 2 else items[at // 2])
        at = int(before.ravel()[at])
    return path[::-1]


def _largest_motion(chain: Chain, tracking: TrackingConfig) -> float:
    """Return the largest mean motion of a chain from frame to frame, m."""
    return float(np.fmax(MIN_MOTION_RADII * chain.radius, tracking.max_motion_lengths * chain.length))
