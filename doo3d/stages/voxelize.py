"""Points to a sparse voxel grid, holes closed."""

from __future__ import annotations

import math

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ..config import VoxelizeConfig
from ..errors import InputError
from ..kernels.thinning import neighbours
from ..kernels.tracing import components
from ..silhouette import bounding_box, ridge_radius
from ..types import Array, Bools, Camera, Floats, Foreground, Ints, VoxelGrid

KEY_LIMIT = 2**62
"""Voxel keys are 64-bit; the box must have fewer voxels than this."""


def voxelize(foreground: Foreground, config: VoxelizeConfig) -> VoxelGrid:
    """The occupied voxels with the centroids of their points; pieces of fewer than `min_component` voxels dropped.

    A point is in the voxel of its steady place, where there is one, and counts in the centroid as measured.

    Raises
    ------
    InputError : the grid would hold more than `max_voxels`.
    """
    points = foreground.points
    if not len(points):
        zero = np.zeros((0, points.shape[1]))
        return VoxelGrid(zero.astype(np.int64), zero, np.zeros(0, dtype=np.int64), 1.0, np.zeros(points.shape[1]), 1.0)
    spacing = point_spacing(foreground)
    radius = config.radius or seen_radius(foreground, spacing)
    size = config.size or max(config.size_over_radius * radius, config.size_over_spacing * spacing)
    margin = config.close + 1
    steady = points if foreground.steady is None else foreground.steady
    origin = (np.floor(steady.min(axis=0) / size) - margin) * size
    cells = np.floor((steady - origin) / size)
    shape = cells.max(axis=0) + margin + 2
    if math.prod(shape.tolist()) > KEY_LIMIT:
        raise InputError(_too_large(math.prod(shape.tolist()), KEY_LIMIT, size))
    cell = _keys(cells.astype(np.int64), shape)
    keys = _distinct(cell)
    if len(keys) > config.max_voxels:
        raise InputError(_too_large(len(keys), config.max_voxels, size))
    inverse = np.searchsorted(keys, cell)
    counts = np.bincount(inverse)
    sums = np.column_stack([np.bincount(inverse, weights=points[:, d]) for d in range(points.shape[1])])
    grid = close(keys, shape, config.close)
    at = np.searchsorted(grid, keys)
    coords = np.column_stack(np.unravel_index(grid, tuple(shape.astype(np.int64))))
    count = np.zeros(len(grid), dtype=np.int64)
    count[at] = counts
    centroids = origin + (coords + 0.5) * size
    centroids[at] = sums / counts[:, None]
    return _finish(coords, centroids, count, size, origin, radius, config.min_component)


def _too_large(count: float, limit: float, size: float) -> str:
    return (
        f"the grid would hold {count:.4g} voxels of {size:.3g} m, the limit is {limit:.4g}: "
        "set a larger voxelize.size, raise voxelize.max_voxels, or segment more narrowly"
    )


def _keys(cells: Ints, shape: Floats) -> Ints:
    return np.asarray(np.ravel_multi_index(tuple(cells.T), tuple(shape.astype(np.int64))), dtype=np.int64)


def _finish(coords: Ints, centroids: Floats, counts: Ints, size: float, origin: Floats, radius: float, least: int) -> VoxelGrid:
    """Drop small pieces, and give the voxels that closing added the mean centroid of their neighbours that hold points."""
    table = neighbours(_solid(coords))
    label = components(table)
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


def close(keys: Ints, shape: Floats, times: int) -> Ints:
    """Morphological closing with a (2 times + 1)-cube on sorted keys of a box padded by more than `times`.

    The cube is separable: one axis after the other, dilations first.
    """
    strides = [int(math.prod(shape[d + 1 :].tolist())) for d in range(len(shape))]
    original = keys
    for stride in strides:
        for _ in range(times):
            keys = _distinct(np.concatenate((keys, keys - stride, keys + stride)))
    for stride in strides:
        for _ in range(times):
            keys = keys[_has(keys, keys - stride) & _has(keys, keys + stride)]
    return _distinct(np.concatenate((keys, original))) if times else original


def _distinct(keys: Ints) -> Ints:
    """The different keys, ascending. (np.unique hashes integers, which is slower than sorting nearly sorted ones.)"""
    keys = np.sort(keys)
    return keys[np.concatenate(([True], keys[1:] != keys[:-1]))]


def _has(keys: Ints, wanted: Ints) -> Bools:
    at = np.searchsorted(keys, wanted)
    at[at == len(keys)] = 0
    return np.asarray(keys[at] == wanted)


def point_spacing(foreground: Foreground) -> float:
    """Typical distance between neighbouring surface points, m: the pixel's footprint, or for a cloud from its density."""
    points = foreground.points
    if foreground.camera is not None:
        return float(np.median(points[:, 2])) / foreground.camera.fx
    sample = points[:: max(1, len(points) // 20_000)]
    nearest = min(8, len(sample) - 1)
    if nearest < 1:
        return 1e-3
    distance = cKDTree(sample).query(sample[:: max(1, len(sample) // 500)], k=[nearest + 1])[0][:, 0]
    # nearest points in a disc of that distance on a surface
    spacing = float(np.median(distance)) * math.sqrt(math.pi / nearest) * math.sqrt(len(sample) / len(points))
    return max(spacing, 1e-6)


def seen_radius(foreground: Foreground, spacing: float) -> float:
    """The object's radius before there is a chain, m: the median half-width of the mask, or of a cloud's strips."""
    if foreground.mask is not None and foreground.camera is not None and foreground.depth is not None:
        return max(_mask_radius(foreground.mask, foreground.depth, foreground.camera), spacing)
    return max(_cloud_radius(foreground.points, spacing), spacing)


def _mask_radius(mask: Bools, depth: Array, camera: Camera) -> float:
    """Median over the ridge of the mask's distance transform, times depth over focal length."""
    box = bounding_box(mask)
    inside = cv2.distanceTransform(np.pad(mask[box], 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    return ridge_radius(inside, depth[box] / camera.fx)


def _cloud_radius(points: Floats, spacing: float) -> float:
    """Median half-width of the cloud where it looks like a strip.

    Round each of some seeds the neighbourhood grows until it is three times as long as it is wide. The variance
    across is then r^2 / 3 for the half shell that one camera sees (uniform over the projected width) and r^2 / 2
    for a whole tube, told apart by the variance in depth.
    """
    sample = points[:: max(1, len(points) // 20_000)]
    tree = cKDTree(sample)
    open_seeds = sample[:: max(1, len(sample) // 150)]
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    found: list[float] = []
    reach = 3 * spacing * math.sqrt(len(points) / len(sample))
    while len(open_seeds) and reach < extent:
        again = []
        for seed, index in zip(open_seeds, tree.query_ball_point(open_seeds, reach), strict=True):
            values = np.linalg.eigvalsh(np.cov(sample[index].T)) if len(index) > 8 else np.array([0.0, 1.0, 1.0])
            if values[1] < values[2] / 9:
                found.append(math.sqrt(max(0.0, values[1] * (3 - min(1.0, values[0] / values[1])))) if values[1] > 0 else 0.0)
            else:
                again.append(seed)
        open_seeds = np.array(again)
        reach *= 1.3
    return float(np.median(found)) if found else extent / 6
