"""Join chains at linked ends across the gaps between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...geometry.equal_segments import equal_segments
from ...geometry.gap_path import gap_path
from ...kernels import nearest
from ...types import Bools, Chain, ChainEnd, Connection, Floats
from .costs import JOIN_COST
from .strands import FreeEnds, SampledChain


def joined(
    strands: Sequence[SampledChain],
    ends: FreeEnds,
    links: Sequence[tuple[int, int, float]],
    length: float,
) -> list[Chain]:
    """Replace chains whose ends are linked by one chain through all of them.

    Gaps are filled with arc-line-arc (Dubins CSC) paths, whose segments are occluded.

    Parameters
    ----------
    strands
        the chains as they were found, as samples.
    ends
        the free ends of all chains.
    links
        (row, row, cost) of each join: rows of the ends, and cost units of the connection.
    length
        segment length, m (px in 2-D).
    """
    partner: dict[ChainEnd, tuple[ChainEnd, float]] = {}
    for first, second, cost in links:
        one, other = (ChainEnd(int(ends.strand[row]), int(ends.side[row])) for row in (first, second))
        partner[one], partner[other] = (other, cost), (one, cost)
    tangent = {(int(ends.strand[row]), int(ends.side[row])): ends.tangents[row] for row in range(len(ends.strand))}
    result, visited = [], set()
    for start in range(len(strands)):
        if start in visited or all((start, side) in partner for side in (0, 1)):
            continue
        entered = ChainEnd(start, 1 if (start, 0) in partner else 0)
        entries = [entered]
        while (left := ChainEnd(entries[-1].chain, 1 - entries[-1].end)) in partner:
            entries.append(partner[left][0])
        visited |= {entry.chain for entry in entries}
        result.append(strands[start].chain if len(entries) == 1 else _joined(entries, strands, partner, tangent, length))
    return result


def _joined(
    entries: Sequence[ChainEnd],
    strands: Sequence[SampledChain],
    partner: dict[ChainEnd, tuple[ChainEnd, float]],
    tangent: dict[tuple[int, int], Floats],
    length: float,
) -> Chain:
    """Return one chain through several, each entered at the end given."""
    points: list[Floats] = []
    radii: list[Floats] = []
    occluded: list[Bools] = []
    places: list[tuple[Floats, float]] = []
    for i, entry in enumerate(entries):
        strand, step = strands[entry.chain], -1 if entry.end else 1
        if i:
            left = ChainEnd(entries[i - 1].chain, 1 - entries[i - 1].end)
            gap = gap_path(points[-1][-1], tangent[left], strand.points[::step][0], tangent[entry])
            way = gap.points(min(strand.radius, length))[1:-1]
            if len(way):
                points.append(way)
                radii.append(np.asarray(np.linspace(float(radii[-1][-1]), float(strand.radii[::step][0]), len(way))))
                occluded.append(np.ones(len(way), dtype=bool))
            places.append((points[-1][len(points[-1]) // 2], max(0.0, 1 - partner[left][1] / JOIN_COST)))
        points.append(strand.points[::step])
        radii.append(strand.radii[::step])
        occluded.append(strand.occluded[::step])
    line, hidden = np.concatenate(points), np.concatenate(occluded)
    joints = equal_segments(line, length)
    middles = (joints[1:] + joints[:-1]) / 2
    at_joint, at_middle = nearest(joints, line, length, False)[1], nearest(middles, line, length, False)[1]
    own = [strands[entry.chain].chain for entry in entries]
    places += [((each.joints[c.segment : c.segment + 2]).mean(axis=0), c.confidence) for each in own for c in each.connections]
    connections = sorted(Connection(int(np.linalg.norm(middles - at, axis=1).argmin()), sure) for at, sure in places)
    own_middles = np.concatenate([(each.joints[1:] + each.joints[:-1]) / 2 for each in own])
    filled = np.concatenate([each.depth_filled for each in own])[nearest(middles, own_middles, length, False)[1]]
    sizes = np.array([strands[entry.chain].length for entry in entries])
    return Chain(
        joints,
        length,
        float(np.average([each.radius for each in own], weights=sizes)),
        np.concatenate(radii)[at_joint],
        hidden[at_middle],
        depth_filled=filled,
        connections=tuple(connections),
    )
