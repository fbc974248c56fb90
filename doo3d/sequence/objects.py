"""What holds throughout a capture: which objects there are, how long and how thick they are, and where they are wholly seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..config import Config, TrackingConfig
from ..types import Chain, Floats
from .observations import Observation
from .tracking import Tracker

MIN_CONFIDENCE = 0.15
"""Confidence that a chain needs to count as a whole object."""

MAX_LENGTH_ERROR = 0.025
"""Share by which a chain's length may differ from its object's for it to be the whole object."""

LENGTH_SPREAD, SHIFT_SPREAD, MIN_LENGTH_SHARE = 0.02, 0.03, 0.1
"""Shares of a length within which others agree with it, and are averaged with it, and share of the chains that must agree: chains
are too short wherever an end is hidden, hardly ever too long, so the object's length is the longest that enough chains have."""

MIN_FRAMES = 3
"""Frames in which an object is wholly seen at least; fewer only in captures that are as short."""

MAX_LINK_FRAMES = 90
"""Frames after which a chain of the length of one that was lost is taken for it, wherever it lies: 3 s of video."""

MAX_PART_SHARE = 0.5
"""Share of its frames in which a chain may fill what is missing of another object; more, and it is a part of that."""


@dataclass(frozen=True)
class Anchor:
    """A frame in which an object is wholly seen, or filled with confidence.

    Attributes
    ----------
    frame
        index of the frame.
    chain
        index of the chain in its detection.
    backwards
        True if the chain runs against the direction of the object.
    """

    frame: int
    chain: int
    backwards: bool


@dataclass(frozen=True)
class SequenceObject:
    """An object of a capture, with what does not change.

    Attributes
    ----------
    id
        its identity, from 0 on.
    length
        m.
    radius
        m; NaN if unknown.
    segments
        number of segments of its chain in every frame.
    anchors
        the frames in which it is whole, in order.
    """

    id: int
    length: float
    radius: float
    segments: int
    anchors: tuple[Anchor, ...]

    @property
    def segment_length(self) -> float:
        """The length of a segment, m."""
        return self.length / self.segments


@dataclass
class _Track:
    """The chains of one id, in the order of their frames: (frame, chain index, chain, in the direction of tracking)."""

    items: list[tuple[int, int, Chain]]
    backwards: dict[int, bool]

    @property
    def lengths(self) -> Floats:
        """The lengths (K,) m of the chains that show both ends; of all if there are none."""
        shown = [chain.length for _, _, chain in self.items if _shows_both_ends(chain)]
        return np.array(shown or [chain.length for _, _, chain in self.items])


def find_objects(observations: Sequence[Observation], config: Config) -> list[SequenceObject]:
    """Vote over all frames which objects a capture holds.

    Chains are tracked from frame to frame. The length of an object is where its lengths lie closest together; a chain that only
    appears while another object is short by its length is a part of that object. Closed chains are not followed in time.

    Parameters
    ----------
    observations
        all frames, in order.
    config
        the settings: `sequence.chains`, `sequence.length`, and those of tracking.

    Returns
    -------
    The objects, the one that is seen longest first, with their anchors.
    """
    tracks = _tracks(observations, config.tracking)
    lengths = {id: config.sequence.length or vote_length(track.lengths) for id, track in tracks.items()}
    least = min(MIN_FRAMES, len(observations))
    candidates = []
    for id, track in tracks.items():
        whole = [item for item in track.items if _is_whole(item[2], lengths[id])]
        if len(whole) >= least and not _is_part(id, tracks, lengths):
            candidates.append((id, track, whole))
    linked = _linked([_Candidate(lengths[id], track, whole) for id, track, whole in candidates])
    linked.sort(key=lambda candidate: -len(candidate.track.items) * candidate.length)
    return [_object(number, candidate) for number, candidate in enumerate(linked[: config.sequence.chains])]


def vote_length(lengths: Floats) -> float:
    """Return the longest length that enough of the lengths (K,) m agree on.

    It is moved to the median of those around it until it stays (mean shift), since the longest of them are a little too long.
    """
    ordered = np.sort(lengths)[::-1]
    least = max(min(MIN_FRAMES, len(ordered)), int(np.ceil(MIN_LENGTH_SHARE * len(ordered))))
    for length in ordered:
        near = ordered[np.abs(ordered - length) <= LENGTH_SPREAD * length]
        if len(near) >= least:
            return _middle(ordered, float(np.median(near)))
    return float(np.median(ordered))


