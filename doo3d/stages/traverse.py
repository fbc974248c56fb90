"""The skeleton as a graph in place of contours: every branch one ordered path.

The paper goes round each skeleton along its contour and says (section III-C) that the step can be skipped where
ordered points are had by other means; in 3-D there is no contour, and the graph gives each branch once.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ..config import TraverseConfig
from ..errors import ConfigError
from ..geometry.polyline import arc_length, moving_mean, resample, steps
from ..kernels.clearance import first_clear
from ..kernels.skeleton_graph import crossing_numbers, prune_spurs, trace_branches
from ..kernels.thinning import neighbor_table
from ..types import Floats, Ints, Path, Skeleton
from . import FrameContext

FREE = -1


MIN_LOOP = 12.0
"""Radii; loops of less perimeter are holes in the surface, not turns of the object, and collapse."""

SMOOTHING_RADII = 1.0
"""Radii; half-width of the moving mean that takes the voxel steps out of a path."""

JUNCTION_MERGE_DISTANCE = 3.0
"""Radii; two forks nearer to each other than this are one crossing: strands at over 40 degrees thin to such a pair."""

JUNCTION_TRIM_MIN, JUNCTION_TRIM_MAX = 1.0, 15.0
"""Radii cut at least and at most from a path where it meets a junction, whose pull bends it."""

JUNCTION_CLEARANCE = 2.2
"""Radii between paths at a junction up to which both are cut, since there their surfaces still touch."""


@dataclass(eq=False)
class _Branch:
    """A run of points (P, D) without those of its nodes; `a` and `b` are nodes or FREE."""

    a: int
    b: int
    points: Floats
    length: float = 0.0


_Ways = list[tuple[_Branch, Floats]]
"""Branches with all their points (P, D), those of their nodes too."""


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
        parts = [branch.points]
        if branch.a != FREE:
            parts.insert(0, self.places[branch.a][None])
        if branch.b != FREE:
            parts.append(self.places[branch.b][None])
        return np.concatenate(parts)

    def at(self, node: int) -> list[_Branch]:
        """The branches that end at a node; a loop counts twice."""
        return [branch for branch in self.branches for end in (branch.a, branch.b) if end == node]

    def contract(self, bridge: _Branch) -> None:
        """Make one node in the middle of a bridge out of the two at its ends."""
        self.branches.remove(bridge)
        self.places[bridge.a] = (self.places[bridge.a] + self.places[bridge.b]) / 2
        del self.places[bridge.b]
        for branch in [branch for branch in self.branches if bridge.b in (branch.a, branch.b)]:
            self.branches.remove(branch)
            a, b = (bridge.a if end == bridge.b else end for end in (branch.a, branch.b))
            self.add(a, b, branch.points)

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


def traverse(skeleton: Skeleton, context: FrameContext, config: TraverseConfig) -> list[Path]:
    """Ordered paths between tips and junctions, smoothed; closed loops as closed paths.

    Raises
    ------
    ConfigError : contours are asked for in 3-D.
    """
    if not len(skeleton.coords):
        return []
    if config.method == "contours":
        return _contours(skeleton, context.radius, config)
    graph, rings = _build(skeleton)
    _simplify(graph, config, context.radius)
    half = round(SMOOTHING_RADII * context.radius / context.voxel)
    least = MIN_LOOP * context.radius
    rings += [graph.whole(branch)[:-1] for branch in graph.branches if _is_ring(graph, branch)]
    paths = [Path(moving_mean(ring, half, closed=True), closed=True) for ring in rings if steps(ring, True).sum() >= least]
    ways = [(branch, graph.whole(branch)) for branch in graph.branches]
    for branch, points in ways:
        if not _is_ring(graph, branch):
            points = _trim(branch, points, ways, config, context.radius)
            if len(points) > 1:
                paths.append(Path(moving_mean(points, half)))
    return paths


def _contours(skeleton: Skeleton, radius: float, config: TraverseConfig) -> list[Path]:
    """The boundary round each piece of a 2-D skeleton, from a tip and back to it (paper, section III-C; Suzuki and Abe 1985).

    Spurs go first: thinning leaves lines into the corners of an end, and the paper wants one line per branch (III-B). A
    boundary inside a loop has no tip and starts where lines meet.
    """
    if skeleton.coords.shape[1] != 2:
        raise ConfigError("traverse.method is contours, which there are in 2-D only: use graph", code="config-mode")
    u, v = (skeleton.coords - skeleton.coords.min(axis=0) + 1).T
    image = np.zeros((v.max() + 2, u.max() + 2), dtype=np.uint8)
    image[v, u] = 1
    prune_spurs(image, v, u, config.min_branch * radius)
    lines = crossing_numbers(image, v, u)
    tips, meetings = (np.column_stack((u, v))[which] for which in (lines == 1, lines > 2))
    found, _ = cv2.findContours(cv2.dilate(image, np.ones((3, 3), np.uint8)), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    shift = skeleton.points[0] - (u[0], v[0])
    paths = []
    for contour in found:
        points = contour[:, 0].astype(float)
        starts = [at for at in (_nearest(points, tips, 1.0), _nearest(points, meetings, 2.0)) if at is not None]
        points = np.roll(points, -starts[0] if starts else 0, axis=0)
        paths.append(Path(np.concatenate((points, points[:1])) + shift))
    return paths


def _nearest(points: Floats, places: Ints, reach: float) -> int | None:
    """The first of the points (P, 2) that is nearest to one of the places (T, 2), if it is within reach (of rows or columns)."""
    if not len(places):
        return None
    distance = cKDTree(places).query(points, p=np.inf)[0]
    nearest = int(np.argmin(distance))
    return nearest if distance[nearest] <= reach else None


def _is_ring(graph: _Graph, branch: _Branch) -> bool:
    return branch.a == branch.b != FREE and len(graph.at(branch.a)) == 2


def _build(skeleton: Skeleton) -> tuple[_Graph, list[Floats]]:
    coords: Ints = skeleton.coords
    if coords.shape[1] == 2:
        coords = np.column_stack((coords, np.ones(len(coords), dtype=np.int64)))
    cluster, order, bounds, nodes = trace_branches(neighbor_table(coords))
    graph = _Graph()
    crowd = np.flatnonzero(cluster >= 0)
    node = cluster[crowd]
    sums = [np.bincount(node, weights=column) for column in skeleton.points[crowd].T]
    graph.places = dict(enumerate(np.column_stack(sums) / np.bincount(node)[:, None]))
    rings = []
    ordered = skeleton.points[order]
    for (a, b), (start, end) in zip(nodes.tolist(), itertools.pairwise(bounds.tolist()), strict=True):
        points = ordered[start:end]
        if a == -2:
            rings.append(points)
        else:
            graph.add(a, b, points)
    return graph, rings


def _simplify(graph: _Graph, config: TraverseConfig, radius: float) -> None:
    """Drop spurs and small loops, the shortest first; what was a junction only because of them becomes a path again.

    A crossing thins to two forks with a short bridge between them: then the forks become one junction.
    """
    for node in list(graph.places):
        graph.dissolve(node)
    while True:
        candidates = _droppable(graph, config, radius)
        if candidates:
            victim = candidates[0]
            graph.branches.remove(victim)
            for node in {victim.a, victim.b} - {FREE}:
                graph.dissolve(node)
            continue
        bridges = [b for b in graph.branches if FREE != b.a != b.b != FREE and b.length < JUNCTION_MERGE_DISTANCE * radius]
        if not bridges:
            return
        graph.contract(min(bridges, key=lambda branch: branch.length))


def _droppable(graph: _Graph, config: TraverseConfig, radius: float) -> list[_Branch]:
    """Spurs, small loops, and of two branches between the same nodes that enclose little the longer one."""
    result = []
    shortest: dict[tuple[int, int], _Branch] = {}
    for branch in sorted(graph.branches, key=lambda branch: branch.length):
        if (branch.a == FREE) != (branch.b == FREE):
            drop = branch.length < config.min_branch * radius
        elif branch.a == branch.b:
            drop = branch.a != FREE and branch.length < MIN_LOOP * radius and len(graph.at(branch.a)) > 2
        else:
            twin = shortest.setdefault((min(branch.a, branch.b), max(branch.a, branch.b)), branch)
            drop = twin is not branch and twin.length + branch.length < MIN_LOOP * radius
        if drop:
            result.append(branch)
    return result


def _trim(branch: _Branch, points: Floats, ways: _Ways, config: TraverseConfig, radius: float) -> Floats:
    """The points (P, D) of a branch without its ends. Empty when nothing is left.

    `trim` radii of a free end go, which thinning draws into a corner of the surface. Of an end that a junction pulls out
    of shape as much goes, and on until it is `separation` radii from every other branch there, where the surfaces of
    two strands no longer touch; but at most 0.4 of the branch.
    """
    along = arc_length(points)
    cut = [0.0, 0.0]
    for end, node in enumerate((branch.a, branch.b)):
        if node == FREE:
            cut[end] = min(JUNCTION_TRIM_MIN * radius, 0.2 * float(along[-1]))
            continue
        inwards = points if end == 0 else points[::-1]
        away = along if end == 0 else along[-1] - along[::-1]
        reach = int(np.searchsorted(away, JUNCTION_TRIM_MAX * radius)) + 1
        others = _others(branch, ways, node, end, reach)
        clear = float(away[first_clear(np.ascontiguousarray(inwards[:reach]), others, JUNCTION_CLEARANCE * radius)])
        cut[end] = max(JUNCTION_TRIM_MIN * radius, min(clear, 0.4 * float(along[-1])))
    if cut[0] + cut[1] >= along[-1]:
        return points[:0]
    low, high = cut[0], float(along[-1]) - cut[1]
    ends = resample(points, np.array([low, high]))
    return np.concatenate((ends[:1], points[(along > low) & (along < high)], ends[1:]))


def _others(branch: _Branch, ways: _Ways, node: int, end: int, reach: int) -> Floats:
    """The first `reach` points of every way that leaves a node but the end of the branch there, (Q, D) m."""
    found: list[Floats] = [branch.points[:0]]
    for other, points in ways:
        many = min(reach, len(points) // 2 + 1) if other.a == other.b else reach
        if other.a == node and (other is not branch or end == 1):
            found.append(points[:many])
        if other.b == node and (other is not branch or end == 0):
            found.append(points[::-1][:many])
    return np.concatenate(found)
