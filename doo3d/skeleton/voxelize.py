"""Turn points into a sparse voxel grid, and close the holes in it."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np

from ..config import VoxelizeConfig
from ..errors import InputError
from ..geometry.cells import box_shape, cell_coords, cell_keys, close_cells, distinct, extent, neighbors_of
from ..geometry.disjoint_set import group_sums
from ..geometry.limits import KEY_LIMIT, MAX_CELLS
from ..geometry.noise import DEVIATIONS, MAD_TO_DEVIATION
from ..geometry.radii import STEP_RADII
from ..kernels import connected_parts
from ..scene.cloud_facts import estimate_radius, point_spacing
from ..scene.frame_facts import FrameFacts, facts_of
from ..types import Array, Bools, Floats, Foreground, Ints, VoxelGrid

VIEW_EDGE, DEPTH_EDGES = 0.8, 2.0
"""Edge of a voxel of a frame over that of a cloud, and depth of such a voxel in edges. The image tells exactly where a strand is,
so that edges may be finer; depth is noisy, and where a strand runs away from the camera it leaps from pixel to pixel."""

SIZE_OVER_SPACING = 1.6
"""Least edge of a voxel in point spacings: finer grids of evenly spread points have holes that closing cannot mend."""

MAX_CLOSED_GAP = 4.0
"""Voxels; strands of a cloud nearer to each other than this are closed one by one, since closing joins what lies two apart."""

SPARSE_RADIUS_OVER_SPACING = 0.5
"""Least radius in spacings along the strands of a cloud of sparse points, which bridges join: it sets the scale of all stages."""

CLOSING_ITERATIONS = 1
"""Voxels by which holes are closed (dilate, then erode): one brings back a shell with a tenth of its voxels missing."""

MIN_COMPONENT = 12
"""Voxels of half a radius; smaller 26-connected components of a cloud are removed."""

MIN_COMPONENT_COARSE = 3
"""Voxels of the smallest component in a frame, and in a cloud of coarse voxels: along a thin object there is one voxel behind
another. The parts of a frame's mask were judged in the image; small components of its voxels are strands with torn depth."""

MIN_MASK_RADIUS_PX = 0.5
"""px; least radius of a mask: a line of single pixels."""


def voxelize(foreground: Foreground, config: VoxelizeConfig, edge: float = 1.0) -> VoxelGrid:
    """Return the voxels that the object's points occupy, with small holes closed and small components removed.

    The points with averaged depth noise (`foreground.filtered`) are used if there are any. With a mask only the core of each
    strand (the part around its middle) is used, so that strands side by side stay apart. The voxels of a frame lie on the rays of
    its camera, even in inverse depth: pixels are of one size there, and depth has one noise. In 2-D every pixel of the mask is a
    voxel, and none is removed.

    Parameters
    ----------
    foreground
        the object's points, with mask and pixels if there are any.
    config
        section `voxelize` of the settings. A radius that is not set is measured; a voxel size that is not set follows from the
        radius and the spacing of the points.
    edge
        factor of the edge of a voxel where it follows from the radius.

    Returns
    -------
    The occupied voxels, with the radius of the object; no voxels if there are no points.

    Raises
    ------
    InputError : the grid would hold more than MAX_CELLS (two million) voxels.
    """
    dim = foreground.points.shape[1]
    if not len(foreground.points):
        return _no_voxels(dim)
    if dim == 2 and foreground.mask is not None:
        return _pixel_grid(foreground, config)
    spacing = point_spacing(foreground)
    radius = config.radius or estimate_radius(foreground, spacing)
    finer = 1.0 if foreground.camera is None else VIEW_EDGE
    size_over_radius = finer * edge * STEP_RADII
    size = config.size or max(size_over_radius * radius, finer * SIZE_OVER_SPACING * spacing)
    sampling = foreground.sampling
    if sampling is not None and sampling.scatter is not None:
        spacing = sampling.spacing
        radius = config.radius or max(sampling.scatter, SPARSE_RADIUS_OVER_SPACING * spacing)
        size = config.size or size_over_radius * radius
    kept = _points_to_voxelize(foreground, config, radius, radius / spacing)
    if not len(kept):
        return _no_voxels(dim)
    if foreground.camera is None:
        fineness = min(1.0, size_over_radius * radius / size)
        min_voxels = min(MIN_COMPONENT, max(MIN_COMPONENT_COARSE, math.ceil(MIN_COMPONENT * fineness**2)))
        return _closed_grid(kept, size, radius, foreground, min_voxels)
    distance = spacing * foreground.camera.fx
    grid = _closed_grid(_along_rays(kept, distance), size, radius, foreground, MIN_COMPONENT_COARSE)
    return replace(grid, centroids=_in_space(grid.centroids, distance))


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


