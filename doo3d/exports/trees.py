"""Prepare branched objects for exports: chains directed away from a root, and a graph of nodes and edges."""

from dataclasses import dataclass, replace

import numpy as np

from ..track.chain_direction import reversed_chain
from ..types import ChainEnd, Detection, Floats


@dataclass(frozen=True)
class Grown:
    """The chains of a detection, each directed away from the root of its object.

    Attributes
    ----------
    detection
        the detection with the directed chains, in their order.
    parents
        for each chain the index of the chain at whose end it begins; None for a chain that begins at the root of its object.
    junctions
        for each junction the ends of the directed chains that meet there.
    trunk_tips
        for each branched object the chain of its trunk that ends at the tip farthest from the root.
    """

    detection: Detection
    parents: tuple[int | None, ...]
    junctions: tuple[tuple[ChainEnd, ...], ...]
    trunk_tips: tuple[int, ...] = ()

    def children(self, parent: int | None) -> list[int]:
        """Return the chains that begin at the end of a chain; for None, those that begin at roots."""
        return [chain for chain, own in enumerate(self.parents) if own == parent]


def grown(detection: Detection, from_last: bool = False) -> Grown:
    """Reverse chains of branched objects where necessary, so that each leads away from the root, a tip of the trunk.

    Parameters
    ----------
    detection
        the detection; without junctions, its chains are not changed.
    from_last
        whether the root is the last end of the trunk, not the first.
    """
    at = {(end.chain, end.end): number for number, junction in enumerate(detection.junctions) for end in junction.ends}
    chains = list(detection.chains)
    parents: list[int | None] = [None] * len(chains)
    is_turned = [False] * len(chains)
    tips = []
    for each in detection.objects:
        if not each.junctions:
            continue
        root, tip = each.chains[0], each.chains[each.trunk - 1]
        root, tip = (tip, root) if from_last else (root, tip)
        tips.append(tip)
        first = next((side for side in (0, 1) if (root, side) not in at), 0)
        waiting: list[tuple[int, int, int | None]] = [(root, first, None)]
        seen = {root}
        while waiting:
            chain, side, parent = waiting.pop(0)
            parents[chain] = parent
            if side == 1:
                chains[chain], is_turned[chain] = reversed_chain(detection.chains[chain], True)[0], True
            junction = at.get((chain, 1 - side))
            for end in () if junction is None else detection.junctions[junction].ends:
                if end.chain not in seen:
                    seen.add(end.chain)
                    waiting.append((end.chain, end.end, chain))
    ends = tuple(
        tuple(ChainEnd(end.chain, 1 - end.end if is_turned[end.chain] else end.end) for end in junction.ends)
        for junction in detection.junctions
    )
    return Grown(
        replace(detection, chains=tuple(chains), crossings=(), junctions=(), objects=()), tuple(parents), ends, tuple(tips)
    )


@dataclass(frozen=True)
class Graph:
    """A detection as a graph, whose nodes are junctions and tips and whose edges are chains.

    Attributes
    ----------
    positions
        (K, D) m (px in 2-D), the junctions in their order, then the tips, chain by chain.
    junction
        (K,) bool, True for a junction.
    edges
        (C, 2) int, for each chain the node at its first joint and at its last.
    objects
        (C,) int, index of each chain's object; the chain's own index if the detection did not look for branched objects.
    """

    positions: Floats
    junction: np.ndarray
    edges: np.ndarray
    objects: np.ndarray


def graph_of(detection: Detection) -> Graph:
    """Return the graph of a detection, in which a chain without junctions is an edge between two separate nodes."""
    dim = 2 if detection.mode == "2d" else 3
    at = {(end.chain, end.end): number for number, junction in enumerate(detection.junctions) for end in junction.ends}
    positions = [junction.position for junction in detection.junctions]
    edges = []
    for number, chain in enumerate(detection.chains):
        pair = []
        for side in (0, 1):
            if (number, side) not in at:
                at[number, side] = len(positions)
                positions.append(chain.joints[-side])
            pair.append(at[number, side])
        edges.append(pair if not chain.closed else [pair[0], pair[0]])
    objects = np.arange(len(detection.chains))
    for number, each in enumerate(detection.objects):
        objects[list(each.chains)] = number
    return Graph(
        np.array(positions, dtype=float).reshape(-1, dim),
        np.arange(len(positions)) < len(detection.junctions),
        np.array(edges, dtype=np.int64).reshape(-1, 2),
        objects,
    )
