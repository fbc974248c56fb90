"""Choose the junctions among all candidates, and cut the chains there."""

import itertools
import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ...geometry.disjoint_set import DisjointSet
from ...geometry.equal_segments import equal_segments
from ...geometry.gap_path import gap_path
from ...geometry.polyline import resample
from ...geometry.radii import NODE_RADII
from ...kernels import nearest
from ...types import Chain, Connection, Floats, Junction, LinearObject
from ..costs import GAP_LINK_COST
from ..ends import End
from .clouds import HIDDEN_WEIGHT
from .objects import Node, Piece, assembled
from .strands import ARM_RADII, JUNCTION_RADII, ContactCandidate, SampledChain, stretch_inside

Stop: TypeAlias = "tuple[float, int | None]"
"""Arc length on a strand, m (px in 2-D), and the index of the node there; None at a tip."""


def choose(candidates: Sequence[ContactCandidate], count: int) -> list[ContactCandidate]:
    """Choose the contacts that are junctions, and the links: a maximum-weight spanning forest (Kruskal), with the gain as weight.

    No contact closes a ring of strands, so objects are trees, and an end is in one contact or link at most.

    candidates : all possible contacts and links. count : number of strands.

    Returns
    -------
    The candidates chosen, by descending gain, all above 0.
    """
    objects = DisjointSet(range(count))
    used: set[End] = set()
    chosen: list[ContactCandidate] = []
    for candidate in sorted(candidates, key=lambda item: -item.gain):
        members = [*(strand for strand, _ in candidate.bodies), *(end.chain for end in candidate.ends)]
        if candidate.gain > 0 and used.isdisjoint(candidate.ends) and objects.join(*members):
            used.update(candidate.ends)
            chosen.append(candidate)
    return chosen


def nodes_of(contacts: Sequence[ContactCandidate], strands: Sequence[SampledChain]) -> list[Node]:
    """Return the junctions of contacts; those close to each other on one strand are one junction."""
    nodes: list[Node] = []
    for contact in contacts:
        near = [node for node in nodes if any(_is_at(node, strands[strand], strand, at) for strand, at in contact.bodies)]
        if not near:
            near = [Node(contact.position, [], {}, [])]
            nodes += near
        near[0].gains.append(contact.gain)
        near[0].bodies = {**dict(contact.bodies), **near[0].bodies}
        near[0].ends += contact.ends
    return nodes


def _is_at(node: Node, strand: SampledChain, number: int, at: float) -> bool:
    """Return whether a node lies at an arc length on a strand."""
    limit = max(NODE_RADII * strand.radius, strand.length / max(len(strand.along), 1))
    return number in node.bodies and abs(node.bodies[number] - at) < limit


def parted(strands: Sequence[SampledChain], contacts: Sequence[ContactCandidate]) -> list[Chain]:
    """Cut two opposite branches that are one strand through their trunk, where they enter and leave the trunk.

    Of two strands that pass each other, the thinner one is the pair of branches. Its new ends are attached later, one by one.

    strands : all strands. contacts : those chosen, of which those of two passing strands are used.
    """
    inside: dict[int, list[tuple[float, float]]] = {}
    for contact in (contact for contact in contacts if not contact.ends):
        radii = [min(strands[number].radius_near(at, side) for side in (-1, 1)) for number, at in contact.bodies]
        (branch, at), (trunk, _) = contact.bodies[:: 1 if radii[0] <= radii[1] else -1]
        if not strands[branch].chain.closed:
            inside.setdefault(branch, []).append(stretch_inside(strands[branch], at, strands[trunk]))
    result = []
    for number, strand in enumerate(strands):
        bounds = [0.0, *(value for stretch in sorted(inside.get(number, ())) for value in stretch), strand.length]
        parts = zip(bounds[::2], bounds[1::2], strict=True)
        result += [piece for part in parts for piece in _part(strand, *part)] if number in inside else [strand.chain]
    return result


def _part(strand: SampledChain, low: float, high: float) -> list[Chain]:
    """Return the part of a strand between two arc lengths, m (px in 2-D); nothing if it is too short for a chain."""
    kept = (strand.along > low) & (strand.along < high)
    if high - low <= NODE_RADII * strand.radius or kept.sum() < 2:
        return []
    joints = equal_segments(strand.points[kept], strand.chain.segment_length)
    return [chain_of(joints, [strand])] if len(joints) > 1 else []


