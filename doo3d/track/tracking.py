"""Track chains from frame to frame: each object keeps its id and its direction."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from ..config import TrackingConfig
from ..errors import InputError
from ..geometry.limits import MAX_AGE
from ..types import Chain, Detection
from ..types.arguments import refused
from .chain_direction import renumber_crossings, reversed_chain, turn_junction
from .chain_matching import pair_chains

T = TypeVar("T")


@dataclass(frozen=True)
class TrackedChain:
    """A chain of an earlier frame, for comparison with the chains of the next frame.

    Attributes
    ----------
    chain
        the chain at its last detection, with its id.
    age
        number of frames since that detection; 0 if it was in the latest frame.
    """

    chain: Chain
    age: int = 0


@dataclass(frozen=True)
class TrackingState:
    """The state of a tracker between two frames.

    Attributes
    ----------
    tracked
        the remembered chains, by ascending id.
    next_id
        the smallest unused id.
    """

    tracked: tuple[TrackedChain, ...] = ()
    next_id: int = 0


class Tracker:
    """Tracker of chains: an object keeps its id and its direction from frame to frame.

    Call `update` with the detection of each frame, in order. Skip frames that failed: the next frame is then compared with the
    last one given. A chain that is not found is remembered for 30 frames.

    Parameters
    ----------
    config
        the section `tracking` of a Config; None for the defaults.
    state
        chains to start with; None starts without chains.

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
        """Return the next frame's detection with ids and consistent chain directions.

        The order of the chains does not change, and new chains get new ids. Segment indices in crossings and connections
        follow the directions.

        detection : the detection of the frame after the one given last.

        Raises
        ------
        ArgumentError : the argument is not a Detection.
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
            the stored JSON results (`Detection.to_dict`) of all frames so far, in order. All of them are needed for the used
            ids; positions come from the last 31. Chains without an id are ignored.
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
                f"the results so far are damaged ({error!r})", code="results-damaged", remedy="start over with --restart"
            ) from None
        return Tracker(config, state)


def assign_ids(
    state: TrackingState, detection: Detection, config: TrackingConfig | None = None
) -> tuple[Detection, TrackingState]:
    """Match the chains of the next frame with known chains; set ids and directions.

    Chains are paired by `pair_chains`; an unpaired chain gets a new id.

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
    state : the state after this frame. A chain that is not found in 30 frames is removed.
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
    crossings = renumber_crossings(detection.crossings, segment_maps)
    junctions = tuple(turn_junction(junction, backwards) for junction in detection.junctions)
    tracked_detection = replace(detection, chains=tuple(chains), crossings=crossings, junctions=junctions)
    return tracked_detection, _after_frame(TrackingState(state.tracked, next(new_ids)), chains)


def _after_frame(state: TrackingState, chains: Iterable[Chain]) -> TrackingState:
    """Return the state after a frame, without chains missing for MAX_AGE frames.

    chains : the chains of the frame, with their ids.
    """
    tracked = {item.chain.id: TrackedChain(item.chain, item.age + 1) for item in state.tracked if item.age < MAX_AGE}
    tracked |= {chain.id: TrackedChain(chain) for chain in chains if chain.id is not None}
    return TrackingState(tuple(tracked[id] for id in sorted(id for id in tracked if id is not None)), state.next_id)


def _parse_chain(values: Mapping[str, Any]) -> Chain:
    """Return the chain of a JSON result with the fields that tracking needs."""
    radius = float("nan") if values["radius"] is None else float(values["radius"])
    joints, segment_length = np.array(values["joints"], dtype=float), float(values["segment_length"])
    return Chain(joints, segment_length, radius, closed=bool(values["closed"]), id=values.get("id"))


def _checked(value: T | None, kind: type[T], what: str) -> T | None:
    """Return an optional argument; raise ArgumentError if it has another type."""
    if not isinstance(value, kind | None):
        raise refused(value, what, f"a {kind.__name__}, or None")
    return value
