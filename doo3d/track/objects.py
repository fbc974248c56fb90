"""Find the objects of a capture: lengths, radii, junctions and anchor frames."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..config import Config
from ..types import Chain
from .junction_vote import OPEN, Nodes, trees_of, vote_nodes, vote_pattern, vote_trunk
from .object_candidates import Candidate, drop_shortened, link_candidates
from .object_length import track_length, vote_length
from .observations import MIN_JOINED_CONFIDENCE, Observation
from .registration import TOLERANCE_SHARE
from .rings import RingTrack, align_rings, ring_tracks
from .tracks import MIN_FRAMES, Track, drop_leaps, lengths_of, tracks_of

MAX_PART_SHARE = 0.5
"""Fraction of its frames in which a chain may fill a missing part of another object; above it, the chain is a part of that
object."""


@dataclass(frozen=True)
class Anchor:
    """A frame in which an object is seen whole, or with gaps filled with confidence.

    Attributes
    ----------
    frame
        index of the frame.
    chain
        index of the chain in the detection of the frame.
    backwards
        True if the chain runs against the direction of the object.
    start
        position of the chain's first joint on a ring, as a fraction of the ring's length; 0 for a cable.
    """

    frame: int
    chain: int
    backwards: bool
    start: float = 0.0


@dataclass(frozen=True)
class SequenceObject:
    """A cable, or a branch between two junctions or tips, with constant properties.

    Attributes
    ----------
    id
        number of the object in the capture, from 0.
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
        True for a part of the trunk of a tree. The objects of one tree are successive, with the trunk first.
    parts
        (frame, chain) of the chains that are only a part of the object; known for rings and for objects with junctions.
    closed
        True for a ring.
    """

    id: int
    length: float
    radius: float
    segments: int
    anchors: tuple[Anchor, ...]
    nodes: Nodes = (None, None)
    is_trunk: bool = True
    parts: tuple[tuple[int, int], ...] = ()
    closed: bool = False

    @property
    def segment_length(self) -> float:
        """The length of a segment, m."""
        return self.length / self.segments


def find_objects(observations: Sequence[Observation], config: Config) -> list[SequenceObject]:
    """Find the objects of a capture by a vote over all frames.

    Chains are tracked in space: the image does not decide which end is which after a cable was lost for a while. The length of
    an object is the longest length that enough frames agree on. A chain is a part of another object if it appears only while
    that object is too short by the same length. If fewer objects are found than given, chains that are in more than half of
    the frames are added, even if no frame is certain of them. In a branched object, each part between two junctions or tips is
    an object of its own, and a junction must be detected in a minimum number of frames.

    Parameters
    ----------
    observations
        all frames, in order.
    config
        the settings: `sequence.chains` (number of trees), `sequence.length` (of objects without junctions), and section
        `tracking`.

    Returns
    -------
    The objects with their anchors. The objects of one tree are successive; trees are sorted by the summed
    length of their chains over all frames, in descending order.
    """
    least = min(MIN_FRAMES, len(observations))
    rings = ring_tracks(observations, config.tracking, least)
    taken = {(frame, number) for ring in rings for frame, number, _ in ring.items}
    tracks = tracks_of(observations, config.tracking, taken)
    for track in tracks.values():
        track.pattern = vote_pattern(list(track.patterns.values()), least)
    lengths = {id: track_length(track, config.sequence.length) for id, track in tracks.items()}
    candidates = []
    of_rings = {-1 - k: Track(list(ring.items), {}, {}) for k, ring in enumerate(rings)}  # negative ids are of no track
    ring_lengths = {id: vote_length(*lengths_of(rings[-1 - id].closed)) for id in of_rings}
    unsure = []
    for id, track in tracks.items():
        is_part = _is_part(id, tracks | of_rings, lengths | ring_lengths)
        if is_part and track.pattern == OPEN:
            continue
        whole = _whole(track, lengths[id], config)
        if len(whole) >= least:
            candidates.append(Candidate(lengths[id], track, whole, is_part))
        elif _most_show(track, len(observations)):
            unsure.append(Candidate(lengths[id], track, _whole(track, lengths[id], config, 0.0), is_part))
    missing = (config.sequence.chains or 0) - len(candidates) - len(rings)
    candidates += [candidate for candidate in unsure if len(candidate.whole) >= least][: max(0, missing)]
    cables = drop_shortened(link_candidates(candidates), config.tracking)
    for cable in cables:
        length = track_length(cable.track, config.sequence.length)
        whole = _whole(cable.track, length, config)
        if len(whole) >= least:
            cable.length, cable.whole = length, whole
    found = [ring for id in of_rings for ring in _ring(rings[-1 - id], observations, ring_lengths[id], least)]
    return _numbered(cables, found, observations, config.sequence.chains, least)


def _whole(
    track: Track, length: float, config: Config, confidence: float = MIN_JOINED_CONFIDENCE
) -> list[tuple[int, int, Chain]]:
    """Return the items of a track that show its object whole, with enough confidence.

    length : of the object, m. confidence : smallest confidence of a chain.
    """
    sure = [item for item in track.items if item[2].confidence >= confidence]
    return drop_leaps([item for item in sure if track.is_whole(item, length)], config.tracking)


def _most_show(track: Track, frames: int) -> bool:
    """Return whether a track is in more than half of the frames."""
    return 2 * len(track.items) > frames


def _ring(track: RingTrack, observations: Sequence[Observation], length: float, least: int) -> list[SequenceObject]:
    """Return a ring as a list of one object; empty if too few frames show it whole.

    least : smallest number of frames.
    """
    whole = [item for item in track.items if track.is_whole(item[2], length)]
    if len(whole) < least:
        return []
    segment = float(np.median([chain.segment_length for _, _, chain in whole]))
    segments = max(MIN_FRAMES, round(length / segment))
    alignments = align_rings(track, observations, length, segments, TOLERANCE_SHARE * length)
    anchors = tuple(Anchor(frame, chain, *each) for (frame, chain, _), each in zip(whole, alignments, strict=True))
    radius = float(np.nanmedian([chain.radius for _, _, chain in whole]))
    others = {(frame, number) for frame, number, _ in track.items} - {(anchor.frame, anchor.chain) for anchor in anchors}
    return [SequenceObject(0, length, radius, segments, anchors, parts=tuple(sorted(others)), closed=True)]


def _numbered(
    candidates: Sequence[Candidate],
    rings: Sequence[SequenceObject],
    observations: Sequence[Observation],
    count: int | None,
    least: int,
) -> list[SequenceObject]:
    """Return candidates and rings as numbered objects, tree by tree.

    Trees are sorted by the summed length of their chains over all frames, in descending order; rings come last.

    Parameters
    ----------
    candidates
        the cables and branches.
    rings
        the rings, each a tree of its own.
    observations
        all frames, in order.
    count
        number of trees to keep, by the summed length of their chains; None keeps all.
    least
        smallest number of frames that must agree on a junction.
    """
    detections = [observation.detection for observation in observations]
    tracked = [candidate.track.tracked for candidate in candidates]
    nodes = vote_nodes(tracked, detections, least)
    lengths = {number: candidate.length for number, candidate in enumerate(candidates)}
    trees = [tree for tree in trees_of(nodes) if len(tree) > 1 or not candidates[tree[0]].is_part]
    seen = [len(candidate.track.items) * candidate.length for candidate in candidates]
    trees.sort(key=lambda tree: -sum(seen[number] for number in tree))
    objects: list[SequenceObject] = []
    if count is not None and rings:
        weights = [sum(seen[number] for number in tree) for tree in trees]
        weights += [len(ring.anchors) * ring.length for ring in rings]
        kept = sorted(range(len(weights)), key=lambda k: -weights[k])[:count]
        rings = [ring for k, ring in enumerate(rings) if len(trees) + k in kept]
        count -= len(rings)
    for tree in trees[:count]:
        trunk = tree if len(tree) == 1 else vote_trunk(tree, lengths, tracked, detections)
        rest = sorted((number for number in tree if number not in trunk), key=lambda number: -lengths[number])
        for number in [*trunk, *rest]:
            item = _object(len(objects), candidates[number])
            if len(tree) > 1:
                item = replace(item, nodes=nodes[number], is_trunk=number in trunk, parts=candidates[number].parts)
            objects.append(item)
    return [*objects, *(replace(ring, id=len(objects) + k) for k, ring in enumerate(rings))]


def _is_part(id: int, tracks: dict[int, Track], lengths: dict[int, float]) -> bool:
    """Return whether a track is mostly the missing part of a longer object.

    lengths : m, of the object of each track. In such a frame, the other object is too short by at least 0.7 times the length
    of this one.
    """
    chains = {other: {frame: chain.length for frame, _, chain in track.items} for other, track in tracks.items()}
    own = chains.pop(id)
    count = sum(
        any(lengths[k] > length and lengths[k] - each.get(frame, np.inf) >= 0.7 * length for k, each in chains.items())
        for frame, length in own.items()
    )
    return count > MAX_PART_SHARE * len(own)


def _object(number: int, candidate: Candidate) -> SequenceObject:
    """Return a candidate as an object, with the direction of each chain."""
    whole, backwards = candidate.whole, candidate.track.backwards
    radius = float(np.nanmedian([chain.radius for _, _, chain in whole]))
    segment = float(np.median([chain.segment_length for _, _, chain in whole]))
    anchors = tuple(Anchor(frame, chain, backwards[frame]) for frame, chain, _ in whole)
    return SequenceObject(number, candidate.length, radius, max(1, round(candidate.length / segment)), anchors)
