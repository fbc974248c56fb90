"""Tracking: each chain keeps its id and its direction from frame to frame."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.spatial.distance import cdist

from ..config import TrackingConfig
from ..errors import InputError
from ..geometry.limits import MAX_AGE
from ..types import Chain, ChainEnd, Connection, Crossing, Detection, Floats, Ints, Junction, SegmentRef
from ..types.arguments import refused

COMPARED_STEPS = 60
"""Number of positions along the longer of two chains at which their distance is measured."""

MIN_MOTION_RADII = 10.0
"""Motion between frames, in radii, that is allowed for a chain of any length."""


T = TypeVar("T")


class Match(NamedTuple):
    """The result of comparing a chain with a chain of an earlier frame.

    Attributes
    ----------
    cost
        mean distance between the two chains, as a fraction of the largest motion allowed: 0 if they coincide, 1 at the limit,
        infinite beyond it.
    backwards
        True if the new chain runs in the opposite direction.
    first_joint
        for two closed chains, index of the joint of the new chain that corresponds to the first joint of the earlier one, counted
        after reversing the new chain if `backwards`. 0 if a chain is open.
    """

    cost: float
    backwards: bool = False
    first_joint: int = 0


NO_MATCH = Match(np.inf)


@dataclass(frozen=True)
class TrackedChain:
    """A chain that tracking remembers, to compare the chains of the next frame with.

    Attributes
    ----------
    chain
        the chain as it was found last, with its id.
    age
        number of frames since the chain was found last: 0 if it was found in the latest frame.
    """

    chain: Chain
    age: int = 0


@dataclass(frozen=True)
class TrackingState:
    """What tracking remembers between frames.

    Attributes
    ----------
    tracked
        the remembered chains, by ascending id.
    next_id
        the smallest id not used so far.
    """

    tracked: tuple[TrackedChain, ...] = ()
    next_id: int = 0


class Tracker:
    """Tracker of chains: the same object keeps its id and its direction from frame to frame.

    Call `update` with each frame's detection, in order. Leave out frames that failed: the next frame is then compared with the
    last one that was given. A chain that is not found is remembered for 30 frames.

    Parameters
    ----------
    config
        the section `tracking` of a Config; None for the defaults.
    state
        chains to begin with; None begins without any.

    Examples
    --------
    >>> tracker = Tracker()
    >>> detections = [tracker.update(detection) for detection in detections]  # doctest: +SKIP
    """

    def __init__(self, config: TrackingConfig | None = None, state: TrackingState | None = None) -> None:
        self._config = _checked(config, TrackingConfig, "config") or TrackingConfig()
        self._state = _checked(state, TrackingState, "state") or TrackingState()

    @property
    def state(self) -> TrackingState:
        """The remembered chains and the next unused id."""
        return self._state

    def update(self, detection: Detection) -> Detection:
        """Return the detection of the next frame with ids, its chains running in the same direction as in the frames before.

        The order of the chains does not change; chains not seen before get new ids. Segment indices in crossings and connections
        are adapted to the directions.

        detection : the detection of the frame after the one given last.
        """
        if not isinstance(detection, Detection):
            raise refused(detection, "detection", "a doo3d.Detection, as detect returns it")
        detection, self._state = assign_ids(self._state, detection, self._config)
        return detection

    @staticmethod
    def resumed(documents: Iterable[Mapping[str, Any]], config: TrackingConfig | None = None) -> Tracker:
        """Return a tracker that continues after frames whose results are stored.

        Parameters
        ----------
        documents
            the stored JSON results (`Detection.to_dict`) of all frames so far, in order. All are needed to know which ids are
            used; positions are taken from the last 31. Chains without an id are ignored.
        config
            the section `tracking` of a Config; None for the defaults.

        Raises
        ------
        InputError : a document is not the result of a detection.
        """
        config = _checked(config, TrackingConfig, "config") or TrackingConfig()
        last: deque[Mapping[str, Any]] = deque(maxlen=MAX_AGE + 1)
        next_id = 0
        try:
            for document in documents:
                last.append(document)
                next_id = max([next_id, *(chain["id"] + 1 for chain in document["chains"] if chain.get("id") is not None)])
            state = TrackingState(next_id=next_id)
            for document in last:
                state = _after_frame(state, [_parse_chain(chain) for chain in document["chains"]])
        except (LookupError, TypeError, ValueError, AttributeError, InputError) as error:
            raise InputError(
                f"the results so far are damaged ({error!r})",
                code="results-damaged",
                remedy="start over with --restart",
            ) from None
        return Tracker(config, state)


def assign_ids(
    state: TrackingState, detection: Detection, config: TrackingConfig | None = None
) -> tuple[Detection, TrackingState]:
    """Match the chains of the next frame with the remembered chains, and give them their ids and directions.

    `paired` says which are the same. Chains without a counterpart get new ids.

    Parameters
    ----------
    state
        the remembered chains.
    detection
        the detection of the next frame.
    config
        the section `tracking` of a Config; None for the defaults.

    Returns
    -------
    detection : the given detection with ids; matched chains run in the direction of their counterparts.
    state : what to remember for the frame after it. A chain not found in 30 frames is forgotten.
    """
    known = [tracked.chain for tracked in state.tracked]
    new_ids = itertools.count(state.next_id)
    chains, segment_maps, backwards = [], [], []
    for chain, (number, match) in zip(
        detection.chains, pair_chains(known, detection.chains, config or TrackingConfig()), strict=True
    ):
        chain, segments = reversed_chain(chain, match.backwards, match.first_joint)
        chains.append(replace(chain, id=next(new_ids) if number is None else known[number].id))
        segment_maps.append(segments)
        backwards.append(match.backwards)
    crossings = _renumber_crossings(detection.crossings, segment_maps)
    junctions = tuple(_turn_junction(junction, backwards) for junction in detection.junctions)
    tracked_detection = replace(detection, chains=tuple(chains), crossings=crossings, junctions=junctions)
    return tracked_detection, _after_frame(TrackingState(state.tracked, next(new_ids)), chains)


def pair_chains(known: Sequence[Chain], chains: Sequence[Chain], config: TrackingConfig) -> list[tuple[int | None, Match]]:
    """Return for each chain of a frame which of the known chains it is, and how it matches that; None for one without any.

    The total of (1 - cost) over all pairs is largest (Hungarian method); `match_chains` gives the cost.

    known : the chains of earlier frames. chains : those of the frame. config : the section `tracking` of a Config.
    """
    matches = [[match_chains(old, chain, config) for chain in chains] for old in known]
    gain = np.array([[max(0.0, 1 - match.cost) for match in row] for row in matches]).reshape(len(known), len(chains))
    pairs = {k: t for t, k in _best_pairs(gain) if gain[t, k] > 0}
    return [(pairs[k], matches[pairs[k]][k]) if k in pairs else (None, Match(0.0)) for k in range(len(chains))]


def _turn_junction(junction: Junction, backwards: Sequence[bool]) -> Junction:
    """Return a junction after some of the chains were reversed."""
    ends = tuple(ChainEnd(end.chain, 1 - end.end if backwards[end.chain] else end.end) for end in junction.ends)
    return replace(junction, ends=ends)


def _best_pairs(gain: Floats) -> list[tuple[int, int]]:
    """Return the (row, column) pairs of largest total gain, each row and column at most once (Hungarian method)."""
    is_gain = gain > 0
    if (is_gain.sum(axis=0) <= 1).all() and (is_gain.sum(axis=1) <= 1).all():
        return [(int(row), int(column)) for row, column in np.argwhere(is_gain)]
    from scipy.optimize import linear_sum_assignment  # 0.2 s to import, for nothing where no chain is near two others

    return [(int(row), int(column)) for row, column in zip(*linear_sum_assignment(-gain), strict=True)]


def _after_frame(state: TrackingState, chains: Iterable[Chain]) -> TrackingState:
    """Return the state after a frame that shows these chains; chains not found for `MAX_AGE` frames are forgotten."""
    tracked = {item.chain.id: TrackedChain(item.chain, item.age + 1) for item in state.tracked if item.age < MAX_AGE}
    tracked |= {chain.id: TrackedChain(chain) for chain in chains if chain.id is not None}
    return TrackingState(tuple(tracked[id] for id in sorted(id for id in tracked if id is not None)), state.next_id)


def match_chains(old: Chain, new: Chain, config: TrackingConfig) -> Match:
    """Compare a chain with one of an earlier frame, in both directions.

    The mean distance between the chains is measured at the best shift of one along the other (at the best rotation, if both are
    closed). The chains match if it is at most 10 radii, or `max_motion_lengths` times the length of the shorter chain if that is
    more.

    Parameters
    ----------
    old, new
        the earlier chain and the new one, in one coordinate frame.
    config
        the section `tracking` of a Config.

    Returns
    -------
    The match in the direction of the lower cost; NO_MATCH, of infinite cost, if the distance is too large.
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
    """Match two open chains by their mean distance at the best relative shift, in both directions.

    The chains overlap by at least half of the shorter. Parts without a counterpart cost the maximum distance, so that a
    newly hidden end does not shift the match.
    """
    step = max(old.length, new.length) / COMPARED_STEPS
    distances = cdist(_sample(old, step), _sample(new, step))
    return [
        Match(_shift_cost(distances[:, ::-1] if backwards else distances, max_motion), backwards) for backwards in (False, True)
    ]


