"""The skeleton as a graph in place of contours: every branch one ordered path.

The paper goes round each skeleton along its contour and says (section III-C) that the step can be skipped where
ordered points are had by other means; in 3-D there is no contour, and the graph gives each branch once.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..config import TraverseConfig
from ..geometry import arc_length, moving_mean, resample, steps
from ..kernels.thinning import neighbours
from ..kernels.tracing import trace
from ..types import Floats, Ints, Path, Skeleton

FREE = -1


@dataclass(eq=False)
class _Branch:
    """A run of points (P, D) without those of its nodes; `a` and `b` are nodes or FREE."""

    a: int
    b: int
    points: Floats
    length: float = 0.0


@dataclass
class _Graph:
    """The branches, and the place of every node, (D,) m."""

    branches: list[_Branch] = field(default_factory=list)
    places: dict[int, Floats] = field(default_factory=dict)

    def add(self, a: int, b: int, points: Floats) -> None:
        branch = _Branch(a, b, points)
        branch.length = float(steps(self.whole(branch)).sum())
        self.branches.append(branch)

    def whole(self, branch: _Branch) -> Floats:
        """The branch's points with those of the nodes at its ends."""
        ends = [[self.places[node]] if node != FREE else [] for node in (branch.a, branch.b)]
        return np.array([*ends[0], *branch.points, *ends[1]]).reshape(-1, branch.points.shape[1])

    def at(self, node: int) -> list[_Branch]:
        """The branches that end at a node; a loop counts twice."""
        return [branch for branch in self.branches for end in (branch.a, branch.b) if end == node]

    def dissolve(self, node: int) -> None:
        """Turn a node that is no junction any more into a part of the branch that runs through it."""
        here = self.at(node)
        if len(here) > 2 or (len(here) == 2 and here[0] is here[1]):
            return
        place = self.places.pop(node)[None]
        self.branches = [branch for branch in self.branches if all(branch is not gone for gone in here)]
        if len(here) == 1:
            other, points = _away(here[0], node)
            self.add(FREE, other, np.concatenate((place, points)))
        elif len(here) == 2:
            first, before = _away(here[0], node)
            last, after = _away(here[1], node)
            self.add(first, last, np.concatenate((before[::-1], place, after)))


def _away(branch: _Branch, node: int) -> tuple[int, Floats]:
    """The branch as seen from its end at `node`: the node at its other end, and its points in that order."""
    return (branch.b, branch.points) if branch.a == node else (branch.a, branch.points[::-1])


def traverse(skeleton: Skeleton, config: TraverseConfig) -> list[Path]:
    """Ordered paths between tips and junctions, smoothed; closed loops as closed paths."""
    if not len(skeleton.coords):
        return []
    graph, rings = _build(skeleton)
    _simplify(graph, config, skeleton.radius)
    half = round(config.smooth * skeleton.radius / skeleton.size)
    least = config.min_loop * skeleton.radius
    rings += [graph.whole(branch)[:-1] for branch in graph.branches if _is_ring(graph, branch)]
    paths = [Path(moving_mean(ring, half, closed=True), closed=True) for ring in rings if steps(ring, True).sum() >= least]
    for branch in graph.branches:
        if not _is_ring(graph, branch):
            points = moving_mean(graph.whole(branch), half)
            points = _trim(points, branch, config.trim * skeleton.radius)
            if len(points) > 1:
                paths.append(Path(points))
    return paths


def _is_ring(graph: _Graph, branch: _Branch) -> bool:
    return branch.a == branch.b != FREE and len(graph.at(branch.a)) == 2


def _build(skeleton: Skeleton) -> tuple[_Graph, list[Floats]]:
    coords: Ints = skeleton.coords
    if coords.shape[1] == 2:
        coords = np.column_stack((coords, np.ones(len(coords), dtype=np.int64)))
    cluster, order, bounds, nodes = trace(neighbours(coords))
    graph = _Graph()
    for node in range(int(cluster.max(initial=-1)) + 1):
        graph.places[node] = skeleton.points[cluster == node].mean(axis=0)
    rings = []
    for (a, b), start, end in zip(nodes.tolist(), bounds[:-1], bounds[1:], strict=True):
        points = skeleton.points[order[start:end]]
        if a == -2:
            rings.append(points)
        else:
            graph.add(a, b, points)
    return graph, rings


def _simplify(graph: _Graph, config: TraverseConfig, radius: float) -> None:
    """Drop spurs and small loops, the shortest first; what was a junction only because of them becomes a path again."""
    for node in list(graph.places):
        graph.dissolve(node)
    while True:
        candidates = [branch for branch in graph.branches if _droppable(graph, branch, config, radius)]
        if not candidates:
            return
        victim = min(candidates, key=lambda branch: branch.length)
        graph.branches.remove(victim)
        for node in {victim.a, victim.b} - {FREE}:
            graph.dissolve(node)


def _droppable(graph: _Graph, branch: _Branch, config: TraverseConfig, radius: float) -> bool:
    if (branch.a == FREE) != (branch.b == FREE):
        return branch.length < config.min_branch * radius
    if branch.a == FREE:
        return False
    if branch.a == branch.b:
        return branch.length < config.min_loop * radius and len(graph.at(branch.a)) > 2
    twins = [
        other
        for other in graph.branches
        if other is not branch and {other.a, other.b} == {branch.a, branch.b} and other.length <= branch.length
    ]
    return any(branch.length + twin.length < config.min_loop * radius for twin in twins)


def _trim(points: Floats, branch: _Branch, trim: float) -> Floats:
    """The path without `trim` m at the ends that meet a junction; empty when nothing is left."""
    along = arc_length(points)
    low = trim if branch.a != FREE else 0.0
    high = along[-1] - (trim if branch.b != FREE else 0.0)
    if high <= low:
        return points[:0]
    inner = points[(along > low) & (along < high)]
    ends = resample(points, np.array([low, high]))
    return np.concatenate((ends[:1], inner, ends[1:]))
