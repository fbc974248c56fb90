"""Find the objects of a capture, with their lengths, radii and junctions, and the frames in which they are seen whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..config import Config, TrackingConfig
from ..types import Chain, Floats
from .observations import LENGTH_ERROR, MIN_JOINED_CONFIDENCE, Observation
from .topology import OPEN, ChainInFrame, Nodes, Pattern, pattern_of, trees_of, vote_nodes, vote_pattern, vote_trunk
from .tracking import Tracker

JUNCTION_SLACK_RADII = 1.5
"""Radii per junction at its ends by which a chain's length may differ further: so far junctions shift from frame to frame."""

MIN_LENGTH_SHARE = 0.1
"""Share of the chains that must agree on a length, within LENGTH_ERROR: chains are too short wherever an end is hidden, hardly
ever too long, so the object's length is the longest that enough chains have."""

MIN_FRAMES = 3
"""Fewest frames in which an object is seen whole; all frames in a shorter capture."""

CONTEXT = 90
"""Frames over which an object is followed though it is not seen: up to so many frames after a chain was lost, one of its length
is taken for it, wherever it lies, and so many are read before and after a window. 3 s of video."""

MAX_PART_SHARE = 0.5
"""Share of its frames in which a chain may fill what is missing of another object; more, and it is a part of that."""


