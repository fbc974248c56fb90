"""Turn points into a sparse voxel grid, and close the holes in it."""

import math
from dataclasses import replace
from functools import singledispatch

import numpy as np

from ..errors import InputError
from ..geometry.cells import box_shape, cell_coords, cell_keys, close_cells, distinct, extent, neighbors_of
from ..geometry.disjoint_set import group_sums
from ..geometry.limits import KEY_LIMIT, MAX_CELLS
from ..geometry.radii import STEP_RADII
from ..kernels import connected_parts
from ..scene.cloud import CloudScene
from ..scene.frame import FrameScene
from ..scene.image import ImageScene
from ..scene.scene import Scene
from ..types import Floats, Ints, VoxelGrid
from ..types.stopwatch import timed
from .core_pixels import core_points

DEPTH_EDGES = 2.0
"""Depth of a voxel of a frame in edges: depth is noisy, and where a strand runs away from the camera it leaps from pixel to
pixel."""

MAX_CLOSED_GAP = 4.0
"""Voxels; strands of a cloud nearer to each other than this are closed one by one, since closing joins what lies two apart."""

CLOSING_ITERATIONS = 1
"""Voxels by which holes are closed (dilate, then erode): one brings back a shell with a tenth of its voxels missing."""

MIN_COMPONENT = 12
"""Voxels of half a radius; smaller 26-connected components of a cloud are removed."""

MIN_COMPONENT_COARSE = 3
"""Voxels of the smallest component in a frame, and in a cloud of coarse voxels: along a thin object there is one voxel behind
another. The parts of a frame's mask were judged in the image; small components of its voxels are strands with torn depth."""


NO_STRANDS: Ints = np.zeros(0, dtype=np.int64)


@timed("voxelize")
def voxelize(scene: Scene) -> VoxelGrid:
    """Return the voxels that the object's points occupy, with small holes closed and small components removed.

    Of a frame only the core of each strand (the part around its middle) is used, so that strands side by side stay apart; its
    voxels lie on the rays of its camera, even in inverse depth: pixels are of one size there, and depth has one noise. In 2-D
    every pixel of the mask is a voxel, and none is removed.

    Parameters
    ----------
    scene
        what was captured, with the settings: a radius that is not set is measured; a voxel size that is not set follows from the
        radius and the spacing of the points.

    Returns
    -------
    The occupied voxels; none if there are no points.

    Raises
    ------
    InputError : the grid would hold more than MAX_CELLS (two million) voxels.
    """
    return _grid_of(scene) if len(scene.points) else _no_voxels(scene.dim)


@singledispatch
def _grid_of(scene: Scene) -> VoxelGrid:
    raise NotImplementedError(type(scene).__name__)


@_grid_of.register
def _of_image(scene: ImageScene) -> VoxelGrid:
    """Return the mask of an image as a grid: the points (N, 2) are all of its pixels, in lexicographic order."""
    pixels = scene.pixels
    if len(pixels) > MAX_CELLS:
        raise InputError(
            f"the mask has {len(pixels)} pixels, the limit is {MAX_CELLS}: scale the image down", code="voxels-too-many"
        )
    origin = np.array([pixels[0, 0], pixels[:, 1].min()]) - 1
    return VoxelGrid(pixels - origin, scene.points, np.ones(len(pixels), dtype=np.int64), 1.0, origin - 0.5)


@_grid_of.register
def _of_frame(scene: FrameScene) -> VoxelGrid:
    """Return the voxels of the cores of the strands, on the rays of the camera."""
    points, distance = core_points(scene), scene.spacing * scene.camera.fx
    if not len(points):
        return _no_voxels(3)
    grid = _closed_grid(_along_rays(points, distance), scene.voxel, MIN_COMPONENT_COARSE)
    return replace(grid, centroids=_in_space(grid.centroids, distance))


@_grid_of.register
def _of_cloud(scene: CloudScene) -> VoxelGrid:
    """Return the voxels of a cloud, with the points that join sparse ones; strands near each other are closed one by one."""
    axes, strand, radius = scene.parted
    if len(axes):
        return _closed_grid(axes, scene.voxel_factor * STEP_RADII * radius, MIN_COMPONENT_COARSE, strand)
    points = np.concatenate((scene.filtered, scene.bridges)) if len(scene.bridges) else scene.filtered
    fineness = min(1.0, scene.voxel_factor * STEP_RADII * scene.radius / scene.voxel)
    min_voxels = min(MIN_COMPONENT, max(MIN_COMPONENT_COARSE, math.ceil(MIN_COMPONENT * fineness**2)))
    near = scene.facts.strands_nearer(MAX_CLOSED_GAP * scene.voxel)
    return _closed_grid(points, scene.voxel, min_voxels, scene.facts.strand_of(points) if near else NO_STRANDS)