def middle_pixels(facts: FrameFacts, pixels: Ints, reach: float) -> Bools:
    """Tell which pixels (N, 2) int64 (u, v) lie on the skeleton of a mask, or nearer to it than `reach` px: (N,) bool.

    facts : the mask, thinned after Zhang and Suen.
    """
    return facts.middle_pixels(np.ascontiguousarray(pixels), max(reach, 1.0))


def occluding_edge_pixels(foreground: Foreground, min_step: float, radius: float) -> Bools:
    """Find the pixels of a mask at which a strand disappears beneath a nearer one, by the step in depth there.

    A pixel is marked if the nearest surface within about half a radius of it is nearer to the camera than the pixel itself, by
    more than the sum of `min_step`, three standard deviations of the depth noise, and the change of depth on either side of the
    step. That change is not counted as a step, since a strand that runs away from the camera slopes all along; on the nearer side
    it is continued in inverse depth, in which a straight strand has one slope.

    Parameters
    ----------
    foreground
        the object's points in the camera's optical frame, with mask and pixels.
    min_step
        m, least step in depth.
    radius
        px, radius of the object.

    Returns
    -------
    (H, W) bool in the size of the mask, True for the marked pixels; all False without points, shape (0, 0) without a mask.
    """
    if foreground.mask is None:
        return np.zeros((0, 0), dtype=bool)
    at_edge = np.zeros(foreground.mask.shape, dtype=bool)
    if foreground.pixels is None or not len(foreground.pixels):
        return at_edge
    box = facts_of(foreground).slices
    u, v = foreground.pixels[:, 0] - box[1].start, foreground.pixels[:, 1] - box[0].start
    filtered = foreground.points if foreground.filtered is None else foreground.filtered
    depth = np.full(foreground.mask[box].shape, np.inf, dtype=np.float32)
    depth[v, u] = filtered[:, 2]
    window = max(1, math.ceil(radius / 2))
    own = depth[v, u]
    nearest = _local_minimum(depth, window)[v, u]
    nearest_wide = _local_minimum(depth, 2 * window)[v, u]
    farthest = -_local_minimum(np.where(np.isfinite(depth), -depth, depth), window)[v, u]
    noise = MAD_TO_DEVIATION * float(np.median(np.abs(foreground.points[:, 2] - filtered[:, 2])))
    beyond = 1 / np.maximum(2 / nearest - 1 / nearest_wide, 1 / own)
    slope = np.maximum(farthest - own, beyond - nearest)
    at_edge[foreground.pixels[:, 1], foreground.pixels[:, 0]] = own - nearest > min_step + DEVIATIONS * noise + slope
    return at_edge


def _local_minimum(values: Array, window: int) -> Array:
    """Return the least of the values (H, W) float32 within `window` px of each pixel."""
    return np.asarray(cv2.erode(values, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * window + 1, 2 * window + 1))))


