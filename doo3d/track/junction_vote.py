"""Decide the junctions between the objects of a capture by a vote."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..geometry.disjoint_set import DisjointSet
from ..types import Chain, ChainEnd, Detection, Floats

MIN_PATTERN_SHARE = 1 / 3
"""Smallest number of frames of a pattern with more junctions, relative to the most common pattern: occlusion hides junctions
in many frames, while a strand that only touches adds one in few."""


class Node(NamedTuple):
    """The junction at one end of an object of a capture.

    Attributes
    ----------
    junction
        number of the junction in the capture.
    confidence
        0 to 1, mean confidence of the junction over the frames in which it was detected.
    """

    junction: int
    confidence: float


Nodes = tuple[Node | None, Node | None]
"""Junctions at the first and the last end of an object; None for a tip."""


Pattern = tuple[bool, bool]
"""For the first and the last end of an object, True if it is at a junction."""

OPEN: Pattern = (False, False)


class ChainInFrame(NamedTuple):
    """A chain of one frame that tracking assigned to an object.

    Attributes
    ----------
    frame, number
        index of the frame, and of the chain in its detection.
    chain
        the chain, as detected.
    backwards
        True if the chain runs against the direction of the object.
    pattern
        which ends are at junctions of the frame, in the direction of the object.
    track
        number of the track, in which chains follow each other from frame to frame.
    ends
        kind of its less certain end, as in `strand_ends`: TIP, UNKNOWN or CUT_OFF.
    """

    frame: int
    number: int
    chain: Chain
    backwards: bool = False
    pattern: Pattern = OPEN
    track: int = 0
    ends: float = 0.0

    def reversed(self) -> ChainInFrame:
        """Return the same chain for an object that runs in the opposite direction."""
        return self._replace(backwards=not self.backwards, pattern=self.pattern[::-1])

    def nodes(self, count: int) -> Floats:
        """Return evenly spaced points along the chain in the direction of the object, (count, 3) m."""
        points = self.chain.nodes(count)
        return points[::-1] if self.backwards else points


def pattern_of(detection: Detection, chain: int, backwards: bool) -> Pattern:
    """Return which ends of a chain are at junctions of its frame.

    backwards : whether the chain runs against the direction of its object.
    """
    joined = {end for junction in detection.junctions for end in junction.ends}
    first, last = ChainEnd(chain, 0) in joined, ChainEnd(chain, 1) in joined
    return (last, first) if backwards else (first, last)


def vote_pattern(patterns: Sequence[Pattern], least: int) -> Pattern:
    """Return the pattern with the most junctions that enough frames have.

    patterns : of all chains of one object. least : smallest number of frames that must agree.
    """
    counts = Counter(patterns)
    enough = max(least, MIN_PATTERN_SHARE * max(counts.values(), default=0))
    supported = [pattern for pattern, count in counts.items() if count >= enough]
    return max(supported, key=lambda pattern: (sum(pattern), counts[pattern], pattern), default=OPEN)


def vote_nodes(tracked: Sequence[Sequence[ChainInFrame]], detections: Sequence[Detection], least: int) -> list[Nodes]:
    """Assign each end of an object to at most one junction, by the number of frames.

    Parameters
    ----------
    tracked
        for each object its chains in all frames.
    detections
        the detections of all frames.
    least
        smallest number of frames that must agree on a junction.

    Returns
    -------
    For each object the junctions at its first and last end; None for a tip.
    """
    votes: dict[frozenset[tuple[int, int]], list[float]] = {}
    for confidence, met in _junctions(tracked, detections):
        votes.setdefault(frozenset(met), []).append(confidence)
    nodes: list[list[Node | None]] = [[None, None] for _ in tracked]
    number = 0
    for ends, confidences in sorted(votes.items(), key=lambda item: (-len(item[1]), sorted(item[0]))):
        if len(confidences) < least or any(nodes[item][side] is not None for item, side in ends):
            continue
        for item, side in ends:
            nodes[item][side] = Node(number, float(np.mean(confidences)))
        number += 1
    return [(first, last) for first, last in nodes]


def _junctions(
    tracked: Sequence[Sequence[ChainInFrame]], detections: Sequence[Detection]
) -> Iterator[tuple[float, list[tuple[int, int]]]]:
    """Yield the confidence and the ends of each junction of each frame.

    An end is (object, side). Junctions with an end of no object are left out.
    """
    places = {(each.frame, each.number): (item, each.backwards) for item, chains in enumerate(tracked) for each in chains}
    for frame, detection in enumerate(detections):
        for junction in detection.junctions:
            found = [(places.get((frame, end.chain)), end.end) for end in junction.ends]
            ends = [(place[0], 1 - side if place[1] else side) for place, side in found if place is not None]
            if len(ends) == len(junction.ends) == len(set(ends)):
                yield junction.confidence, ends


def trees_of(nodes: Sequence[Nodes]) -> list[list[int]]:
    """Return the indices of the objects of each tree, ascending.

    A tree is a set of objects that are connected by junctions.
    """
    objects = DisjointSet(range(len(nodes)))
    owners: dict[int, int] = {}
    for item, pair in enumerate(nodes):
        for node in pair:
            if node is not None:
                objects.join(owners.setdefault(node.junction, item), item)
    return objects.members()


def vote_trunk(
    tree: Sequence[int], lengths: Mapping[int, float], tracked: Sequence[Sequence[ChainInFrame]], detections: Sequence[Detection]
) -> list[int]:
    """Return the objects along the trunk of a tree, by a vote of frames.

    Parameters
    ----------
    tree
        indices of the objects of the tree.
    lengths
        m, length of each object.
    tracked
        for each object its chains in all frames.
    detections
        the detections of all frames.

    Returns
    -------
    The indices in order along the trunk; the longest object alone if no frame shows the whole tree.
    """
    places = {(each.frame, each.number): item for item in tree for each in tracked[item]}
    votes: Counter[tuple[int, ...]] = Counter()
    for frame, detection in enumerate(detections):
        for each in detection.objects:
            trunk = [places.get((frame, chain), -1) for chain in each.chains[: each.trunk]]
            if len(each.chains) == len(tree) and -1 not in trunk:
                votes[tuple(trunk if trunk[0] <= trunk[-1] else trunk[::-1])] += 1
    if not votes:
        return [max(tree, key=lambda item: lengths[item])]
    return list(max(votes.items(), key=lambda item: (item[1], item[0]))[0])
