"""Choose the junctions among all meetings, and cut the chains there."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from ...geometry.disjoint_set import DisjointSet
from ...geometry.equal_segments import equal_segments
from ...geometry.gap_path import gap_path
from ...geometry.polyline import resample
from ...geometry.radii import NODE_RADII
from ...kernels import nearest
from ...types import Chain, Connection, Floats, Junction, LinearObject
from .clouds import HIDDEN_WEIGHT
from .costs import JOIN_COST
from .objects import Node, Piece, assembled
from .strands import ARM_RADII, JUNCTION_RADII, FreeEnds, Meeting, SampledChain, stretch_inside


def choose(meetings: Sequence[Meeting], strands: Sequence[SampledChain], ends: FreeEnds) -> list[Meeting]:
    """Choose the meetings that are junctions: a maximum-weight spanning forest of the strands (Kruskal), with the gain as weight.

    No junction closes a ring of strands, so objects are trees, and an end is attached to one strand at most.

    Parameters
    ----------
    meetings
        all possible junctions.
    strands
        all strands.
    ends
        the free ends that `meetings` refer to.

    Returns
    -------
    The meetings chosen, by descending gain, all above 0.
    """
    objects = DisjointSet(range(len(strands)))
    used: set[int] = set()
    chosen: list[Meeting] = []
    for meeting in sorted(meetings, key=lambda item: -item.gain):
        members = [*(strand for strand, _ in meeting.bodies), *(int(ends.strand[row]) for row in meeting.ends)]
        if meeting.gain > 0 and used.isdisjoint(meeting.ends) and objects.join(*members):
            used.update(meeting.ends)
            chosen.append(meeting)
    return chosen


def nodes_of(chosen: Sequence[Meeting], strands: Sequence[SampledChain]) -> list[Node]:
    """Combine chosen meetings to junctions: meetings close to each other on one strand are one junction."""
    nodes: list[Node] = []
    for meeting in chosen:
        near = [node for node in nodes if any(_is_at(node, strands[strand], strand, at) for strand, at in meeting.bodies)]
        if not near:
            near = [Node(meeting.position, [], {}, [])]
            nodes += near
        near[0].gains.append(meeting.gain)
        near[0].bodies = {**dict(meeting.bodies), **near[0].bodies}
        near[0].ends += meeting.ends
    return nodes


def _is_at(node: Node, strand: SampledChain, number: int, at: float) -> bool:
    """Tell whether a node lies at an arc length on a strand."""
    limit = max(NODE_RADII * strand.radius, strand.length / max(len(strand.along), 1))
    return number in node.bodies and abs(node.bodies[number] - at) < limit


def parted(strands: Sequence[SampledChain], chosen: Sequence[Meeting]) -> list[Chain]:
    """Separate two opposite branches that were joined through their trunk.

    Of the two strands of such a meeting, the thinner one is the pair of branches. It is cut where it
    enters and leaves the trunk; its two new ends are attached later, one by one.

    Parameters
    ----------
    strands
        the chains as they were found, as samples.
    chosen
        the chosen meetings; only those of two passing strands are used.
    """
    inside: dict[int, list[tuple[float, float]]] = {}
    for meeting in chosen:
        if not meeting.ends:
            radii = [min(strands[number].radius_near(at, side) for side in (-1, 1)) for number, at in meeting.bodies]
            (branch, at), (trunk, _) = meeting.bodies[:: 1 if radii[0] <= radii[1] else -1]
            inside.setdefault(branch, []).append(stretch_inside(strands[branch], at, strands[trunk]))
    result = []
    for number, strand in enumerate(strands):
        if number not in inside or strand.chain.closed:
            result.append(strand.chain)
            continue
        bounds = [0.0, *(value for stretch in sorted(inside[number]) for value in stretch), strand.length]
        for low, high in zip(bounds[::2], bounds[1::2], strict=True):
            kept = (strand.along > low) & (strand.along < high)
            if high - low > NODE_RADII * strand.radius and kept.sum() > 1:
                joints = equal_segments(strand.points[kept], strand.chain.segment_length)
                if len(joints) > 1:
                    result.append(chain_of(joints, [strand]))
    return result


def joined(strands: Sequence[SampledChain], ends: FreeEnds, chosen: Sequence[Meeting]) -> list[Chain]:
    """Join strands across gaps of a cloud, each at one end at most.

    Gaps are filled with arc-line-arc (Dubins CSC) paths, whose segments are occluded.

    Parameters
    ----------
    strands
        the chains as they were found, as samples.
    ends
        the free ends of all chains.
    chosen
        the chosen meetings; only those of two ends are used.
    """
    left, made = dict(enumerate(strands)), []
    for meeting in chosen:
        numbers = ends.strand[list(meeting.ends)].tolist()
        if len(numbers) < 2 or not left.keys() >= set(numbers):
            continue
        both = [left.pop(number) for number in numbers]
        before, after = (strand.points[:: 1 if ends.side[row] else -1] for row, strand in zip(meeting.ends, both, strict=True))
        after, length = after[::-1], both[0].chain.segment_length
        (start, end), (leaving, entering) = ends.points[list(meeting.ends)], ends.tangents[list(meeting.ends)]
        way = gap_path(start, leaving, end, entering).points(min(both[0].radius, length))[1:-1]
        place = (way if len(way) else before)[len(way) // 2 - (not len(way))], meeting.gain / (HIDDEN_WEIGHT * JOIN_COST)
        made.append(chain_of(equal_segments(np.concatenate((before, way, after)), length), both, [place]))
    return [*(strand.chain for strand in left.values()), *made]


def cut(
    strands: Sequence[SampledChain], ends: FreeEnds, nodes: Sequence[Node], length: float
) -> tuple[list[Chain], list[Junction], list[LinearObject]]:
    """Cut all chains at the junctions, and assemble the pieces to objects.

    Parameters
    ----------
    strands
        the chains as they were found, as samples.
    ends
        the free ends of all chains.
    nodes
        the junctions.
    length
        segment length, m (px in 2-D).

    Returns
    -------
    chains, junctions, objects : as `Detection` holds them; a chain that meets no junction is returned as it was.
    """
    pieces: list[Piece] = []
    tips = {(int(ends.strand[row]), int(ends.side[row])): k for k, node in enumerate(nodes) for row in node.ends}
    for number, strand in enumerate(strands):
        stops = sorted((node.bodies[number], k) for k, node in enumerate(nodes) if number in node.bodies)
        own = tips.get((number, 0)), tips.get((number, 1))
        if not stops and own == (None, None):
            pieces.append(Piece(strand.chain, own))
        else:
            pieces += _pieces(strand, stops, own, nodes, length)
    return assembled(pieces, nodes)


def _pieces(
    strand: SampledChain,
    stops: list[tuple[float, int]],
    tips: tuple[int | None, int | None],
    nodes: Sequence[Node],
    length: float,
) -> list[Piece]:
    """Return the pieces of one chain between its stops, (arc length, node), and its tips."""
    bounds: list[tuple[float, int | None]] = [(0.0, tips[0]), *stops, (strand.length, tips[1])]
    if strand.chain.closed and stops:
        bounds = [*stops, (strand.length + stops[0][0], stops[0][1])]
    pieces = []
    points, along = strand.points, strand.along
    if strand.chain.closed:
        points = np.concatenate((points, points[1:]))
        along = np.concatenate((along, strand.length + along[1:]))
    for (low, first), (high, last) in itertools.pairwise(bounds):
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


def chain_of(joints: Floats, strands: Sequence[SampledChain], joins: Sequence[tuple[Floats, float]] = ()) -> Chain:
    """Return a chain with new joints along strands; radii, occlusion and connections are those of the nearest places.

    Parameters
    ----------
    joints
        (N + 1, D) m (px in 2-D), joints a segment apart. Segments farther than one from the strands are occluded.
    strands
        the strands that the chain is a part of, or that it joins.
    joins
        position (D,) and confidence of each join of these strands.
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
    for place, confidence in [*places, *joins]:
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
    return (joints[1:] + joints[:-1]) / 2