@dataclass(frozen=True)
class Anchor:
    """A frame in which an object is seen whole, or its gaps are filled with confidence.

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
    """A cable, or the part of a branched object between two junctions or tips, with its constant properties.

    Attributes
    ----------
    id
        number of the object in the capture, from 0 on.
    length
        m, arc length.
    radius
        m; NaN if unknown.
    segments
        number of segments of its chain in every frame.
    anchors
        the frames in which the object is seen whole, in order.
    nodes
        the junctions at its first and last end; None for a tip.
    is_trunk
        True for a part of the trunk of a tree. The objects of one tree are successive, those of its trunk first.
    parts
        (frame, chain) of the chains that are only a part of the object; known for objects with junctions.
    """

    id: int
    length: float
    radius: float
    segments: int
    anchors: tuple[Anchor, ...]
    nodes: Nodes = (None, None)
    is_trunk: bool = True
    parts: tuple[tuple[int, int], ...] = ()

    @property
    def segment_length(self) -> float:
        """The length of a segment, m."""
        return self.length / self.segments


@dataclass
class _Track:
    """The chains of one id, in the order of their frames: (frame, chain index, chain, in the direction of tracking)."""

    items: list[tuple[int, int, Chain]]
    backwards: dict[int, bool]
    patterns: dict[int, Pattern]
    pattern: Pattern = OPEN

    @property
    def lengths(self) -> Floats:
        """The lengths (K,) m of the chains that show both ends; of all if there are none.

        Chains that end at other junctions than most are left out.
        """
        items = [item for item in self.items if self.patterns[item[0]] == self.pattern]
        shown = [chain.length for _, _, chain in items if _shows_both_ends(chain, self.pattern)]
        return np.array(shown or [chain.length for _, _, chain in items or self.items])

    def is_whole(self, item: tuple[int, int, Chain], length: float) -> bool:
        """Tell whether one of its chains is the whole object, of a length in m."""
        frame, _, chain = item
        if chain.confidence < MIN_JOINED_CONFIDENCE or self.patterns[frame] != self.pattern:
            return False
        slack = JUNCTION_SLACK_RADII * sum(self.pattern) * np.nan_to_num(chain.radius)
        return _shows_both_ends(chain, self.pattern) and abs(chain.length - length) <= LENGTH_ERROR * length + slack

    @property
    def tracked(self) -> list[ChainInFrame]:
        """The chains that end at junctions as most do, by frame and index."""
        return [
            ChainInFrame(frame, chain, self.backwards[frame])
            for frame, chain, _ in self.items
            if self.patterns[frame] == self.pattern
        ]


def find_objects(observations: Sequence[Observation], config: Config) -> list[SequenceObject]:
    """Find the objects of a capture by a vote over all frames.

    Chains are tracked from frame to frame. The length of an object is the longest length on which enough frames agree. A chain
    that appears only while another object is too short by the same length is a part of that object. Rings are not followed. In a
    branched object, each part between two junctions or tips is an object of its own, and a junction needs a minimum number of
    frames.

    Parameters
    ----------
    observations
        all frames, in order.
    config
        the settings: `sequence.chains` (the number of trees), `sequence.length` (of objects without junctions), and those of
        tracking.

    Returns
    -------
    The objects with their anchors. Those of one tree are successive; trees are sorted by the summed length of their chains in all
    frames, in descending order.
    """
    tracks = _tracks(observations, config.tracking)
    least = min(MIN_FRAMES, len(observations))
    for track in tracks.values():
        track.pattern = vote_pattern(list(track.patterns.values()), least)
    lengths = {
        id: (config.sequence.length if track.pattern == OPEN else None) or vote_length(track.lengths)
        for id, track in tracks.items()
    }
    candidates = []
    for id, track in tracks.items():
        whole = [item for item in track.items if track.is_whole(item, lengths[id])]
        is_part = _is_part(id, tracks, lengths)
        if len(whole) >= least and (track.pattern != OPEN or not is_part):
            candidates.append(_Candidate(lengths[id], track, whole, is_part))
    linked = _linked(candidates)
    return _numbered(linked, observations, config.sequence.chains, least)


def _numbered(
    candidates: Sequence[_Candidate], observations: Sequence[Observation], count: int | None, least: int
) -> list[SequenceObject]:
    """Return the candidates as objects, tree by tree, the trees that are seen longest first, `count` of them at most."""
    detections = [observation.detection for observation in observations]
    tracked = [candidate.track.tracked for candidate in candidates]
    nodes = vote_nodes(tracked, detections, least)
    lengths = {number: candidate.length for number, candidate in enumerate(candidates)}
    trees = [tree for tree in trees_of(nodes) if len(tree) > 1 or not candidates[tree[0]].is_part]
    trees.sort(key=lambda tree: -sum(len(candidates[number].track.items) * lengths[number] for number in tree))
    objects: list[SequenceObject] = []
    for tree in trees[:count]:
        trunk = tree if len(tree) == 1 else vote_trunk(tree, lengths, tracked, detections)
        rest = sorted((number for number in tree if number not in trunk), key=lambda number: -lengths[number])
        for number in [*trunk, *rest]:
            item = _object(len(objects), candidates[number])
            if len(tree) > 1:
                item = replace(item, nodes=nodes[number], is_trunk=number in trunk, parts=candidates[number].parts)
            objects.append(item)
    return objects


def vote_length(lengths: Floats) -> float:
    """Return the longest length, m, on which enough of the lengths (K,) m agree within 2 %.

    The result is moved to the median of the lengths around it until it converges (mean shift with the median), since the longest
    measurements are a little too long.
    """
    ordered = np.sort(lengths)[::-1]
    least = max(min(MIN_FRAMES, len(ordered)), int(np.ceil(MIN_LENGTH_SHARE * len(ordered))))
    for length in ordered:
        near = ordered[np.abs(ordered - length) <= LENGTH_ERROR * length]
        if len(near) >= least:
            return _middle(ordered, float(np.median(near)))
    return float(np.median(ordered))


def _middle(lengths: Floats, length: float) -> float:
    """Return the median of the lengths around a length, moved until it stays."""
    for _ in range(len(lengths)):
        median = float(np.median(lengths[np.abs(lengths - length) <= LENGTH_ERROR * length]))
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
            track = tracks.setdefault(chain.id, _Track([], {}, {}))
            track.items.append((frame, number, chain))
            backwards = not np.array_equal(chain.joints[0], observation.detection.chains[number].joints[0])
            track.backwards[frame] = backwards
            track.patterns[frame] = pattern_of(observation.detection, number, backwards)
    return tracks


def _shows_both_ends(chain: Chain, pattern: Pattern) -> bool:
    """Tell whether both ends were seen; one at a junction is where the strands that meet there say."""
    return not (chain.depth_filled[0] and not pattern[0]) and not (chain.depth_filled[-1] and not pattern[1])


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
    """A track that may be an object: its length, the items in which it is whole, and whether it may be a part of another."""

    length: float
    track: _Track
    whole: list[tuple[int, int, Chain]]
    is_part: bool

    @property
    def parts(self) -> tuple[tuple[int, int], ...]:
        """The (frame, chain) of the chains that are no longer than the whole, but not the whole."""
        whole = {(frame, chain) for frame, chain, _ in self.whole}
        longest = (1 + LENGTH_ERROR) * self.length
        return tuple((frame, n) for frame, n, chain in self.track.items if chain.length <= longest and (frame, n) not in whole)


def _linked(candidates: list[_Candidate]) -> list[_Candidate]:
    """Return the candidates, one for those of the same length that may be one object, which moved while it was hidden.

    Of several that were lost, such as branches of one length, the nearest is taken.
    """
    result: list[_Candidate] = []
    for candidate in sorted(candidates, key=lambda candidate: candidate.whole[0][0]):
        alike = [former for former in result if _may_be_one(former, candidate)]
        if alike and candidate.track.pattern == OPEN:
            _append(alike[0], candidate)
        elif alike:
            _append(min(alike, key=lambda former: _distance(former, candidate)), candidate)
        else:
            result.append(candidate)
    return result


def _may_be_one(former: _Candidate, later: _Candidate) -> bool:
    """Tell whether two candidates of one length follow each other, or in no frame show more of a cable together than its length.

    Tracking gives the two parts of a cable that a hand divides one id each, and later the whole either of them.
    """
    is_alike = later.track.pattern in (former.track.pattern, former.track.pattern[::-1])
    if not is_alike or abs(later.length - former.length) > 2 * LENGTH_ERROR * former.length:
        return False
    gap = later.track.items[0][0] - former.track.items[-1][0]
    if gap > 0 or later.track.pattern != OPEN:
        return 0 < gap <= CONTEXT
    seen = {frame: chain.length for frame, _, chain in former.track.items}
    longest = (1 + LENGTH_ERROR) * former.length
    return all(seen.get(frame, 0.0) + chain.length <= longest for frame, _, chain in later.track.items if frame in seen)


def _distance(former: _Candidate, later: _Candidate) -> float:
    """Return how far apart the middles of two candidates are, where one was lost and the other comes, m."""
    return float(np.linalg.norm(former.whole[-1][2].joints.mean(axis=0) - later.whole[0][2].joints.mean(axis=0)))


def _append(former: _Candidate, later: _Candidate) -> None:
    """Add a candidate to a former one, with the junction at the same end or in the direction in which it lies nearer.

    Of a frame in which both have a chain, the longer is kept.
    """
    start = later.whole[0]
    nearest = min(former.whole, key=lambda item: abs(item[0] - start[0]))
    last, first = nearest[2].joints[[0, -1]], start[2].joints[[0, -1]]
    is_nearer_backwards = bool(np.linalg.norm(first[::-1] - last) < np.linalg.norm(first - last))
    pattern = later.track.pattern
    if is_nearer_backwards if pattern[0] == pattern[1] else pattern != former.track.pattern:
        later.track.backwards = {frame: not value for frame, value in later.track.backwards.items()}
        later.track.patterns = {frame: value[::-1] for frame, value in later.track.patterns.items()}
    kept = {item[0]: (item, former.track) for item in former.track.items}
    for item in later.track.items:
        if item[0] not in kept or item[2].length > kept[item[0]][0][2].length:
            kept[item[0]] = item, later.track
    items = [kept[frame][0] for frame in sorted(kept)]
    backwards = {frame: track.backwards[frame] for frame, (_, track) in kept.items()}
    patterns = {frame: track.patterns[frame] for frame, (_, track) in kept.items()}
    former.track = _Track(items, backwards, patterns, former.track.pattern)
    former.whole = sorted([*former.whole, *later.whole], key=lambda item: item[0])


def _object(number: int, candidate: _Candidate) -> SequenceObject:
    """Return an object from its whole chains; the anchors remember which of them run against its direction."""
    whole, backwards = candidate.whole, candidate.track.backwards
    radius = float(np.nanmedian([chain.radius for _, _, chain in whole]))
    segment = float(np.median([chain.segment_length for _, _, chain in whole]))
    anchors = tuple(Anchor(frame, chain, backwards[frame]) for frame, chain, _ in whole)
    return SequenceObject(number, candidate.length, radius, max(1, round(candidate.length / segment)), anchors)