def _shift_cost(distances: Floats, limit: float) -> float:
    """Return the cost at the best shift along each other of two polylines, whose points are at distances (R, C)."""
    rows, columns = distances.shape
    min_overlap = (min(rows, columns) + 1) // 2
    shifts = np.arange(min_overlap - rows, columns - min_overlap + 1)
    overlap = np.minimum(rows, columns - shifts) - np.maximum(0, -shifts)
    unmatched = (rows + columns) / 2 - overlap
    sums = np.array([distances.trace(shift) for shift in shifts])
    return float(np.min((sums / limit + unmatched) / (overlap + unmatched)))


def _match_closed(old: Chain, new: Chain, backwards: bool, max_motion: float) -> Match:
    """Match two closed chains by their mean distance at the best rotation of the new one, in one direction.

    Rotations are by whole joints, so that the first joint ends up within half a segment of its old position.
    """
    count = len(new.joints) - 1
    joints = new.joints[:: -1 if backwards else 1][:-1]
    distances = cdist(old.nodes(count + 1)[:-1], joints)
    index = np.arange(count)
    mean = distances[index, (index + index[:, None]) % count].mean(axis=1)  # (count,), of each rotation
    return Match(float(mean.min()) / max_motion, backwards, int(mean.argmin()))


def _match_open_with_closed(old: Chain, new: Chain, backwards: bool, max_motion: float) -> Match:
    """Match a closed chain with one that is open in the other frame, at the best shift along the closed one."""
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


