"""Match the chains of a frame with those of earlier frames.

The cost is the mean distance of two chains; pairs are chosen by maximum-weight matching.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from ..config import TrackingConfig
from ..types import Chain, Floats

COMPARED_STEPS = 60
"""Number of intervals along the longer of two chains at whose ends their distance is measured."""

MIN_MOTION_RADII = 10.0
"""Motion between two frames, in radii, that is allowed for a chain of any length."""


class Match(NamedTuple):
    """The result of comparing a chain with a chain of an earlier frame.

    Attributes
    ----------
    cost
        mean distance between the two chains as a fraction of the largest motion allowed: 0 if they coincide, 1 at the limit,
        infinite beyond it.
    backwards
        True if the new chain runs in the opposite direction.
    first_joint
        for two rings, the index of the joint of the new one that corresponds to the first joint of the earlier one, counted
        after reversing the new ring if `backwards`. 0 if a chain is open.
    """

    cost: float
    backwards: bool = False
    first_joint: int = 0


NO_MATCH = Match(np.inf)


def pair_chains(known: Sequence[Chain], chains: Sequence[Chain], config: TrackingConfig) -> list[tuple[int | None, Match]]:
    """Pair the chains of a frame with known chains by maximum-weight matching.

    The weight of a pair is 1 - cost, with the cost of `match_chains`; pairs beyond the limit of motion are excluded.

    Parameters
    ----------
    known
        the chains of earlier frames.
    chains
        the chains of the frame, in the same coordinate frame.
    config
        the section `tracking` of a Config.

    Returns
    -------
    For each chain of the frame the index of its known chain, None if it is new, and the match of the two.
    """
    matches = [[match_chains(old, chain, config) for chain in chains] for old in known]
    gain = np.array([[max(0.0, 1 - match.cost) for match in row] for row in matches]).reshape(len(known), len(chains))
    pairs = {k: t for t, k in _best_pairs(gain) if gain[t, k] > 0}
    return [(pairs[k], matches[pairs[k]][k]) if k in pairs else (None, Match(0.0)) for k in range(len(chains))]


def _best_pairs(gain: Floats) -> list[tuple[int, int]]:
    """Return the (row, column) pairs of the maximum-weight matching of gains (R, C)."""
    is_gain = gain > 0
    if (is_gain.sum(axis=0) <= 1).all() and (is_gain.sum(axis=1) <= 1).all():
        return [(int(row), int(column)) for row, column in np.argwhere(is_gain)]
    from scipy.optimize import linear_sum_assignment  # 0.2 s to import, rarely needed

    return [(int(row), int(column)) for row, column in zip(*linear_sum_assignment(-gain), strict=True)]


def match_chains(old: Chain, new: Chain, config: TrackingConfig) -> Match:
    """Compare a chain with a chain of an earlier frame, in both directions.

    The chains are shifted along each other (rings are rotated) to the smallest mean distance. They match if this distance is
    below 10 radii, or below `max_motion_lengths` times the length of the shorter chain if that is more.

    Parameters
    ----------
    old, new
        the earlier chain and the new one, in one coordinate frame.
    config
        the section `tracking` of a Config.

    Returns
    -------
    The match in the direction of lower cost; NO_MATCH, of infinite cost, if the distance is too large.
    """
    radius = max(chain.radius if chain.radius > 0 else 0.0 for chain in (old, new))  # NaN if unknown
    max_motion = max(MIN_MOTION_RADII * radius, config.max_motion_lengths * min(old.length, new.length))
    low, high = (np.array([corner(chain.joints, axis=0) for chain in (old, new)]) for corner in (np.min, np.max))
    if (low.max(axis=0) - high.min(axis=0) > max_motion).any():
        return NO_MATCH
    if not (old.closed or new.closed):
        matches = _match_open(old, new, max_motion)
    else:
        match_function = _match_closed if old.closed and new.closed else _match_open_with_closed
        matches = [match_function(old, new, backwards, max_motion) for backwards in (False, True)]
    best = min(matches, key=lambda match: match.cost)
    return best if best.cost < 1 else NO_MATCH


def _match_open(old: Chain, new: Chain, max_motion: float) -> list[Match]:
    """Match two open chains in both directions, each at the best relative shift.

    The best shift has the smallest mean distance; the overlap is at least half of the shorter chain. Parts beyond the overlap
    cost the largest distance allowed, `max_motion`, so that an end that becomes hidden does not shift the match.
    """
    step = max(old.length, new.length) / COMPARED_STEPS
    distances = cdist(_sample(old, step), _sample(new, step))
    return [
        Match(_shift_cost(distances[:, ::-1] if backwards else distances, max_motion), backwards) for backwards in (False, True)
    ]


def _shift_cost(distances: Floats, limit: float) -> float:
    """Return the lowest cost over all shifts of two polylines along each other.

    distances : (R, C), from each point of one to each point of the other, both at one spacing. limit : distance of cost 1.
    """
    rows, columns = distances.shape
    min_overlap = (min(rows, columns) + 1) // 2
    shifts = np.arange(min_overlap - rows, columns - min_overlap + 1)
    overlap = np.minimum(rows, columns - shifts) - np.maximum(0, -shifts)
    unmatched = (rows + columns) / 2 - overlap
    sums = np.array([distances.trace(shift) for shift in shifts])
    return float(np.min((sums / limit + unmatched) / (overlap + unmatched)))


def _match_closed(old: Chain, new: Chain, backwards: bool, max_motion: float) -> Match:
    """Match two rings at the rotation of smallest mean distance, in one direction.

    The new ring is rotated by whole joints, so its first joint is within half a segment of the earlier first joint.
    """
    count = len(new.joints) - 1
    joints = new.joints[:: -1 if backwards else 1][:-1]
    distances = cdist(old.nodes(count + 1)[:-1], joints)
    index = np.arange(count)
    mean = distances[index, (index + index[:, None]) % count].mean(axis=1)  # (count,), one per rotation
    return Match(float(mean.min()) / max_motion, backwards, int(mean.argmin()))


def _match_open_with_closed(old: Chain, new: Chain, backwards: bool, max_motion: float) -> Match:
    """Match a ring with a chain that is open in the other frame, at the best shift."""
    closed, open_chain = (old, new) if old.closed else (new, old)
    step = max(old.length, new.length) / COMPARED_STEPS
    once, part = _sample(closed, step), _sample(open_chain, step)[:: -1 if backwards else 1]
    twice = np.concatenate((once[:-1], once))
    if len(part) > len(twice):
        return NO_MATCH
    distances = cdist(part, twice)
    mean = [distances.trace(shift) / len(part) for shift in range(len(twice) - len(part) + 1)]
    return Match(float(min(mean)) / max_motion, backwards)


def _sample(chain: Chain, step: float) -> Floats:
    """Return points (N, D) along a chain, about `step` (m; px in 2-D) apart."""
    return chain.nodes(max(2, round(chain.length / step) + 1))
