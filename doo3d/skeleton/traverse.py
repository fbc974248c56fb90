"""Turn the skeleton into ordered paths.

In 3-D, and by default in 2-D, the graph of the skeleton gives each branch once. In 2-D the contour around each skeleton can be
followed instead, as Keipour et al. (RA-L 2022, section III-C) do.
"""

from dataclasses import dataclass

import numpy as np

from ..config import TraverseConfig
from ..geometry.curves import Curves
from ..geometry.limits import MAX_BRANCHES
from ..geometry.mask import half_widths
from ..geometry.radii import NODE_RADII, TOUCHING_RADII
from ..kernels import neighbor_table, skeleton_paths
from ..scene.scene import Scene
from ..types import Array, Floats, Path, Skeleton
from ..types.stopwatch import timed
from .contours import trace_contours

MIN_LOOP_RADII = 12.0
"""Radii; loops of less perimeter are holes in the surface, not turns of the object, and collapse."""

JUNCTION_MERGE_DISTANCE_RADII = NODE_RADII
"""Radii; two forks nearer to each other than this are one crossing: strands at over 40 degrees thin to such a pair."""

CORNER_HALF_WIDTHS = 1.8
"""Half-widths of a region from its middle to its corners at most: 1.4 in a square, more where its edge is ragged."""

JUNCTION_TRIM_MIN_RADII, JUNCTION_TRIM_MAX_RADII = 1.0, 15.0
"""Radii cut at least and at most from a path where it meets a junction, whose pull bends it."""

TIP_TRIM_FRACTION, JUNCTION_TRIM_FRACTION = 0.2, 0.4
"""Fractions of a branch cut at most at a free end, and at a junction, so that a part of every branch stays."""

NOTE = (
    "traverse: the skeleton has {} branches, of which the {} longest are used; {} short ones are left out; segment more narrowly"
)


@dataclass(frozen=True)
class Traversal:
    """The polylines along the skeleton of one frame, and the lengths of skeleton that are in none of them.

    Lengths are totals in m (px in 2-D). With the method `contours` only `spur_length` is measured.

    Attributes
    ----------
    paths
        one polyline per branch between tips and junctions, a loop as a closed polyline; with `contours` one per contour.
    spur_length
        length of the spurs removed: branches with a free end, shorter than `traverse.min_branch` radii. With `contours` the
        number of pixels in the spurs.
    loop_length
        length of the small loops removed, which run around holes in the surface.
    trimmed_length
        length cut off the ends of branches: at tips, and where strands touch at junctions.
    notes
        messages to the user, one sentence each: that there were too many branches.
    """

    paths: list[Path]
    spur_length: float = 0.0
    loop_length: float = 0.0
    trimmed_length: float = 0.0
    notes: tuple[str, ...] = ()


@timed("traverse")
def traverse(skeleton: Skeleton, scene: Scene, config: TraverseConfig, clearance: float = 1.0) -> Traversal:
    """Turn the skeleton into ordered polylines.

    The method `graph` (the default) gives one smooth polyline per branch between tips and junctions, cut a little short at both
    ends; a loop becomes a closed polyline. The method `contours` (2-D only) gives the contours around the skeleton, not smoothed.

    Parameters
    ----------
    skeleton
        the voxels that thinning left.
    scene
        what was captured; radius and voxel size are used.
    config
        section `traverse` of the settings.
    clearance
        factor of the distance from other branches up to which paths are cut back at junctions.

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
        paths, pixels = trace_contours(skeleton, config.min_branch * scene.radius)
        return Traversal(paths, spur_length=float(pixels))
    return _traverse_graph(skeleton, scene, config, clearance)


def _traverse_graph(skeleton: Skeleton, scene: Scene, config: TraverseConfig, clearance: float) -> Traversal:
    coords, radius = skeleton.coords, scene.radius
    widths: Array = np.zeros((0, 0), dtype=np.float32)
    origin: Floats = np.zeros(2)
    if coords.shape[1] == 2:
        coords = np.column_stack((coords, np.ones(len(coords), dtype=np.int64)))
        if scene.config.merge.branches:
            widths, origin = half_widths(scene.mask)
    points, bounds, closed, lengths, count = skeleton_paths(
        neighbor_table(coords),
        np.ascontiguousarray(skeleton.points),
        round(radius / scene.voxel),  # a moving mean over a radius on either side takes the voxel steps out of a path
        np.array((config.min_branch, MIN_LOOP_RADII, JUNCTION_MERGE_DISTANCE_RADII)) * radius,
        np.array((JUNCTION_TRIM_MIN_RADII, JUNCTION_TRIM_MAX_RADII, clearance * TOUCHING_RADII)) * radius,
        np.array((TIP_TRIM_FRACTION, JUNCTION_TRIM_FRACTION)),
        widths,
        origin,
        CORNER_HALF_WIDTHS,
        MAX_BRANCHES,
    )
    lines = Curves(points, bounds, closed)
    paths = [Path(line, is_closed) for line, is_closed in zip(lines, closed.tolist(), strict=True)]
    notes = (NOTE.format(count, MAX_BRANCHES, count - MAX_BRANCHES),) if count > MAX_BRANCHES else ()
    spurs, small_loops, trimmed = lengths.tolist()
    return Traversal(paths, spurs, small_loops, trimmed, notes)
