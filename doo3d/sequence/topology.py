"""Which objects of a capture meet at junctions, voted over its frames."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..geometry.disjoint_set import DisjointSet
from ..types import ChainEnd, Detection

MIN_PATTERN_SHARE = 1 / 3
"""Share of the frames with the most common answer in which a richer tree has to be seen: hidden parts take junctions away in many
frames, and a strand that only touches adds one in few."""


class Node(NamedTuple):
    """The junction at one end of an object of a capture.

    Attributes
    ----------
    junction
        number of the junction in the capture.
    confidence
        0 to 1, that the objects are joined there: the mean of those of the frames that tell.
    """

    junction: int
    confidence: float


Nodes = tuple[Node | None, Node | None]
"""The junctions at the first and the last end of an object; None for a tip."""


class ChainInFrame(NamedTuple):
    """A chain of one frame that tracking took for an object.

    Attributes
    ----------
    frame, chain
        index of the frame, and of the chain in its detection.
    backwards
        True if the chain runs against the direction of the object.
    """

    frame: int
    chain: int
    backwards: bool


Pattern = tuple[bool, bool]
"""Whether the first and the last end of a chain, in the direction of its object, are at junctions."""

OPEN: Pattern = (False, False)


def pattern_of(detection: Detection, chain: int, backwards: bool) -> Pattern:
    """Return which ends of a chain are at junctions of its frame, in the direction of its object."""
    joined = {end for junction in detection.junctions for end in junction.ends}
    first, last = ChainEnd(chain, 0) in joined, ChainEnd(chain, 1) in joined
    return (last, first) if backwards else (first, last)


def vote_pattern(patterns: Sequence[Pattern], least: int) -> Pattern:
    """Return the pattern with the most junctions of those that enough frames have.

    patterns : of the chains of one object. least : number of frames that have to agree at least.
    """
    counts = Counter(patterns)
    enough = max(least, MIN_PATTERN_SHARE * max(counts.values(), default=0))
    supported = [pattern for pattern, count in counts.items() if count >= enough]
    return max(supported, key=lambda pattern: (sum(pattern), counts[pattern], pattern), default=OPEN)


def vote_nodes(tracked: Sequence[Sequence[ChainInFrame]], detections: Sequence[Detection], least: int) -> list[Nodes]:
    """Return for each object the junctions at its ends, those that most frames agree on first; an end is at one junction.

    Parameters
    ----------
    tracked
        for each object its chains.
    detections
        all frames.
    least
        number of frames that have to agree on a junction at least.
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
    """Yield the confidence of each junction of each frame, and the ends (object, side) that meet there, if all are known."""
    places = {(each.frame, each.chain): (item, each.backwards) for item, chains in enumerate(tracked) for each in chains}
    for frame, detection in enumerate(detections):
        for junction in detection.junctions:
            found = [(places.get((frame, end.chain)), end.end) for end in junction.ends]
            ends = [(place[0], 1 - side if place[1] else side) for place, side in found if place is not None]
            if len(ends) == len(junction.ends) == len(set(ends)):
                yield junction.confidence, ends


def trees_of(nodes: Sequence[Nodes]) -> list[list[int]]:
    """Return the objects that junctions connect: indices, in ascending order, of each connected tree."""
    objects = DisjointSet(range(len(nodes)))
    owners: dict[int, int] = {}
    for item, pair in enumerate(nodes):
        for node in pair:
            if node is not None:
                objects.join(owners.setdefault(node.junction, item), item)
    trees: dict[int, list[int]] = {}
    for item, number in enumerate(objects.group.tolist()):
        trees.setdefault(number, []).append(item)
    return list(trees.values())


def vote_trunk(
    tree: Sequence[int],
    lengths: Mapping[int, float],
    tracked: Sequence[Sequence[ChainInFrame]],
    detections: Sequence[Detection],
) -> list[int]:
    """Return the objects along the trunk of a tree that most frames agree on; the longest object if none has them all.

    Parameters
    ----------
    tree
        the objects of the tree.
    lengths
        of each of them, m.
    tracked
        for each object its chains.
    detections
        all frames.
    """
    places = {(each.frame, each.chain): item for item in tree for each in tracked[item]}
    votes: Counter[tuple[int, ...]] = Counter()
    for frame, detection in enumerate(detections):
        for each in detection.objects:
            trunk = [places.get((frame, chain), -1) for chain in each.chains[: each.trunk]]
            if len(each.chains) == len(tree) and -1 not in trunk:
                votes[tuple(trunk if trunk[0] <= trunk[-1] else trunk[::-1])] += 1
    if not votes:
        return [max(tree, key=lambda item: lengths[item])]
    return list(max(votes.items(), key=lambda item: (item[1], item[0]))[0])
