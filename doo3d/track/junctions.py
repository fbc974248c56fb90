"""Join shapes of one frame at the junctions of their objects; assemble trees."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..links.branches import Branched
from ..links.branches.objects import Piece, laid_out
from ..types import Bools, Chain, Floats
from .junction_vote import Node, Nodes, trees_of
from .objects import SequenceObject
from .registration import exact_lengths, relax_lengths
from .shape import Shape

MIN_ENDS = 3
"""Smallest number of chain ends at a junction."""

ROUNDS, FREE_ROUNDS = 3, 5
"""Rounds in which junctions are placed between their ends and the ends are moved to them; equal segment lengths pull the ends
off again. Then rounds in which ends that are still too far off are moved without holding the visible joints."""

MAX_GAP_SEGMENTS = 0.3
"""Largest distance of an end from its junction, in segments."""

BLEND_RADII, MIN_BLEND_SEGMENTS = 6.0, 3
"""Length at a visible end over which its shift to the junction fades out: in radii, and smallest number of segments."""


def join_shapes(objects: Sequence[SequenceObject], shapes: Sequence[Shape | None]) -> list[Shape | None]:
    """Move the ends that meet at each junction to one point, in one frame.

    The point is the mean of the ends, weighted by how recently each was visible. Hidden joints move along with the end; if the
    object is visible next to its end, the shift fades out over a few radii.

    Parameters
    ----------
    objects
        the objects of the capture.
    shapes
        for each object its shape in the frame; None if it is missing.

    Returns
    -------
    The joined shapes, in the same order.
    """
    result = list(shapes)
    for number in range(ROUNDS + FREE_ROUNDS):
        points = _junction_points(objects, result)
        if not points:
            break
        pairs = zip(objects, result, strict=True)
        result = [shape and _pull_to_junctions(item, shape, points, number >= ROUNDS) for item, shape in pairs]
    return result


def _pull_to_junctions(item: SequenceObject, shape: Shape, points: Mapping[int, Floats], is_free: bool) -> Shape:
    """Return a shape with its ends moved to their junctions.

    points : (3,) m, position of each junction. is_free : whether visible joints may move, too; then ends that are near enough
    stay.
    """
    targets = [node and points.get(node.junction) for node in item.nodes]
    gaps = [np.linalg.norm(shape.joints[-side] - target) for side, target in enumerate(targets) if target is not None]
    if not gaps or (is_free and max(gaps) <= MAX_GAP_SEGMENTS * item.segment_length):
        return shape
    return _move_ends(item, shape, targets, np.zeros_like(shape.seen) if is_free else shape.seen)


def _junction_points(objects: Sequence[SequenceObject], shapes: Sequence[Shape | None]) -> dict[int, Floats]:
    """Return the position (3,) m of each junction with at least two known ends."""
    ends: dict[int, list[tuple[Floats, float]]] = {}
    for item, shape in zip(objects, shapes, strict=True):
        for side, node in enumerate(item.nodes):
            if node is not None and shape is not None:
                ends.setdefault(node.junction, []).append((shape.joints[-side], 1.0 / (1.0 + shape.age[-side]) ** 2))
    return {
        junction: np.average([point for point, _ in known], axis=0, weights=[weight for _, weight in known])
        for junction, known in ends.items()
        if len(known) > 1
    }


def _move_ends(item: SequenceObject, shape: Shape, targets: Sequence[Floats | None], seen: Bools) -> Shape:
    """Return an object with its first and last end moved to given points.

    Parameters
    ----------
    item
        the object.
    shape
        its shape.
    targets
        (3,) m, for the first and the last end; None for a free end.
    seen
        (M + 1,) bool, the joints that stay, except near the moved ends.
    """
    count = len(shape.joints)
    radius = float(np.nan_to_num(item.radius))
    blend = max(MIN_BLEND_SEGMENTS, int(np.ceil(BLEND_RADII * radius / item.segment_length)))
    at = np.arange(count)
    from_ends = np.minimum(count if targets[0] is None else at, count if targets[1] is None else at[::-1])
    held = seen & (from_ends >= min(blend, count // 2))
    fixed, shifts = held.copy(), np.zeros((count, 3))
    for index, target in ((0, targets[0]), (count - 1, targets[1])):
        if target is not None:
            fixed[index], shifts[index] = True, target - shape.joints[index]
    known = np.flatnonzero(fixed)
    moved = np.column_stack([np.interp(at, known, column) for column in shifts[known].T])
    joints = relax_lengths(shape.joints + moved, item.segment_length, fixed)
    return replace(shape, joints=exact_lengths(joints, item.segment_length))


def assemble(objects: Sequence[SequenceObject], chains: Sequence[Chain | None], others: Sequence[Chain]) -> Branched:
    """Assemble the chains of a frame to trees, sorted by descending total length.

    The trunk of a tree comes first. A junction with fewer than three chains in the frame is left out.

    Parameters
    ----------
    objects
        the objects of the capture.
    chains
        for each object its chain; None if it is missing.
    others
        further chains, each an object of its own.
    """
    ends = Counter(node.junction for item, chain in zip(objects, chains, strict=True) if chain for node in item.nodes if node)
    present = [(item, chain) for item, chain in zip(objects, chains, strict=True) if chain is not None]
    nodes: list[Nodes] = []
    met: dict[Node, list[Floats]] = {}
    for item, chain in present:
        first, last = (node if node and ends[node.junction] >= MIN_ENDS else None for node in item.nodes)
        nodes.append((first, last))
        for side, node in enumerate((first, last)):
            if node is not None:
                met.setdefault(node, []).append(chain.joints[-side])
    pieces = [
        Piece(chain, (first and first.junction, last and last.junction))
        for (_, chain), (first, last) in zip(present, nodes, strict=True)
    ]
    trees = [(tree, max(1, sum(present[k][0].is_trunk for k in tree))) for tree in trees_of(nodes)]
    trees += [([len(pieces) + k], 1) for k in range(len(others))]
    pieces += [Piece(chain, (None, None)) for chain in others]
    trees.sort(key=lambda tree: -sum(pieces[k].chain.length for k in tree[0]))
    places = {node.junction: (np.mean(points, axis=0), node.confidence) for node, points in met.items()}
    ordered, junctions, found = laid_out(trees, pieces, places)
    return Branched(ordered, tuple(junctions), tuple(found))
