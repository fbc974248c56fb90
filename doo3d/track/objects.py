"""Find the objects of a capture: lengths, radii, junctions and anchor frames."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..config import Config
from .junction_vote import OPEN, ChainInFrame, Nodes, trees_of, vote_nodes, vote_trunk
from .object_length import MIN_FRAMES, vote_length
from .observations import LENGTH_ERROR, MIN_JOINED_CONFIDENCE, Observation
from .registration import TOLERANCE_SHARE
from .rings import RingTrack, align_rings, ring_tracks
from .tracks import Track, are_side_by_side, lengths_of, merge_tracks, tracks_of
from .whole_chains import consistent_chains


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

    Chains are tracked in space, and tracks that may be one object are merged (`merge_tracks`). The length of an object is the
    longest length that enough frames agree on; its anchors are the chains of this length along which it moves least
    (`consistent_chains`). In a branched object, each part between two junctions or tips is an object of its own, and a junction
    must be detected in a minimum number of frames.

    Parameters
    ----------
    observations
        all frames, in order.
    config
        the settings: `merge.chains` (number of trees), `sequence.length` (of objects without junctions), and section
        `tracking`.

    Returns
    -------
    The objects with their anchors. The objects of one tree are successive; trees are sorted by the summed
    length of their chains over all frames, in descending order.
    """
    least = min(MIN_FRAMES, len(observations))
    rings = ring_tracks(observations, config.tracking, least)
    taken = {(frame, number) for ring in rings for frame, number, _ in ring.items}
    of_rings = [Track([ChainInFrame(*item) for item in ring.items]) for ring in rings]
    ring_lengths = [vote_length(*lengths_of(ring.closed)) for ring in rings]
    given = config.sequence.length
    candidates = []
    for track in merge_tracks(tracks_of(observations, config.tracking, taken), given, least):
        length = track.length(given)
        if all(are_side_by_side(track, ring, max(length, own), least) for ring, own in zip(of_rings, ring_lengths, strict=True)):
            candidates.append(Candidate(length, track, tuple(_anchors(track, length, observations, config))))
    enough = least if any(len(each.whole) >= least for each in candidates) or not _is_given(observations) else 1
    candidates = [candidate for candidate in candidates if len(candidate.whole) >= enough]
    found = [item for ring, own in zip(rings, ring_lengths, strict=True) for item in _ring(ring, observations, own, least)]
    return _numbered(candidates, found, observations, config.merge.chains, least)


def _is_given(observations: Sequence[Observation]) -> bool:
    """Return whether the caller specified the object or the number of objects: then one frame that shows it whole is enough."""
    return all(observation.is_given for observation in observations if observation.detection.chains)


class Candidate(NamedTuple):
    """A track that may be an object of the capture, with its length in m and the chains that show it whole."""

    length: float
    track: Track
    whole: tuple[ChainInFrame, ...]

    @property
    def parts(self) -> tuple[tuple[int, int], ...]:
        """(frame, index) of the chains that show only a part of the object.

        Chains that are longer than the whole are left out.
        """
        whole = {(item.frame, item.number) for item in self.whole}
        shorter = (item for item in self.track.items if item.chain.length <= (1 + LENGTH_ERROR) * self.length)
        return tuple((item.frame, item.number) for item in shorter if (item.frame, item.number) not in whole)

    @property
    def seen(self) -> float:
        """Length of the object, summed over all frames that show a part of it, m."""
        return self.length * len(self.track.items)


def _anchors(track: Track, length: float, observations: Sequence[Observation], config: Config) -> list[ChainInFrame]:
    """Return the chains of a track that show its object whole, in one direction.

    Unless the caller specified the object, chains of low confidence are left out. length : of the object, m.
    """
    sure = [
        item
        for item in track.whole(length)
        if observations[item.frame].object_given or item.chain.confidence >= MIN_JOINED_CONFIDENCE
    ]
    return consistent_chains(sure, config.tracking, track.pattern == OPEN)


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
    tracked = [[item for item in each.track.items if item.pattern == each.track.pattern] for each in candidates]
    nodes = vote_nodes(tracked, detections, least)
    lengths = {number: candidate.length for number, candidate in enumerate(candidates)}
    trees = sorted(trees_of(nodes), key=lambda tree: -sum(candidates[number].seen for number in tree))
    trees = [tree for tree in trees if len(tree) > 1 or not _is_part(candidates, tree[0], least)]
    objects: list[SequenceObject] = []
    if count is not None and rings:
        weights = [sum(candidates[number].seen for number in tree) for tree in trees]
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


def _is_part(candidates: Sequence[Candidate], number: int, least: int) -> bool:
    """Return whether a strand between junctions that belongs to no tree is a part of another object."""
    own, others = candidates[number], [each for k, each in enumerate(candidates) if k != number]
    apart = (are_side_by_side(own.track, other.track, max(own.length, other.length), least) for other in others)
    return own.track.pattern != OPEN and not all(apart)


def _object(number: int, candidate: Candidate) -> SequenceObject:
    """Return a candidate as an object."""
    whole = [item.chain for item in candidate.whole]
    segment = float(np.median([chain.segment_length for chain in whole]))
    radius = float(np.nanmedian([chain.radius for chain in whole]))
    anchors = tuple(Anchor(item.frame, item.number, item.backwards) for item in candidate.whole)
    return SequenceObject(number, candidate.length, radius, max(1, round(candidate.length / segment)), anchors)
