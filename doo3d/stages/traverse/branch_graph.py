"""The skeleton as a graph of branches between junctions, and its simplification."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np

from ...geometry.polyline import steps
from ...kernels import neighbor_table, trace_branches
from ...types import Floats, Ints, Skeleton

FREE_END = -1
"""In place of a node, where a branch ends at a tip."""

CLOSED_LOOP = -2
"""In place of both nodes in the table of `trace_branches`, where a branch is a loop without a junction."""

MIN_LOOP_RADII = 12.0
"""Radii; loops of less perimeter are holes in the surface, not turns of the object, and collapse."""

JUNCTION_MERGE_DISTANCE_RADII = 3.0
"""Radii; two forks nearer to each other than this are one crossing: strands at over 40 degrees thin to such a pair."""


@dataclass(eq=False)
class Branch:
    """A line of the skeleton between two ends, each a node (junction) or a free end (tip).

    Attributes
    ----------
    a, b
        numbers of the nodes at its first and at its last point; FREE_END (-1) for a tip.
    points
        (P, D) m, D = 3 (in 2-D: px, D = 2), P points from a to b, without the positions of the nodes.
    length
        m (px in 2-D), from node to node; set by `BranchGraph.add`.
    """

    a: int
    b: int
    points: Floats
    length: float = 0.0

    def from_end(self, node: int) -> tuple[int, Floats]:
        """Return the node at the far end of the branch, and the points in the order from `node` to there.

        Parameters
        ----------
        node
            number of the node at one end of the branch; FREE_END (-1) for its tip.

        Returns
        -------
        far : number of the node at the far end; FREE_END (-1) for a tip.
        points : (P, D) m, D = 3 (in 2-D: px, D = 2), the P points of the branch, without the positions of the nodes.
        """
        return (self.b, self.points) if self.a == node else (self.a, self.points[::-1])


@dataclass
class BranchGraph:
    """The skeleton as a graph: branches between nodes, where a node is a junction of branches.

    Attributes
    ----------
    branches
        all branches, in no particular order.
    positions
        number of each node -> its position (D,) m, D = 3 (in 2-D: px, D = 2).
    """

    branches: list[Branch] = field(default_factory=list)
    positions: dict[int, Floats] = field(default_factory=dict)

    def add(self, a: int, b: int, points: Floats) -> None:
        """Add a branch between two nodes, and compute its length.

        Parameters
        ----------
        a, b
            numbers of the nodes; FREE_END (-1) for a tip.
        points
            (P, D) m, D = 3 (in 2-D: px, D = 2), from a to b, without the positions of the nodes.
        """
        branch = Branch(a, b, points)
        branch.length = float(steps(self.all_points(branch)).sum())
        self.branches.append(branch)

    def all_points(self, branch: Branch) -> Floats:
        """Return the points of a branch with the positions of its nodes added, in order from a to b.

        A free end has no node, so P points become P to P + 2 points: (P to P + 2, D) m, D = 3 (in 2-D: px, D = 2).
        """
        parts = [branch.points]
        if branch.a != FREE_END:
            parts.insert(0, self.positions[branch.a][None])
        if branch.b != FREE_END:
            parts.append(self.positions[branch.b][None])
        return np.concatenate(parts)

    def branches_at(self, node: int) -> list[Branch]:
        """Return the branches that end at a node; a branch with both ends there is listed twice."""
        return [branch for branch in self.branches for end in (branch.a, branch.b) if end == node]

    def is_loop(self, branch: Branch) -> bool:
        """Tell whether a branch starts and ends at one node that has no other branch."""
        return branch.a == branch.b != FREE_END and len(self.branches_at(branch.a)) == 2

    def contract(self, bridge: Branch) -> None:
        """Remove a branch and unite the two nodes at its ends to one, half way between them; changes the graph in place.

        The united node has the number `bridge.a`, and all branches of both nodes end there.

        Parameters
        ----------
        bridge
            a branch of the graph between two different nodes, neither of them a free end.
        """
        self.branches.remove(bridge)
        self.positions[bridge.a] = (self.positions[bridge.a] + self.positions[bridge.b]) / 2
        del self.positions[bridge.b]
        for branch in [branch for branch in self.branches if bridge.b in (branch.a, branch.b)]:
            self.branches.remove(branch)
            a, b = (bridge.a if end == bridge.b else end for end in (branch.a, branch.b))
            self.add(a, b, branch.points)

    def dissolve(self, node: int) -> None:
        """Remove a node with fewer than three branches; changes the graph in place.

        Two branches become one through the position of the node; a single branch gets a free end there. A node with three or
        more branches stays, and so does a node whose only branch is a loop from the node to itself.
        """
        ending = self.branches_at(node)
        if len(ending) > 2 or (len(ending) == 2 and ending[0] is ending[1]):
            return
        position = self.positions.pop(node)[None]
        self.branches = [branch for branch in self.branches if all(branch is not other for other in ending)]
        if len(ending) == 1:
            other, points = ending[0].from_end(node)
            self.add(FREE_END, other, np.concatenate((position, points)))
        elif len(ending) == 2:
            first, before = ending[0].from_end(node)
            last, after = ending[1].from_end(node)
            self.add(first, last, np.concatenate((before[::-1], position, after)))

    def simplify(self, min_branch: float, radius: float) -> tuple[float, float]:
        """Remove spurs and small loops, the shortest first, and unite the two forks of a crossing; changes the graph in place.

        A spur is a branch with one free end. A node left with fewer than three branches is dissolved. Thinning turns a crossing
        of two strands into two forks with a short branch between them: such branches of less than three radii are contracted
        last.

        Parameters
        ----------
        min_branch
            m (px in 2-D); shorter spurs are removed.
        radius
            radius of the object, m (px in 2-D). Loops with a perimeter of less than 12 radii are taken for holes in the surface.

        Returns
        -------
        spur_length, loop_length : m (px in 2-D), total length of the spurs and of the loops removed.
        """
        removed = {"spur": 0.0, "loop": 0.0}
        for node in list(self.positions):
            self.dissolve(node)
        while True:
            shortest = self._shortest_removable(min_branch, MIN_LOOP_RADII * radius)
            if shortest is not None:
                removed["spur" if FREE_END in (shortest.a, shortest.b) else "loop"] += shortest.length
                self.branches.remove(shortest)
                for node in {shortest.a, shortest.b} - {FREE_END}:
                    self.dissolve(node)
                continue
            bridges = [
                branch
                for branch in self.branches
                if FREE_END != branch.a != branch.b != FREE_END and branch.length < JUNCTION_MERGE_DISTANCE_RADII * radius
            ]
            if not bridges:
                return removed["spur"], removed["loop"]
            self.contract(min(bridges, key=lambda branch: branch.length))

    def _shortest_removable(self, min_branch: float, min_loop: float) -> Branch | None:
        """Return the shortest of: spurs, small loops, and the longer of two branches around a small hole; None without any."""
        shortest: dict[tuple[int, int], Branch] = {}
        for branch in sorted(self.branches, key=lambda branch: branch.length):
            if (branch.a == FREE_END) != (branch.b == FREE_END):
                removable = branch.length < min_branch
            elif branch.a == branch.b:
                removable = branch.a != FREE_END and branch.length < min_loop and len(self.branches_at(branch.a)) > 2
            else:
                twin = shortest.setdefault((min(branch.a, branch.b), max(branch.a, branch.b)), branch)
                removable = twin is not branch and twin.length + branch.length < min_loop
            if removable:
                return branch
        return None


def build_graph(skeleton: Skeleton) -> tuple[BranchGraph, list[Floats]]:
    """Build the graph of a skeleton, with one node in the middle of each cluster of junction voxels.

    Returns
    -------
    graph : branches and nodes, positions in m (px in 2-D).
    loops : the closed loops without any junction, which are not in the graph: each (P, D) m, D = 3 (in 2-D: px, D = 2), P points
        in order, the first not repeated at the end.
    """
    coords: Ints = skeleton.coords
    if coords.shape[1] == 2:
        coords = np.column_stack((coords, np.ones(len(coords), dtype=np.int64)))
    cluster, order, bounds, ends = trace_branches(neighbor_table(coords))
    graph = BranchGraph()
    at_junction = np.flatnonzero(cluster >= 0)
    node = cluster[at_junction]
    sums = [np.bincount(node, weights=column) for column in skeleton.points[at_junction].T]
    graph.positions = dict(enumerate(np.column_stack(sums) / np.bincount(node)[:, None]))
    loops = []
    ordered = skeleton.points[order]
    for (a, b), (start, stop) in zip(ends.tolist(), itertools.pairwise(bounds.tolist()), strict=True):
        points = ordered[start:stop]
        if a == CLOSED_LOOP:
            loops.append(points)
        else:
            graph.add(a, b, points)
    return graph, loops