def reversed_chain(chain: Chain, backwards: bool, first_joint: int = 0) -> tuple[Chain, Ints]:
    """Return a chain in the opposite direction, or a closed chain from another joint on.

    Parameters
    ----------
    chain
        the chain, of N segments.
    backwards
        True reverses the direction.
    first_joint
        index of the joint of a closed chain to begin with, counted after reversing; 0 for open chains.

    Returns
    -------
    chain : with joints, radii, deviations, occluded and depth-filled segments and connections in the new order.
    segments : (N,) int64; segments[i] is the new index of segment i of the given chain.
    """
    count = len(chain.occluded)
    index = np.arange(count)[::-1] if backwards else np.arange(count)
    index = np.roll(index, -first_joint)
    if not backwards and not first_joint:
        return chain, index
    segments = np.argsort(index)
    if chain.closed:
        joint = np.append(index + backwards, index[0] + backwards) % count
    else:
        joint = np.arange(count + 1)[::-1]
    connections = tuple(sorted(Connection(int(segments[segment]), confidence) for segment, confidence in chain.connections))
    turned = replace(
        chain,
        joints=chain.joints[joint],
        radii=chain.radii[joint],
        occluded=chain.occluded[index],
        depth_filled=chain.depth_filled[index],
        from_time=chain.from_time[index],
        connections=connections,
        deviations=None if chain.deviations is None else chain.deviations[joint],
    )
    return turned, segments


def _renumber_crossings(crossings: Sequence[Crossing], segment_maps: Sequence[Ints]) -> tuple[Crossing, ...]:
    """Return the crossings with the new numbers of their segments, in the order of the chains and along them.

    segment_maps : for each chain, (N,), the new number of each segment, as of `reversed_chain`.
    """

    def renumber(segment: SegmentRef) -> SegmentRef:
        return SegmentRef(segment.chain, int(segment_maps[segment.chain][segment.segment]))

    renumbered = [replace(crossing, upper=renumber(crossing.upper), lower=renumber(crossing.lower)) for crossing in crossings]
    return tuple(sorted(renumbered, key=lambda crossing: sorted((crossing.upper, crossing.lower))))


def _parse_chain(values: Mapping[str, Any]) -> Chain:
    """Return a chain of a JSON result, without the parts that tracking does not need."""
    radius = float("nan") if values["radius"] is None else float(values["radius"])
    joints, segment_length = np.array(values["joints"], dtype=float), float(values["segment_length"])
    return Chain(joints, segment_length, radius, closed=bool(values["closed"]), id=values.get("id"))


def _checked(value: T | None, kind: type[T], what: str) -> T | None:
    """Return an optional argument after a check of its type."""
    if not isinstance(value, kind | None):
        raise refused(value, what, f"a {kind.__name__}, or None")
    return value
