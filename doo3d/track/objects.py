"""Find the objects of a capture, with their lengths, radii and junctions, and the frames in which they are seen whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..config import Config
from ..types import Chain
from .depth_smoothing import smooth_depth_over_time
from .junction_vote import OPEN, Nodes, trees_of, vote_nodes, vote_pattern, vote_trunk
from .object_candidates import Candidate, drop_shortened, link_candidates
from .object_length import track_length, vote_length
from .observations import MIN_JOINED_CONFIDENCE, Observation
from .registration import TOLERANCE_SHARE
from .rings import RingTrack, align_rings, ring_tracks
from .tracks import MIN_FRAMES, Track, drop_leaps, lengths_of, tracks_of
from .world_frame import in_world

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
    start
        where the first joint of the chain is on a ring, a share of its length; 0 for a cable.
    """

    frame: int
    chain: int
    backwards: bool
    start: float = 0.0


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


def find_smoothed_objects(observations: Sequence[Observation], config: Config) -> tuple[list[Observation], list[SequenceObject]]:
    """Return observations with their depth smoothed over time, and the objects of their capture, in the world if it is known.

    observations, config : as for `find_objects`; the observations in the frame of their camera.
    """
    steady = smooth_depth_over_time(observations, config.tracking, config.sequence.length)
    return steady, find_objects(in_world(steady), config)


def find_objects(observations: Sequence[Observation], config: Config) -> list[SequenceObject]:
    """Find the objects of a capture by a vote over all frames.

    Chains are tracked from frame to frame, in space: where a cable is lost for a while, the image does not tell which end is
    which. The length of an object is the longest length on which enough frames agree. A chain that appears only while another
    object is too short by the same length is a part of that object. If there are fewer objects than given, those that most frames
    show are taken, too, though no frame is sure of them. In a branched object, each part between two junctions or tips is an
    object of its own, and a junction needs a minimum number of frames.

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
    least = min(MIN_FRAMES, len(observations))
    rings = ring_tracks(observations, config.tracking, least)
    taken = {(frame, number) for ring in rings for frame, number, _ in ring.items}
    tracks = tracks_of(observations, config.tracking, taken)
    for track in tracks.values():
        track.pattern = vote_pattern(list(track.patterns.values()), least)
    lengths = {id: track_length(track, config.sequence.length) for id, track in tracks.items()}
    candidates = []
    of_rings = {-1 - k: Track(list(ring.items), {}, {}) for k, ring in enumerate(rings)}  # negative: ids of no track
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
    """Return the items of a track that show its object whole, of a length in m, with at least some confidence."""
    sure = [item for item in track.items if item[2].confidence >= confidence]
    return drop_leaps([item for item in sure if track.is_whole(item, length)], config.tracking)


def _most_show(track: Track, frames: int) -> bool:
    """Tell whether more than half of the frames show a track."""
    return 2 * len(track.items) > frames


def _ring(track: RingTrack, observations: Sequence[Observation], length: float, least: int) -> list[SequenceObject]:
    """Return a ring as an object without a number; None if too few frames show it whole."""
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
    """Return the candidates as objects, tree by tree, the trees that are seen longest first, and rings.

    `count` of them at most; then a ring counts as a tree, by the summed length of its chains.
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
    """Tell whether in most frames of an id another object is too short by about the length of this one."""
    chains = {other: {frame: chain.length for frame, _, chain in track.items} for other, track in tracks.items()}
    own = chains.pop(id)
    count = sum(
        any(lengths[k] > length and lengths[k] - each.get(frame, np.inf) >= 0.7 * length for k, each in chains.items())
        for frame, length in own.items()
    )
    return count > MAX_PART_SHARE * len(own)


def _object(number: int, candidate: Candidate) -> SequenceObject:
    """Return an object from its whole chains; the anchors remember which of them run against its direction."""
    whole, backwards = candidate.whole, candidate.track.backwards
    radius = float(np.nanmedian([chain.radius for _, _, chain in whole]))
    segment = float(np.median([chain.segment_length for _, _, chain in whole]))
    anchors = tuple(Anchor(frame, chain, backwards[frame]) for frame, chain, _ in whole)
    return SequenceObject(number, candidate.length, radius, max(1, round(candidate.length / segment)), anchors)
