"""Which chain is which from frame to frame: identities that stay, and directions that do not flip."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from ..config import TrackingConfig
from ..errors import InputError
from ..types import Chain, Connection, Crossing, Detection, Floats, Ints, SegmentRef

NODES = 60
"""Steps of the longer of two chains at which they are compared."""


MIN_MOTION_RADII = 10.0
"""Radii by which a chain may move from one frame to the next in any case, however short it is."""

MAX_AGE = 30
"""Frames for which a chain that is not found is remembered where it was: a second of video."""


class Match(NamedTuple):
    """How a chain lies on one of an earlier frame.

    cost : the distance from it, in the distances that are allowed: 0 the same, 1 the farthest. backwards : the other end is
    first. start : of a ring, the joint that is then first.
    """

    cost: float
    backwards: bool = False
    start: int = 0


NONE = Match(np.inf)


@dataclass(frozen=True)
class LastSeen:
    """A chain where it was last, and how many frames ago that was: 0 for the last one."""

    chain: Chain
    age: int = 0


@dataclass(frozen=True)
class State:
    """The chains that are remembered, by their ids, and the next id that is free."""

    seen: tuple[LastSeen, ...] = ()
    free: int = 0


def follow(state: State, detection: Detection, config: TrackingConfig | None = None) -> tuple[Detection, State]:
    """The detection with ids, its chains in the directions they had before, and the state for the next frame.

    Chains are assigned to remembered ones all together, so that what they are nearer by is most in total (the Hungarian
    method). The order of the chains stays; crossings and connections go with the segments they are at.
    """
    config = config or TrackingConfig()
    matches = [[compare(seen.chain, chain, config) for chain in detection.chains] for seen in state.seen]
    gain = np.array([[max(0.0, 1 - match.cost) for match in row] for row in matches]).reshape(len(matches), len(detection.chains))
    pairs = {int(k): int(s) for s, k in zip(*linear_sum_assignment(-gain), strict=True) if gain[s, k] > 0}
    free = itertools.count(state.free)
    chains, moved = [], []
    for k, chain in enumerate(detection.chains):
        known = k in pairs
        match = matches[pairs[k]][k] if known else Match(0.0)
        chain, segments = reversed_chain(chain, match.backwards, match.start)
        chains.append(replace(chain, id=state.seen[pairs[k]].chain.id if known else next(free)))
        moved.append(segments)
    found = replace(detection, chains=tuple(chains), crossings=_carried(detection.crossings, moved))
    return found, _after(State(state.seen, next(free)), found.chains, MAX_AGE)


def _after(state: State, chains: Iterable[Chain], keep: int) -> State:
    """The state when one more frame has shown these chains."""
    seen = {item.chain.id: LastSeen(item.chain, item.age + 1) for item in state.seen if item.age < keep}
    seen |= {chain.id: LastSeen(chain) for chain in chains if chain.id is not None}
    return State(tuple(seen[number] for number in sorted(number for number in seen if number is not None)), state.free)


def compare(old: Chain, new: Chain, config: TrackingConfig) -> Match:
    """How `new` lies on `old`: NONE where it is farther away than a chain may move from frame to frame."""
    radius = float(np.nanmax((old.radius, new.radius, 0.0)))
    reach = max(MIN_MOTION_RADII * radius, config.max_motion_lengths * min(old.length, new.length))
    low, high = (np.array([side(chain.joints, axis=0) for chain in (old, new)]) for side in (np.min, np.max))
    if (low.max(axis=0) - high.min(axis=0) > reach).any():
        return NONE
    way = _rings if old.closed and new.closed else _ring_and_line if old.closed or new.closed else _lines
    best = min((way(old, new, backwards, reach) for backwards in (False, True)), key=lambda match: match.cost)
    return best if best.cost < 1 else NONE


def _lines(old: Chain, new: Chain, backwards: bool, reach: float) -> Match:
    """Slid along each other, overlapping by at least half of the shorter; what sticks out counts as far away.

    An end that is hidden in one of the frames so moves nothing.
    """
    step = max(old.length, new.length) / NODES
    gap = cdist(_nodes(old, step), _nodes(new, step)[:: -1 if backwards else 1])
    rows, columns = gap.shape
    least = -(-min(rows, columns) // 2)
    slides = np.arange(least - rows, columns - least + 1)
    total = np.array([np.trace(gap, slide) for slide in slides])
    both = np.minimum(rows, columns - slides) - np.maximum(0, -slides)
    out = (rows + columns) / 2 - both
    return Match(float(((total / reach + out) / (both + out)).min()), backwards)


def _rings(old: Chain, new: Chain, backwards: bool, reach: float) -> Match:
    """Turned into each other, joint by joint of the new one: its first joint comes to half a segment of where it was."""
    count = len(new.joints) - 1
    joints = new.joints[:: -1 if backwards else 1][:-1]
    gap = cdist(old.nodes(count + 1)[:-1], joints)
    index = np.arange(count)
    mean = gap[index, (index + index[:, None]) % count].mean(axis=1)
    return Match(float(mean.min()) / reach, backwards, int(mean.argmin()))


def _ring_and_line(old: Chain, new: Chain, backwards: bool, reach: float) -> Match:
    """A ring that is open in the other frame: the line is slid round it."""
    ring, line = (old, new) if old.closed else (new, old)
    step = max(old.length, new.length) / NODES
    round_twice, part = _nodes(ring, step), _nodes(line, step)[:: -1 if backwards else 1]
    round_twice = np.concatenate((round_twice[:-1], round_twice))
    if len(part) > len(round_twice):
        return NONE
    gap = cdist(part, round_twice)
    mean = [np.trace(gap, slide) / len(part) for slide in range(len(round_twice) - len(part) + 1)]
    return Match(float(min(mean)) / reach, backwards)


def _nodes(chain: Chain, step: float) -> Floats:
    return chain.nodes(max(2, round(chain.length / step) + 1))


def reversed_chain(chain: Chain, backwards: bool, start: int = 0) -> tuple[Chain, Ints]:
    """The chain from its other end, where backwards, and a ring from the joint `start` (counted after that); and for each of its
    segments, (N,), the place that it has then.
    """
    count = len(chain.occluded)
    index = np.arange(count)[::-1] if backwards else np.arange(count)
    index = np.roll(index, -start)
    if not backwards and not start:
        return chain, index
    segments = np.argsort(index)
    if chain.closed:
        joint = np.append(index + backwards, index[0] + backwards) % count
    else:
        joint = np.arange(count + 1)[::-1]
    connections = tuple(sorted(Connection(int(segments[segment]), confidence) for segment, confidence in chain.connections))
    radii, occluded = chain.radii[joint], chain.occluded[index]
    return replace(chain, joints=chain.joints[joint], radii=radii, occluded=occluded, connections=connections), segments


def _carried(crossings: tuple[Crossing, ...], moved: list[Ints]) -> tuple[Crossing, ...]:
    """Crossings at the places their segments have now, in the order of the chains and along them."""

    def now(place: SegmentRef) -> SegmentRef:
        return SegmentRef(place.chain, int(moved[place.chain][place.segment]))

    found = [replace(crossing, upper=now(crossing.upper), lower=now(crossing.lower)) for crossing in crossings]
    return tuple(sorted(found, key=lambda crossing: sorted((crossing.upper, crossing.lower))))


class Tracker:
    """`follow` from frame to frame. A frame that failed is left out: the next one is compared with the one before it."""

    def __init__(self, config: TrackingConfig | None = None, state: State | None = None) -> None:
        self._config = config or TrackingConfig()
        self._state = state or State()

    def update(self, detection: Detection) -> Detection:
        """The next frame's detection, with ids and directions."""
        detection, self._state = follow(self._state, detection, self._config)
        return detection

    def state(self) -> State:
        """What is remembered."""
        return self._state

    @staticmethod
    def resumed(documents: Iterable[Mapping[str, Any]], config: TrackingConfig | None = None) -> Tracker:
        """A tracker as it was after the frames of these documents (schema doo3d/detection/1), given in their order.

        All frames so far, for ids are never used twice; those long ago are only asked for their ids. Chains without an id are
        left aside.

        Raises
        ------
        InputError : a document is not what was written.
        """
        config = config or TrackingConfig()
        last: deque[Mapping[str, Any]] = deque(maxlen=MAX_AGE + 1)
        free = 0
        try:
            for document in documents:
                last.append(document)
                free = max([free, *(chain["id"] + 1 for chain in document["chains"] if chain.get("id") is not None)])
            state = State(free=free)
            for document in last:
                state = _after(state, [_chain(chain) for chain in document["chains"]], MAX_AGE)
        except (KeyError, TypeError, ValueError, AttributeError, InputError) as error:
            raise InputError(
                f"the results so far are broken ({error!r}): start anew with --restart", code="results-damaged"
            ) from None
        return Tracker(config, state)


def _chain(values: Mapping[str, Any]) -> Chain:
    """As much of a chain as `compare` looks at."""
    radius = float("nan") if values["radius"] is None else float(values["radius"])
    number = values.get("id")
    return Chain(
        np.array(values["joints"], dtype=float), float(values["segment_length"]), radius, closed=bool(values["closed"]), id=number
    )
