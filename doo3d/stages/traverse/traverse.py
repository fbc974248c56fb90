"""Turn the skeleton into ordered paths.

In 3-D, and by default in 2-D, the graph of the skeleton gives each branch once. In 2-D the contour around each skeleton can be
followed instead, as Keipour et al. (RA-L 2022, section III-C) do.
"""

from __future__ import annotations

import numpy as np

from ...config import TraverseConfig
from ...geometry.mask import half_width_in
from ...geometry.polyline import arc_length, moving_mean, resample, steps
from ...types import Floats, Path, Skeleton
from .. import FrameContext
from .branch_graph import FREE_END, MIN_LOOP_RADII, Branch, build_graph
from .contours import trace_contours
from .traversal import Traversal

SMOOTHING_RADII = 1.0
"""Radii; half-width of the moving mean that takes the voxel steps out of a path."""

TRIM_RADII = 1.0
"""Radii cut from both ends of a path: as far as the surface of another strand, or the corner of an end, pulls the skeleton."""

TIP_TRIM_FRACTION = 0.2
"""Fraction of a branch cut at most at a free end, so that a part of every branch stays."""

MAX_BRANCHES = 3000
"""Branches at most that become paths, the longest; each takes 0.1 ms. A frame of an object has less than a hundred."""


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
    for branch in branches:
        trimmed, cut = _trim_branch(branch, graph.all_points(branch), context.radius)
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


def _trim_branch(branch: Branch, points: Floats, radius: float) -> tuple[Floats, float]:
    """Return the points (P, D) of a branch without its ends, and the length cut off; no points where nothing is left.

    Both ends are cut by `TRIM_RADII`: thinning draws a free end into a corner of the surface, and a junction pulls at branches.
    """
    position = arc_length(points)
    length = float(position[-1])
    cut = [
        min(TRIM_RADII * radius, TIP_TRIM_FRACTION * length) if node == FREE_END else TRIM_RADII * radius
        for node in (branch.a, branch.b)
    ]
    if cut[0] + cut[1] >= length:
        return points[:0], length
    low, high = cut[0], length - cut[1]
    ends = resample(points, np.array([low, high]))
    return np.concatenate((ends[:1], points[(position > low) & (position < high)], ends[1:])), cut[0] + cut[1]