def _middle(lengths: Floats, length: float) -> float:
    """Return the median of the lengths around a length, moved until it stays."""
    for _ in range(len(lengths)):
        median = float(np.median(lengths[np.abs(lengths - length) <= SHIFT_SPREAD * length]))
        if median == length:
            break
        length = median
    return length


def _tracks(observations: Sequence[Observation], tracking: TrackingConfig) -> dict[int, _Track]:
    """Return the open chains of all frames by the id that tracking gives them, all of one id in one direction."""
    tracker = Tracker(tracking)
    tracks: dict[int, _Track] = {}
    for frame, observation in enumerate(observations):
        chains = [(number, chain) for number, chain in enumerate(observation.detection.chains) if not chain.closed]
        if not chains:
            continue
        tracked = tracker.update(
            replace(observation.detection, chains=tuple(chain for _, chain in chains), crossings=(), junctions=(), objects=())
        )
        for (number, _), chain in zip(chains, tracked.chains, strict=True):
            assert chain.id is not None
            track = tracks.setdefault(chain.id, _Track([], {}))
            track.items.append((frame, number, chain))
            track.backwards[frame] = not np.array_equal(chain.joints[0], observation.detection.chains[number].joints[0])
    return tracks


def _is_whole(chain: Chain, length: float) -> bool:
    confident = chain.confidence >= MIN_CONFIDENCE and _shows_both_ends(chain)
    return confident and abs(chain.length - length) <= MAX_LENGTH_ERROR * length


def _shows_both_ends(chain: Chain) -> bool:
    return not (chain.depth_filled[0] or chain.depth_filled[-1])


def _is_part(id: int, tracks: dict[int, _Track], lengths: dict[int, float]) -> bool:
    """Tell whether in most frames of an id another object is too short by about the length of this one."""
    own = {frame: chain.length for frame, _, chain in tracks[id].items}
    count = 0
    for frame, length in own.items():
        for other, track in tracks.items():
            if other == id or lengths[other] <= length:
                continue
            there = [chain.length for at, _, chain in track.items if at == frame]
            if there and lengths[other] - there[0] >= 0.7 * length:
                count += 1
                break
    return count > MAX_PART_SHARE * len(own)


@dataclass
class _Candidate:
    """A track that may be an object: its length, and the items in which it is whole."""

    length: float
    track: _Track
    whole: list[tuple[int, int, Chain]]


def _linked(candidates: list[_Candidate]) -> list[_Candidate]:
    """Return the candidates, one for those of the same length that follow each other: the object moved while it was hidden."""
    result: list[_Candidate] = []
    for candidate in sorted(candidates, key=lambda candidate: candidate.whole[0][0]):
        for former in result:
            gap = candidate.track.items[0][0] - former.track.items[-1][0]
            if 0 < gap <= MAX_LINK_FRAMES and abs(candidate.length - former.length) <= 2 * LENGTH_SPREAD * former.length:
                _append(former, candidate)
                break
        else:
            result.append(candidate)
    return result


def _append(former: _Candidate, later: _Candidate) -> None:
    """Add a later candidate to a former one, in the direction in which it lies nearer."""
    last, first = former.whole[-1][2].joints[[0, -1]], later.whole[0][2].joints[[0, -1]]
    if np.linalg.norm(first[::-1] - last) < np.linalg.norm(first - last):
        later.track.backwards = {frame: not value for frame, value in later.track.backwards.items()}
    former.track = _Track([*former.track.items, *later.track.items], former.track.backwards | later.track.backwards)
    former.whole = [*former.whole, *later.whole]


def _object(number: int, candidate: _Candidate) -> SequenceObject:
    """Return an object from its whole chains; the anchors remember which of them run against its direction."""
    whole, backwards = candidate.whole, candidate.track.backwards
    radius = float(np.nanmedian([chain.radius for _, _, chain in whole]))
    segment = float(np.median([chain.segment_length for _, _, chain in whole]))
    anchors = tuple(Anchor(frame, chain, backwards[frame]) for frame, chain, _ in whole)
    return SequenceObject(number, candidate.length, radius, max(1, round(candidate.length / segment)), anchors)