def _along_rays(points: Floats, distance: float) -> Floats:
    """Return points (N, 3) m as (x, y) where their rays meet the plane at a distance, m, and their inverse depth.

    The inverse depth is in units of m at that distance, over DEPTH_EDGES. A stereo camera measures it with the same noise at all
    distances, and pixels are as large for a strand that is near as for one that is far.
    """
    scale = distance / points[:, 2:]
    return np.concatenate((points[:, :2] * scale, scale * (-distance / DEPTH_EDGES)), axis=1)


def _in_space(points: Floats, distance: float) -> Floats:
    """Return the points (N, 3) m that `_along_rays` would give as these."""
    scale = points[:, 2:] * (-DEPTH_EDGES / distance)
    at_distance = np.concatenate((points[:, :2], np.full((len(points), 1), distance)), axis=1)
    return np.asarray(at_distance / scale)


def _closed_grid(points: Floats, size: float, min_voxels: int, strand: Ints = NO_STRANDS) -> VoxelGrid:
    """Return the voxels that points (N, D) occupy, and those that closing adds, without components of less than `min_voxels`.

    strand : (N,), the strand of each point, which are closed one by one; empty if all are closed together.
    """
    margin = CLOSING_ITERATIONS + 1
    origin = (np.floor(extent(points)[0] / size) - margin) * size
    shape, total = box_shape(points, origin, size, margin)
    _check_size(total, KEY_LIMIT, size)
    of_point = cell_keys(points, origin, size, shape)
    occupied = distinct(of_point)
    _check_size(len(occupied), MAX_CELLS, size)
    keys = close_cells(occupied, shape, CLOSING_ITERATIONS)
    if len(strand):
        parts = (np.unique(of_point[strand == k]) for k in range(int(strand.max()) + 1))
        keys = np.unique(np.concatenate([close_cells(part, shape, CLOSING_ITERATIONS) for part in parts]))
    _check_size(len(keys), MAX_CELLS, size)
    coords, table = cell_coords(keys, shape), neighbors_of(cell_coords(keys, shape))
    centroids, counts = _means_in_voxels(points, np.searchsorted(keys, of_point), table, origin + (coords + 0.5) * size)
    label = connected_parts(table)
    kept = np.bincount(label)[label] >= min_voxels
    row = np.append(np.where(kept, np.cumsum(kept) - 1, -1), -1).astype(np.int32)  # the last entry is that of no neighbor
    return VoxelGrid(coords[kept], centroids[kept], counts[kept], size, origin, row[table[kept]])


def _means_in_voxels(points: Floats, voxel: Ints, table: Ints, centers: Floats) -> tuple[Floats, Ints]:
    """Return the mean of the points (N, D) in each voxel, (M, D), and their number, (M,).

    A voxel without points has the mean of its neighbors that hold points, or its center where none does. voxel : (N,), the voxel
    of each point. table : (M, 26), the neighbors of each voxel. centers : (M, D).
    """
    counts = np.bincount(voxel, minlength=len(centers))
    holds = np.append(counts > 0, False)
    sums = group_sums(points, voxel, len(centers))
    means = np.where(holds[:-1, None], sums / np.maximum(counts, 1)[:, None], centers)
    holes = np.flatnonzero(counts == 0)
    near = np.where(holds[table[holes]], table[holes], -1)
    number = np.count_nonzero(near >= 0, axis=1)[:, None]
    around = np.concatenate((means, np.zeros_like(means[:1])))[near].sum(axis=1)
    means[holes] = np.where(number > 0, around / np.maximum(number, 1), means[holes])
    return means, counts


def _no_voxels(dim: int) -> VoxelGrid:
    zero = np.zeros((0, dim))
    return VoxelGrid(zero.astype(np.int64), zero, np.zeros(0, dtype=np.int64), 1.0, np.zeros(dim))


def _check_size(count: float, limit: float, size: float) -> None:
    if count > limit:
        raise InputError(
            f"the grid would hold {count:.4g} voxels of {size:.3g} m, the limit is {limit:.4g}: "
            "set a larger voxelize.size, or segment more narrowly",
            code="voxels-too-many",
        )
