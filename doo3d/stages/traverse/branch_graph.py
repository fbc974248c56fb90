"""The skeleton as a graph of branches between junctions, and its simplification."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass

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

CORNER_HALF_WIDTHS = 1.8
"""Half-widths of a region from its middle to its corners at most: 1.4 in a square, more where its edge is ragged."""


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
    number
        order in which the branches of a graph were added; set by `BranchGraph.add`.
    """

    a: int
    b: int
    points: Floats
    length: float = 0.0
    number: int = -1

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

    @property
    def is_spur(self) -> bool:
        """Whether one of its ends is free, and one only."""
        return (self.a == FREE_END) != (self.b == FREE_END)


class BranchGraph:
    """The skeleton as a graph: branches between nodes, where a node is a junction of branches.

    Attributes
    ----------
    positions
        number of each node -> its position (D,) m, D = 3 (in 2-D: px, D = 2).
    """

    def __init__(self, positions: dict[int, Floats] | None = None) -> None:
        """Make a graph of nodes at these positions, without branches."""
        self.positions = {} if positions is None else positions
        self._branches: dict[int, Branch] = {}
        self._at: dict[int, dict[int, Branch]] = {}
        self._added = 0

    @property
    def branches(self) -> list[Branch]:
        """All branches, in the order in which they were added."""
        return list(self._branches.values())

    def add(self, a: int, b: int, points: Floats) -> None:
        """Add a branch between two nodes, and compute its length.

        Parameters
        ----------
        a, b
            numbers of the nodes; FREE_END (-1) for a tip.
        points
            (P, D) m, D = 3 (in 2-D: px, D = 2), from a to b, without the positions of the nodes.
        """
        branch = Branch(a, b, points, number=self._added)
        branch.length = float(steps(self.all_points(branch)).sum())
        self._added += 1
        self._branches[branch.number] = branch
        for node in {a, b} - {FREE_END}:
            self._at.setdefault(node, {})[branch.number] = branch

    def remove(self, branch: Branch) -> None:
        """Remove a branch of the graph; its nodes stay."""
        del self._branches[branch.number]
        for node in {branch.a, branch.b} - {FREE_END}:
            del self._at[node][branch.number]

    def has(self, branch: Branch) -> bool:
        """Tell whether a branch that was added has not been removed."""
        return branch.number in self._branches

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
        """Return the branches that end at a node, as they were added; a branch with both ends there is listed twice."""
        return [branch for branch in self._at.get(node, {}).values() for end in (branch.a, branch.b) if end == node]

    def is_loop(self, branch: Branch) -> bool:
        """Tell whether a branch starts and ends at one node that has no other branch."""
        return branch.a == branch.b != FREE_END and len(self._at[branch.a]) == 1

    def contract(self, bridge: Branch) -> None:
        """Remove a branch and unite the two nodes at its ends to one, half way between them; changes the graph in place.

        The united node has the number `bridge.a`, and all branches of both nodes end there.

        Parameters
        ----------
        bridge
            a branch of the graph between two different nodes, neither of them a free end.
        """
        self.remove(bridge)
        self.positions[bridge.a] = (self.positions[bridge.a] + self.positions[bridge.b]) / 2
        del self.positions[bridge.b]
        for branch in list(self._at[bridge.b].values()):
            self.remove(branch)
            a, b = (bridge.a if end == bridge.b else end for end in (branch.a, branch.b))
            self.add(a, b, branch.points)

    def dissolve(self, node: int) -> None:
        """Remove a node with fewer than three branches; changes the graph in place.

        Two branches become one through the position of the node; a single branch gets a free end there. A node with three or
        more branches stays, and so does a node whose only branch is a loop from the node to itself.
        """
        if len(self._at.get(node, {})) > 2:
            return
        ending = self.branches_at(node)
        if len(ending) > 2 or (len(ending) == 2 and ending[0] is ending[1]):
            return
        position = self.positions.pop(node)[None]
        for branch in ending:
            self.remove(branch)
        if len(ending) == 1:
            other, points = ending[0].from_end(node)
            self.add(FREE_END, other, np.concatenate((position, points)))
        elif len(ending) == 2:
            first, before = ending[0].from_end(node)
            last, after = ending[1].from_end(node)
            self.add(first, last, np.concatenate((before[::-1], position, after)))

    def simplify(
        self, min_branch: float, radius: float, half_width: Callable[[Floats], Floats] | None = None
    ) -> tuple[float, float]:
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
        half_width
            function from positions (K, D) to the distance (K,) to the object's edge, m (px in 2-D). Spurs that reach no farther
            than the corners of a region that wide are removed too, such as those in a connector; None keeps them.

        Returns
        -------
        spur_length, loop_length : m (px in 2-D), total length of the spurs and of the loops removed.
        """
        removed = {"spur": 0.0, "loop": 0.0}
        for node in list(self.positions):
            self.dissolve(node)
        queue = _Simplification(self, min_branch, MIN_LOOP_RADII * radius, JUNCTION_MERGE_DISTANCE_RADII * radius, half_width)
        while True:
            queue.take([self._branches[i] for i in range(queue.seen, self._added) if i in self._branches])
            queue.seen = self._added
            shortest = queue.pop_removable()
            if shortest is not None:
                removed["spur" if FREE_END in (shortest.a, shortest.b) else "loop"] += shortest.length
                self.remove(shortest)
                for node in {shortest.a, shortest.b} - {FREE_END}:
                    self.dissolve(node)
                continue
            bridge = queue.pop_bridge()
            if bridge is None:
                return removed["spur"], removed["loop"]
            self.contract(bridge)


_Queue = list[tuple[float, int, Branch]]
"""A heap of branches, the shortest first, of equal ones the one added first."""


class _Simplification:
    """The branches of a graph that may be removed or contracted, the shortest first.

    A branch never changes: one that is cut, joined or moved is removed, and another one added. So each is put in the queues once,
    and whether it may still go is asked when it comes up.
    """

    def __init__(
        self,
        graph: BranchGraph,
        min_branch: float,
        min_loop: float,
        merge_distance: float,
        half_width: Callable[[Floats], Floats] | None,
    ) -> None:
        self.graph, self.seen, self.half_width = graph, 0, half_width
        self.min_branch, self.min_loop, self.merge_distance = min_branch, min_loop, merge_distance
        self.removable: _Queue = []
        self.bridges: _Queue = []
        self.between: dict[tuple[int, int], _Queue] = {}

    def take(self, branches: list[Branch]) -> None:
        """Put the branches that were added to the graph in the queues."""
        for branch in branches:
            entry = (branch.length, branch.number, branch)
            if branch.is_spur:
                if branch.length < self._min_spur(branch):
                    heapq.heappush(self.removable, entry)
            elif branch.a == branch.b:
                if branch.a != FREE_END and branch.length < self.min_loop:
                    heapq.heappush(self.removable, entry)
            else:
                if branch.length < self.min_loop:
                    # the branches that were too long to be around a small hole with the shortest so far may now be short enough
                    former = self._shortest_between(branch)
                    if former is not None and entry[:2] < former[:2]:
                        for other in self.between[self._key(branch)]:
                            heapq.heappush(self.removable, other)
                    heapq.heappush(self.between.setdefault(self._key(branch), []), entry)
                    heapq.heappush(self.removable, entry)
                if branch.length < self.merge_distance:
                    heapq.heappush(self.bridges, entry)

    def pop_removable(self) -> Branch | None:
        """Return the shortest of: spurs, small loops, and the longer of two branches around a small hole; None without any."""
        while self.removable:
            _, _, branch = heapq.heappop(self.removable)
            if self.graph.has(branch) and self._may_go(branch):
                return branch
        return None

    def pop_bridge(self) -> Branch | None:
        """Return the shortest branch between the two forks of a crossing; None without any."""
        while self.bridges:
            _, _, branch = heapq.heappop(self.bridges)
            if self.graph.has(branch):
                return branch
        return None

    def _min_spur(self, branch: Branch) -> float:
        """Return the least length of a spur that is kept, m (px in 2-D): thinning leads spurs to the corners of wide regions."""
        if self.half_width is None:
            return self.min_branch
        node = branch.b if branch.a == FREE_END else branch.a
        return max(self.min_branch, CORNER_HALF_WIDTHS * float(self.half_width(self.graph.positions[node][None])[0]))

    def _may_go(self, branch: Branch) -> bool:
        if branch.is_spur:
            return True
        if branch.a == branch.b:
            return not self.graph.is_loop(branch)
        shortest = self._shortest_between(branch)
        return shortest is not None and shortest[2] is not branch and shortest[0] + branch.length < self.min_loop

    def _shortest_between(self, branch: Branch) -> tuple[float, int, Branch] | None:
        """Return the entry of the shortest branch between the nodes of a branch; None without any shorter than `min_loop`."""
        queue = self.between.get(self._key(branch), [])
        while queue and not self.graph.has(queue[0][2]):
            heapq.heappop(queue)
        return queue[0] if queue else None

    @staticmethod
    def _key(branch: Branch) -> tuple[int, int]:
        return min(branch.a, branch.b), max(branch.a, branch.b)


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
    at_junction = np.flatnonzero(cluster >= 0)
    node = cluster[at_junction]
    sums = [np.bincount(node, weights=column) for column in skeleton.points[at_junction].T]
    graph = BranchGraph(dict(enumerate(np.column_stack(sums) / np.bincount(node)[:, None])))
    loops = []
    ordered = skeleton.points[order]
    for (a, b), (start, stop) in zip(ends.tolist(), itertools.pairwise(bounds.tolist()), strict=True):
        points = ordered[start:stop]
        if a == CLOSED_LOOP:
            loops.append(points)
        else:
            graph.add(a, b, points)
    return graph, loops
