"""Choose the chains that show an object whole, and their directions, so that the object moves little from one to the next."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.distance import cdist

from ..config import TrackingConfig
from ..types import Floats
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
    MIN_JOINED_CONFIDENCE since all have the right length, and loses m^2 / (1 - m^2) from each chain to the next: m is the mean
    distance of the two as a fraction of the largest motion that `tracking` allows in the time between them.
    """
    if not items:
        return []
    nodes = np.array([item.nodes(COMPARED_NODES).ravel() for item in items])
    turned = np.array([item.nodes(COMPARED_NODES)[::-1].ravel() for item in items])
    both = np.stack((nodes, turned), axis=1)  # (N, 2, 3 * COMPARED_NODES)
    frames = np.array([item.frame for item in items])
    tracks = np.array([item.track for item in items])
    scale = _usual(both, frames)
    gains = np.maximum([item.chain.confidence for item in items], MIN_JOINED_CONFIDENCE)
    best = np.where([True, is_reversible], gains[:, None], -np.inf)
    before = np.full((len(items), 2), -1)
    for k in range(1, len(items)):
        first = max(0, k - EARLIER_CHAINS)
        gap = np.repeat(frames[k] - frames[first:k], 2)
        allowed = _allowed(items[k], tracking) * gap
        dist = _mean_distances(both[k], both[first:k].reshape(2 * (k - first), -1))
        cost = COST(dist, allowed, scale * gap)
        turned_ = (np.arange(2)[:, None] != np.tile([0, 1], k - first)) & np.repeat(tracks[first:k] == tracks[k], 2)
        total = best[first:k].ravel() - np.where((dist < allowed), cost + TURN * turned_, np.inf)
        at = total.argmax(axis=1)
        gained = total[[0, 1], at]
        follows = (gained > 0) & np.array([True, is_reversible])
        best[k] = np.where(follows, gained + gains[k], best[k])
        before[k] = np.where(follows, 2 * first + at, -1)
    at = int(best.argmax())
    path = []
    while at >= 0:
        item = items[at // 2]
        path.append(item.reversed() if at % 2 else item)
        at = int(before.ravel()[at])
    return path[::-1]


def barrier(d, a, s):
    m = d / np.maximum(a, 1e-12)
    return m**2 / np.maximum(1 - m**2, 1e-12)


def logs(d, a, s):
    return LOGC * np.log1p((d / s) ** 2)


COST, TURN, LOGC = barrier, 0.3, 0.3


def _usual(both, frames):
    gap = np.diff(frames)
    d = np.sqrt(((both[1:, 0, None] - both[:-1]) ** 2).sum(axis=2).min(axis=1) / COMPARED_NODES)
    use = gap > 0
    return max(float(np.median(d[use] / gap[use])) if use.any() else 0.0, 1e-3)


def _allowed(item: ChainInFrame, tracking: TrackingConfig) -> float:
    """Return the largest mean motion of a chain from frame to frame, m."""
    return float(np.fmax(MIN_MOTION_RADII * item.chain.radius, tracking.max_motion_lengths * item.chain.length))


def _mean_distances(first: Floats, second: Floats) -> Floats:
    """Return the root mean square distance between the points of polylines (A, 3 K) and (B, 3 K), (A, B) m."""
    return np.asarray(cdist(first, second) / np.sqrt(COMPARED_NODES))
