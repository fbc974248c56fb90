"""Choose the junctions among all meetings, and cut the chains there."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ...geometry.disjoint_set import DisjointSet
from ...geometry.equal_segments import equal_segments
from ...geometry.polyline import angle, resample
from ...kernels import nearest
from ...types import Bools, Chain, Connection, Floats, Junction, LinearObject
from .objects import Node, Piece, assembled
from .readings import Meeting
from .strands import JUNCTION_RADII, NODE_RADII, FreeEnds, SampledChain, stretch_inside


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
        if meeting.gain <= 0 or meeting.end in used:
            continue
        members = [strand for strand, _ in meeting.bodies] + ([] if meeting.end is None else [int(ends.strand[meeting.end])])
        if len({int(objects.group[member]) for member in members}) < len(members):
            continue
        for member in members[1:]:
            objects.join(members[0], member)
        if meeting.end is not None:
            used.add(meeting.end)
        chosen.append(meeting)
    return chosen


def connected(chosen: Sequence[Meeting], strands: Sequence[SampledChain], ends: FreeEnds) -> tuple[Bools, list[int]]:
    """Return which of the E ends stay free, (E,) bool, and the number of the object to which each strand belongs."""
    objects, is_free = DisjointSet(range(len(strands))), np.ones(len(ends.strand), dtype=bool)
    for meeting in chosen:
        members = [strand for strand, _ in meeting.bodies]
        if meeting.end is not None:
            is_free[meeting.end] = False
            members.append(int(ends.strand[meeting.end]))
        for member in members[1:]:
            objects.join(members[0], member)
    return is_free, objects.group.tolist()


def nodes_of(chosen: Sequence[Meeting], strands: Sequence[SampledChain]) -> list[Node]:
    """Combine chosen meetings to junctions: meetings close to each other on one strand are one junction."""
    nodes: list[Node] = []
    for meeting in chosen:
        _add(nodes, meeting, strands)
    return nodes


def parted(strands: Sequence[SampledChain], chosen: Sequence[Meeting], viewpoint: Floats | None, length: float) -> list[Chain]:
    """Separate two opposite branches that were joined through their trunk.

    Of the two strands of such a meeting, the thinner one, or the one that turns more, is the pair of branches. It is cut where it
    enters and leaves the trunk; its two new ends are attached later, one by one.

    Parameters
    ----------
    strands
        the chains as they were found, as samples.
    chosen
        the chosen meetings; only those of two passing strands are used.
    viewpoint
        (3,) m, position of the camera; None in 2-D, and where it is unknown.
    length
        segment length, m (px in 2-D).
    """
    inside: dict[int, list[tuple[float, float]]] = {}
    for meeting in chosen:
        if meeting.end is None:
            (branch, at), (trunk, _) = sorted(meeting.bodies, key=lambda body: _thickness(strands[body[0]], body[1]))
            inside.setdefault(branch, []).append(stretch_inside(strands[branch], at, strands[trunk], viewpoint))
    result = []
    for number, strand in enumerate(strands):
        if number not in inside or strand.closed:
            result.append(strand.chain)
            continue
        bounds = [0.0, *(value for stretch in sorted(inside[number]) for value in stretch), strand.length]
        for low, high in zip(bounds[::2], bounds[1::2], strict=True):
            kept = (strand.along > low) & (strand.along < high)
            if high - low > NODE_RADII * strand.radius and kept.sum() > 1:
                joints = equal_segments(strand.points[kept], length)
                if len(joints) > 1:
                    result.append(part_of(joints, strand, low, high, length))
    return result


def _thickness(strand: SampledChain, at: float) -> float:
    """Return the radius of a strand at a place, less up to a fifth of it where the strand turns there."""
    before, after = strand.arm(at, -1, 2 * strand.radius), strand.arm(at, 1, 2 * strand.radius)
    turn = float(angle(-before, after))
    return min(strand.radius_near(at, -1), strand.radius_near(at, 1)) * (1 - 0.2 * min(turn, 1.0))


def _add(nodes: list[Node], meeting: Meeting, strands: Sequence[SampledChain]) -> None:
    """Add a meeting to the node that lies there already, or as a new one."""
    ends = [] if meeting.end is None else [meeting.end]
    for node in nodes:
        for strand, at in meeting.bodies:
            limit = max(NODE_RADII * strands[strand].radius, strands[strand].length / max(len(strands[strand].along), 1))
            if strand in node.bodies and abs(node.bodies[strand] - at) < limit:
                node.gains.append(meeting.gain)
                node.bodies = {**dict(meeting.bodies), **node.bodies}
                node.ends += ends
                return
    nodes.append(Node(meeting.position, [meeting.gain], dict(meeting.bodies), ends))


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
    for number, strand in enumerate(strands):
        stops = sorted((node.bodies[number], k) for k, node in enumerate(nodes) if number in node.bodies)
        tips: list[int | None] = [None, None]
        for k, node in enumerate(nodes):
            for row in node.ends:
                if ends.strand[row] == number:
                    tips[ends.side[row]] = k
        if not stops and tips == [None, None]:
            pieces.append(Piece(strand.chain, (None, None)))
        else:
            pieces += _pieces(strand, stops, tips, nodes, length)
    return assembled(pieces, nodes)


def _pieces(
    strand: SampledChain,
    stops: list[tuple[float, int]],
    tips: list[int | None],
    nodes: Sequence[Node],
    length: float,
) -> list[Piece]:
    """Return the pieces of one chain between its stops, (arc length, node), and its tips."""
    bounds: list[tuple[float, int | None]] = [(0.0, tips[0]), *stops, (strand.length, tips[1])]
    if strand.closed and stops:
        bounds = [*stops, (strand.length + stops[0][0], stops[0][1])]
    pieces = []
    points, along = strand.points, strand.along
    if strand.closed:
        points = np.concatenate((points, points[1:]))
        along = np.concatenate((along, strand.length + along[1:]))
    for (low, first), (high, last) in itertools.pairwise(bounds):
        chosen = (along > low) & (along < high)
        line = np.concatenate((resample(points, np.array([low])), points[chosen], resample(points, np.array([high]))))
        for side, node in enumerate((first, last)):
            if node is not None:
                line = _led_to(nodes[node].position, line, side, JUNCTION_RADII * strand.radius)
        is_stub = None in (first, last) and high - low < NODE_RADII * strand.radius
        joints = equal_segments(line, length)
        if len(joints) >= 2 and not is_stub:
            pieces.append(Piece(part_of(joints, strand, low, high, length), (first, last)))
    return pieces


def _led_to(position: Floats, line: Floats, side: int, clear: float) -> Floats:
    """Return a line (P, D) whose first (side 0) or last point is a position, without its points nearer to that than `clear`."""
    line = line if side else line[::-1]
    far = np.flatnonzero(np.linalg.norm(line - position, axis=1) > clear)
    kept = line[: far[-1] + 1] if len(far) else line[:1]
    line = np.concatenate((kept, position[None]))
    return np.asarray(line if side else line[::-1])


def stretch_of(strand: SampledChain, low: float, high: float, length: float) -> Chain | None:
    """Return the part of a chain between two of its arc lengths, `low` and `high`; None if it is shorter than a segment.

    strand : the chain as samples. length : segment length, m (px in 2-D).
    """
    joints = equal_segments(strand.points[(strand.along >= low) & (strand.along <= high)], length)
    return part_of(joints, strand, low, high, length) if len(joints) > 1 else None


def part_of(joints: Floats, strand: SampledChain, low: float, high: float, length: float) -> Chain:
    """Return a part of a chain with new joints; radii, occlusion and connections are copied from the nearest segments.

    Parameters
    ----------
    joints
        (N + 1, D) m (px in 2-D), joints of the part, `length` apart.
    strand
        the whole chain as samples.
    low, high
        arc lengths on the strand between which the part lies, m (px in 2-D).
    length
        segment length, m (px in 2-D).
    """
    chain = strand.chain
    near = nearest(joints, strand.points, length, False)[1]
    middle = nearest((joints[1:] + joints[:-1]) / 2, (chain.joints[1:] + chain.joints[:-1]) / 2, length, False)[1]
    inside = (strand.along >= low + 2 * strand.radius) & (strand.along <= high - 2 * strand.radius) & ~strand.occluded
    if not inside.any():
        inside = (strand.along >= low) & (strand.along <= high)
    radius = float(np.median(strand.widths[inside])) if inside.any() else strand.radius
    radii = strand.radii[near]
    if strand.half_widths is not None and inside.any():
        radii = radii * (radius / float(np.median(strand.radii[inside])))
    connections = [
        Connection(
            int(np.argmin(np.linalg.norm((joints[1:] + joints[:-1]) / 2 - chain.joints[each.segment], axis=1))), each.confidence
        )
        for each in chain.connections
        if low < (each.segment + 0.5) * chain.segment_length < high
    ]
    return Chain(
        joints,
        length,
        radius,
        radii,
        chain.occluded[middle],
        depth_filled=chain.depth_filled[middle],
        connections=tuple(sorted(connections)),
        id=None,
    )