def _points_to_voxelize(foreground: Foreground, config: VoxelizeConfig, radius: float, radius_px: float) -> Floats:
    """Return the filtered points (K, 3) m, where there is a mask only those in the core of a strand, and those that join them.

    Where strands run side by side, only the pixels in the middle of each are used.
    """
    points = foreground.points if foreground.filtered is None else foreground.filtered
    mask, pixels = foreground.mask, foreground.pixels
    if not config.core_fraction or pixels is None or mask is None:
        return points if foreground.bridges is None else np.concatenate((points, foreground.bridges))
    facts = facts_of(foreground)
    if config.split_at_depth_step:
        facts = FrameFacts(mask & ~occluding_edge_pixels(foreground, config.split_at_depth_step * radius, radius_px))
    window = max(1, math.ceil(radius_px))
    in_core = facts.core_pixels(np.ascontiguousarray(pixels), window, config.core_fraction, config.core_margin_px)
    if foreground.side_by_side is not None:
        beside = foreground.side_by_side[pixels[:, 1], pixels[:, 0]]
        in_core = np.where(beside, middle_pixels(facts, pixels, STEP_RADII / 2 * radius_px), in_core)
    return points[in_core]


def _closed_grid(points: Floats, size: float, radius: float, foreground: Foreground, min_voxels: int) -> VoxelGrid:
    """Return the voxels that points (N, D) occupy, and those that closing adds, without components of less than `min_voxels`."""
    margin = CLOSING_ITERATIONS + 1
    origin = (np.floor(extent(points)[0] / size) - margin) * size
    shape, total = box_shape(points, origin, size, margin)
    _check_size(total, KEY_LIMIT, size)
    of_point = cell_keys(points, origin, size, shape)
    occupied = distinct(of_point)
    _check_size(len(occupied), MAX_CELLS, size)
    keys = close_cells(occupied, shape, CLOSING_ITERATIONS)
    if foreground.cloud_facts is not None and foreground.cloud_facts.strands_nearer(MAX_CLOSED_GAP * size):
        strand = foreground.cloud_facts.strand_of(points)
        parts = (np.unique(of_point[strand == k]) for k in range(int(strand.max()) + 1))
        keys = np.unique(np.concatenate([close_cells(part, shape, CLOSING_ITERATIONS) for part in parts]))
    _check_size(len(keys), MAX_CELLS, size)
    coords, table = cell_coords(keys, shape), neighbors_of(cell_coords(keys, shape))
    centroids, counts = _means_in_voxels(points, np.searchsorted(keys, of_point), table, origin + (coords + 0.5) * size)
    label = connected_parts(table)
    kept = np.bincount(label)[label] >= min_voxels
    row = np.append(np.where(kept, np.cumsum(kept) - 1, -1), -1).astype(np.int32)  # the last entry is that of no neighbor
    return VoxelGrid(coords[kept], centroids[kept], counts[kept], size, origin, radius, row[table[kept]])


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
    return VoxelGrid(zero.astype(np.int64), zero, np.zeros(0, dtype=np.int64), 1.0, np.zeros(dim), 1.0)


def _pixel_grid(foreground: Foreground, config: VoxelizeConfig) -> VoxelGrid:
    """Return the mask of an image as a grid: the points (N, 2) are all of its pixels, in lexicographic order."""
    pixels = foreground.points.astype(np.int64) if foreground.pixels is None else foreground.pixels
    if len(pixels) > MAX_CELLS:
        raise InputError(
            f"the mask has {len(pixels)} pixels, the limit is {MAX_CELLS}: scale the image down", code="voxels-too-many"
        )
    radius = config.radius or max(facts_of(foreground).radius(), MIN_MASK_RADIUS_PX)
    origin = np.array([pixels[0, 0], pixels[:, 1].min()]) - 1
    return VoxelGrid(pixels - origin, foreground.points, np.ones(len(pixels), dtype=np.int64), 1.0, origin - 0.5, radius)


def _check_size(count: float, limit: float, size: float) -> None:
    if count > limit:
        raise InputError(
            f"the grid would hold {count:.4g} voxels of {size:.3g} m, the limit is {limit:.4g}: "
            "set a larger voxelize.size, or segment more narrowly",
            code="voxels-too-many",
        )