def linked(strands: Sequence[SampledChain], chosen: Sequence[ContactCandidate]) -> list[Chain]:
    """Link strands across gaps of a cloud, each at one end at most.

    Gaps are filled with arc-line-arc (Dubins CSC) paths, whose segments are occluded.

    strands : all strands. chosen : the contacts and links chosen, of which the links are used.
    """
    left, made = dict(enumerate(strands)), []
    for link in chosen:
        if len(link.ends) < 2 or not left.keys() >= {end.chain for end in link.ends}:
            continue
        both = [left.pop(end.chain) for end in link.ends]
        before, after = (strand.points[:: 1 if end.side else -1] for end, strand in zip(link.ends, both, strict=True))
        leaving, entering = (strand.ends[end.side] for end, strand in zip(link.ends, both, strict=True))
        after, length = after[::-1], both[0].chain.segment_length
        path = gap_path(before[-1], leaving, after[0], entering).points(min(both[0].radius, length))[1:-1]
        middle = path[len(path) // 2] if len(path) else before[-1]
        place = middle, link.gain / (HIDDEN_WEIGHT * GAP_LINK_COST)
        made.append(chain_of(equal_segments(np.concatenate((before, path, after)), length), both, [place]))
    return [*(strand.chain for strand in left.values()), *made]


def cut(
    strands: Sequence[SampledChain], nodes: Sequence[Node], length: float
) -> tuple[list[Chain], list[Junction], list[LinearObject]]:
    """Cut all chains at the junctions, and assemble the pieces to objects.

    Parameters
    ----------
    strands
        all strands.
    nodes
        the junctions.
    length
        segment length, m (px in 2-D).

    Returns
    -------
    chains, junctions, objects : as `Detection` holds them; a chain without a junction is returned as it was.
    """
    pieces: list[Piece] = []
    at_end = {end: k for k, node in enumerate(nodes) for end in node.ends}
    for number, strand in enumerate(strands):
        inner = sorted((node.bodies[number], k) for k, node in enumerate(nodes) if number in node.bodies)
        stops = [(0.0, at_end.get(End(number, 0))), *inner, (strand.length, at_end.get(End(number, 1)))]
        is_whole = all(node is None for _, node in stops)
        pieces += [Piece(strand.chain, (None, None))] if is_whole else _pieces(strand, stops, nodes, length)
    return assembled(pieces, nodes)


def _pieces(strand: SampledChain, stops: Sequence[Stop], nodes: Sequence[Node], length: float) -> list[Piece]:
    """Return the pieces of one chain between its stops, of which the first and the last are its ends.

    strand, stops : the chain. nodes : all junctions. length : segment length, m (px in 2-D).
    """
    pieces = []
    points, along = strand.points, strand.along
    if strand.chain.closed:
        stops = [*stops[1:-1], (strand.length + stops[1][0], stops[1][1])]
        points = np.concatenate((points, points[1:]))
        along = np.concatenate((along, strand.length + along[1:]))
    for (low, first), (high, last) in itertools.pairwise(stops):
        kept, line = (along > low) & (along < high), []
        for at, node in ((low, first), (high, last)):
            line.append(resample(points, np.array([at])) if node is None else nodes[node].position[None])
            kept &= (np.linalg.norm(points - line[-1], axis=1) > JUNCTION_RADII * strand.radius) | (node is None)
        line.insert(1, points[kept])
        is_stub = None in (first, last) and high - low < NODE_RADII * strand.radius
        joints = equal_segments(np.concatenate(line), length)
        if len(joints) >= 2 and not is_stub:
            pieces.append(Piece(chain_of(joints, [strand]), (first, last)))
    return pieces


def chain_of(joints: Floats, strands: Sequence[SampledChain], links: Sequence[tuple[Floats, float]] = ()) -> Chain:
    """Return a chain with new joints along strands; radii, occlusion and links are those of the nearest positions.

    Parameters
    ----------
    joints
        (N + 1, D) m (px in 2-D), joints a segment apart. Segments farther than one from the strands are occluded.
    strands
        the strands that the chain is a part of, or that it links.
    links
        position (D,) and confidence of each link of these strands.
    """
    chains = [strand.chain for strand in strands]
    length = chains[0].segment_length
    middles, own = _middles(joints), np.concatenate([_middles(chain.joints) for chain in chains])
    at_joint = nearest(joints, np.concatenate([strand.points for strand in strands]), math.inf)[1]
    apart, at = nearest(middles, own, math.inf)
    radii = np.concatenate([strand.radii for strand in strands])[at_joint]
    margin = min(round(ARM_RADII[0] * strands[0].radius / length), len(middles) // 2)
    places = [(_middles(chain.joints)[each.segment], each.confidence) for chain in chains for each in chain.connections]
    connections = []
    for place, confidence in [*places, *links]:
        distance = np.linalg.norm(middles - place, axis=1)
        if distance.min() < length:
            connections.append(Connection(int(distance.argmin()), confidence))
    return Chain(
        joints,
        length,
        float(np.median(radii[margin : len(radii) - margin])),
        radii,
        np.concatenate([chain.occluded for chain in chains])[at] | (apart > length),
        depth_filled=np.concatenate([chain.depth_filled for chain in chains])[at],
        connections=tuple(sorted(connections)),
    )


def _middles(joints: Floats) -> Floats:
    """Return the middles of segments, (N, D)."""
    return (joints[1:] + joints[:-1]) / 2
