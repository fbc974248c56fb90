"""Turn the skeleton into ordered paths.

In 3-D, and by default in 2-D, the graph of the skeleton gives each branch once. In 2-D the contour around each skeleton can be
followed instead, as Keipour et al. (RA-L 2022, section III-C) do.
"""

from __future__ import annotations

import numpy as np

from ...config import TraverseConfig
from ...geometry.curves import Curves
from ...geometry.mask import half_width_in
from ...geometry.polyline import arc_length, moving_mean, resample, steps
from ...geometry.radii import TOUCHING_RADII
from ...kernels import first_clear
from ...types import Floats, Path, Skeleton
from .. import FrameContext
from .branch_graph import FREE_END, MIN_LOOP_RADII, Branch, BranchGraph, build_graph
from .contours import trace_contours
from .traversal import Traversal

SMOOTHING_RADII = 1.0
"""Radii; half-width of the moving mean that takes the voxel steps out of a path."""

JUNCTION_TRIM_MIN_RADII, JUNCTION_TRIM_MAX_RADII = 1.0, 15.0
"""Radii cut at least and at most from a path where it meets a junction, whose pull bends it."""

TIP_TRIM_FRACTION, JUNCTION_TRIM_FRACTION = 0.2, 0.4
"""Fractions of a branch cut at most at a free end, and at a junction, so that a part of every branch stays."""

MAX_BRANCHES = 3000
"""Branches at most that become paths, the longest; each takes 0.1 ms. A frame of an object has less than a hundred."""

_ClearLengths = dict[tuple[int, int], float]
"""(number of a branch, 0 for its first end or 1 for its last) -> length, m (px in 2-D)."""


def traverse(skeleton: Skeleton, context: FrameContext, config: TraverseConfig) -> Traversal:
    """Turn the skeleton into ordered polylines.

    The method `graph` (the default) gives one smooth polyline per branch between tips and junctions, cut a little short at both
    ends; a loop becomes a closed polyline. The method `contours` (2-D only) gives the contours around the skeleton, not smoothed.

    Parameters
    ----------
    skeleton
        the voxels that thinning left.
    context
        the data of the frame; radius and voxel size are used.
    config
        section `traverse` of the settings.

    Returns
    -------
    The polylines, points in m (px in 2-D), and the lengths of skeleton that are in none of them. No polylines for an empty
    skeleton.

    Raises
    ------
    ConfigError : the method `contours` is set and the skeleton is 3-D.
    """
    if not len(skeleton.coords):
        return Traversal([])
    if config.method == "contours":
        paths, pixels = trace_contours(skeleton, config.min_branch * context.radius)
        return Traversal(paths, spur_length=float(pixels))
    return _traverse_graph(skeleton, context, config)


def _traverse_graph(skeleton: Skeleton, context: FrameContext, config: TraverseConfig) -> Traversal:
    graph, loops = build_graph(skeleton)
    mask, half_width = context.foreground.mask, None
    if context.branches and mask is not None and skeleton.coords.shape[1] == 2:
        half_width = half_width_in(mask)
    spur_length, loop_length = graph.simplify(config.min_branch * context.radius, context.radius, half_width)
    loops += [graph.all_points(branch)[:-1] for branch in graph.branches if graph.is_loop(branch)]
    window_half = round(SMOOTHING_RADII * context.radius / context.voxel)
    paths, trimmed_length = [], 0.0
    for loop in loops:
        length = steps(loop, True).sum()
        if length >= MIN_LOOP_RADII * context.radius:
            paths.append(Path(moving_mean(loop, window_half, closed=True), closed=True))
        else:
            loop_length += float(length)
    branches, notes = _longest([branch for branch in graph.branches if not graph.is_loop(branch)])
    points = {branch.number: graph.all_points(branch) for branch in branches}
    clear = _clear_lengths(graph, branches, points, context.radius)
    for branch in branches:
        trimmed, cut = _trim_branch(branch, points[branch.number], clear, context.radius)
        trimmed_length += cut
        if len(trimmed) > 1:
            paths.append(Path(moving_mean(trimmed, window_half)))
    return Traversal(paths, spur_length, loop_length, trimmed_length, notes)


def _longest(branches: list[Branch]) -> tuple[list[Branch], tuple[str, ...]]:
    """Return the MAX_BRANCHES longest branches in the order given, and a note if there are more."""
    left_out = len(branches) - MAX_BRANCHES
    if left_out <= 0:
        return branches, ()
    order = np.argsort([-branch.length for branch in branches], kind="stable")
    note = (
        f"traverse: the skeleton has {len(branches)} branches, of which the {MAX_BRANCHES} longest are used; {left_out} short "
        "ones are left out; segment more narrowly"
    )
    return [branches[i] for i in np.sort(order[:MAX_BRANCHES])], (note,)


def _trim_branch(branch: Branch, points: Floats, clear: _ClearLengths, radius: float) -> tuple[Floats, float]:
    """Return the points (P, D) of a branch without its ends, and the length cut off; no points where nothing is left.

    A free end is cut by `JUNCTION_TRIM_MIN_RADII`, which thinning draws into a corner of the surface. So is an end at a junction,
    whose pull bends it, and on until it is `TOUCHING_RADII` from every other branch there, where the surfaces of two
    strands no longer touch.
    """
    position = arc_length(points)
    length = float(position[-1])
    cut = [0.0, 0.0]
    for end, node in enumerate((branch.a, branch.b)):
        if node == FREE_END:
            cut[end] = min(JUNCTION_TRIM_MIN_RADII * radius, TIP_TRIM_FRACTION * length)
        else:
            cut[end] = max(JUNCTION_TRIM_MIN_RADII * radius, min(clear[branch.number, end], JUNCTION_TRIM_FRACTION * length))
    if cut[0] + cut[1] >= length:
        return points[:0], length
    low, high = cut[0], length - cut[1]
    ends = resample(points, np.array([low, high]))
    return np.concatenate((ends[:1], points[(position > low) & (position < high)], ends[1:])), cut[0] + cut[1]


def _clear_lengths(graph: BranchGraph, branches: list[Branch], points: dict[int, Floats], radius: float) -> _ClearLengths:
    """Return the length at each end at a node until the branch is clear of all others there, at most `JUNCTION_TRIM_MAX_RADII`.

    points : number of each branch -> its points (P, D), those of its nodes too. Both ends of a branch at one node count as two
    branches, each up to the middle.
    """
    clear: _ClearLengths = {}
    at_node: dict[int, list[tuple[Branch, int]]] = {}
    for branch in branches:
        for end, node in enumerate((branch.a, branch.b)):
            if node != FREE_END:
                at_node.setdefault(node, []).append((branch, end))
    for leaving in at_node.values():
        lines, distances = [], []
        for branch, end in leaving:
            own = points[branch.number]
            position = arc_length(own)
            lines.append(own if end == 0 else own[::-1])
            distances.append(position if end == 0 else position[-1] - position[::-1])
        counts = [int(np.searchsorted(distance, JUNCTION_TRIM_MAX_RADII * radius)) + 1 for distance in distances]
        most = max(counts)
        limits = [len(line) // 2 + 1 if branch.a == branch.b else most for (branch, _), line in zip(leaving, lines, strict=True)]
        near = Curves.of([line[:most] for line in lines])
        first = first_clear(near.points, near.bounds, np.array(counts), np.array(limits), TOUCHING_RADII * radius)
        for (branch, end), distance, index in zip(leaving, distances, first.tolist(), strict=True):
            clear[branch.number, end] = float(distance[index])
    return clear
