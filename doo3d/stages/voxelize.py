"""Points to a sparse voxel grid, holes closed."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ..config import VoxelizeConfig
from ..errors import InputError
from ..geometry.closing import close_cells
from ..geometry.mask import bounding_box, mask_radius
from ..geometry.radius import estimate_radius, point_spacing
from ..geometry.sparse_grid import KEY_LIMIT, unpack_keys, voxelize_points
from ..kernels.skeleton_graph import connected_components
from ..kernels.thinning import neighbor_table
from ..types import Array, Bools, Floats, Foreground, Ints, VoxelGrid

LEAST = 3
"""Voxels of the smallest piece when they are coarse: along a thin object there is one behind the other."""

DEVIATION, SURE = 1.4826, 3.0  # standard deviations per median absolute deviation; so many of them are no noise


SIZE_OVER_RADIUS = 0.5
"""Edge of a voxel in radii: finer keeps strands side by side apart, coarser bridges holes."""

SIZE_OVER_SPACING = 1.6
"""Least edge of a voxel in point spacings: finer grids of evenly spread points have holes that closing cannot mend."""

CLOSING_ITERATIONS = 1
"""Voxels by which holes are closed (dilate, then erode): one brings back a shell with a tenth of its voxels missing."""

MAX_VOXELS = 2_000_000
"""Occupied voxels (pixels in 2-D) at most, for memory: thinning takes about 150 bytes each."""

MIN_COMPONENT = 12
"""Voxels of half a radius; smaller 26-connected pieces are removed."""


def voxelize(foreground: Foreground, config: VoxelizeConfig) -> VoxelGrid:
    """The occupied voxels with the centroids of their points; pieces of fewer than `min_component` voxels dropped.

    A point is taken to be at its filtered place, where there is one.

    Raises
    ------
    InputError : the grid would hold more than `max_voxels`.
    """
    points = foreground.points
    if points.shape[1] == 2 and foreground.mask is not None:
        return _pixels(foreground.mask, foreground, config)
    if not len(points):
        zero = np.zeros((0, points.shape[1]))
        return VoxelGrid(zero.astype(np.int64), zero, np.zeros(0, dtype=np.int64), 1.0, np.zeros(points.shape[1]), 1.0)
    apart = point_spacing(foreground)
    radius = config.radius or estimate_radius(foreground, apart)
    size = config.size or max(SIZE_OVER_RADIUS * radius, SIZE_OVER_SPACING * apart)
    margin = CLOSING_ITERATIONS + 1
    if foreground.filtered is not None:
        points = foreground.filtered
    if config.core_fraction and foreground.pixels is not None and foreground.mask is not None:
        mask = (
            foreground.mask & ~behind(foreground, config.split_at_depth_step * radius, radius / apart)
            if config.split_at_depth_step
            else foreground.mask
        )
        points = points[in_core(mask, foreground.pixels, config.core_fraction, radius / apart, config.core_margin_px)]
    origin = (np.floor(points.min(axis=0) / size) - margin) * size
    cells = voxelize_points(points, origin, size, margin)
    if isinstance(cells, float):
        raise InputError(_too_large(cells, KEY_LIMIT, size), code="voxels-too-many")
    if len(cells.keys) > MAX_VOXELS:
        raise InputError(_too_large(len(cells.keys), MAX_VOXELS, size), code="voxels-too-many")
    grid = close_cells(cells.keys, cells.shape, CLOSING_ITERATIONS)
    at = np.searchsorted(grid, cells.keys)
    coords = unpack_keys(grid, cells.shape)
    counts = np.zeros(len(grid), dtype=np.int64)
    counts[at] = np.bincount(cells.cell)
    centroids = origin + (coords + 0.5) * size
    centroids[at] = cells.sums(points) / counts[at, None]
    coarser = min(1.0, SIZE_OVER_RADIUS * radius / size)
    least = min(MIN_COMPONENT, max(LEAST, math.ceil(MIN_COMPONENT * coarser**2)))
    return _finish(coords, centroids, counts, size, origin, radius, least)


def in_core(mask: Bools, pixels: Ints, share: float, radius: float, rim: float = math.inf) -> Bools:
    """Which of the pixels (N, 2) of the mask lie in the middle of their strand: (N,) bool.

    In the middle is what is at least `share` as far from the edge of the mask as the farthest pixel within about `radius`
    px, or less than `rim` px nearer. Strands that lie side by side have background between them, if only a pixel of it:
    their middles are apart by far more.
    """
    box = bounding_box(mask)
    inside = cv2.distanceTransform(np.pad(mask[box], 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    side = 2 * max(1, math.ceil(radius)) + 1
    most = cv2.dilate(inside, np.ones((side, side), np.uint8))
    v, u = pixels[:, 1] - box[0].start, pixels[:, 0] - box[1].start
    here = (v >= 0) & (v < len(inside)) & (u >= 0) & (u < inside.shape[1])
    found = np.zeros(len(pixels), dtype=bool)
    own, highest = inside[v[here], u[here]], most[v[here], u[here]]
    found[here] = (own > 0) & (own >= np.minimum(share * highest, highest - rim))
    return found


def behind(foreground: Foreground, step: float, radius: float) -> Bools:
    """The pixels of the mask behind which a strand goes on beneath another one: (H, W) bool.

    There the surface falls off, from within half of the object's `radius` px, by `step` m more than it goes on falling on
    either side, and by more than noise: what runs away from the camera falls off all along.
    """
    shown = np.zeros(foreground.mask.shape, dtype=bool) if foreground.mask is not None else np.zeros((0, 0), dtype=bool)
    if foreground.pixels is None or foreground.mask is None or not len(foreground.pixels):
        return shown
    box = bounding_box(foreground.mask)
    u, v = foreground.pixels[:, 0] - box[1].start, foreground.pixels[:, 1] - box[0].start
    filtered = foreground.points if foreground.filtered is None else foreground.filtered
    z = np.full(foreground.mask[box].shape, np.inf, dtype=np.float32)
    z[v, u] = filtered[:, 2]
    held = np.isfinite(z)
    half = max(1, math.ceil(radius / 2))
    near, nearer, far = (
        _least(values, reach)[v, u] for values, reach in ((z, half), (z, 2 * half), (np.where(held, -z, z), half))
    )
    noise = DEVIATION * float(np.median(np.abs(foreground.points[:, 2] - filtered[:, 2])))
    own = z[v, u]
    goes_on = np.maximum(-far - own, near - nearer)
    shown[foreground.pixels[:, 1], foreground.pixels[:, 0]] = own - near > step + SURE * noise + goes_on
    return shown


def _least(values: Array, reach: int) -> Array:
    """The least of the values (H, W) float32 within `reach` px of each pixel."""
    return np.asarray(cv2.erode(values, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))))


def _pixels(mask: Bools, foreground: Foreground, config: VoxelizeConfig) -> VoxelGrid:
    """In 2-D the mask is the grid: the points (N, 2) are all of its pixels, in lexicographic order."""
    pixels = foreground.points.astype(np.int64) if foreground.pixels is None else foreground.pixels
    if not len(pixels):
        return VoxelGrid(pixels, pixels.astype(float), pixels[:, 0], 1.0, np.zeros(2), 1.0)
    if len(pixels) > MAX_VOXELS:
        raise InputError(
            f"the mask has {len(pixels)} pixels, the limit is {MAX_VOXELS}: scale the image down", code="voxels-too-many"
        )
    radius = config.radius or max(mask_radius(mask), 0.5)
    origin = np.array([pixels[0, 0], pixels[:, 1].min()]) - 1
    return VoxelGrid(pixels - origin, foreground.points, np.ones(len(pixels), dtype=np.int64), 1.0, origin - 0.5, radius)


def _too_large(count: float, limit: float, size: float) -> str:
    return (
        f"the grid would hold {count:.4g} voxels of {size:.3g} m, the limit is {limit:.4g}: "
        "set a larger voxelize.size, or segment more narrowly"
    )


def _finish(coords: Ints, centroids: Floats, counts: Ints, size: float, origin: Floats, radius: float, least: int) -> VoxelGrid:
    """Drop small pieces, and give the voxels that closing added the mean centroid of their neighbours that hold points."""
    table = neighbor_table(_solid(coords))
    label = connected_components(table)
    keep = np.bincount(label)[label] >= least
    added = np.flatnonzero((counts == 0) & keep)
    near = table[added]
    holds = (near >= 0) & (counts[near] > 0)
    weight = holds.sum(axis=1)
    mean = (centroids[near] * holds[:, :, None]).sum(axis=1)[weight > 0] / weight[weight > 0, None]
    centroids[added[weight > 0]] = mean
    return VoxelGrid(coords[keep], centroids[keep], counts[keep], size, origin, radius)


def _solid(coords: Ints) -> Ints:
    """(M, D) -> (M, 3): a third coordinate of 1 where there are two."""
    return coords if coords.shape[1] == 3 else np.column_stack((coords, np.ones(len(coords), dtype=np.int64)))
