"""Voxel sets with holes, tunnels and components, and their topology by brute force."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skimage.measure import euler_number, label

from doo3d.types import Array, Bools, Floats, Ints


def coords_of(solid: Bools) -> Ints:
    """Return the voxels (M, 3) of a (X, Y, Z) bool array as the kernels take them: from 1 up, in lexicographic order."""
    return np.argwhere(solid).astype(np.int64) + 1


def component_of(table: Ints) -> Ints:
    """Return the number of the component of each of K voxels, (K,), from the indices of its neighbors (K, 26), -1 for none."""
    rows, columns = np.nonzero(table >= 0)
    graph = coo_array((np.ones(len(rows)), (rows, table[rows, columns])), shape=(len(table), len(table)))
    return np.asarray(connected_components(graph, directed=False)[1])


def solid_of(coords: Ints, shape: tuple[int, ...]) -> Bools:
    """Return the (X, Y, Z) bool array of voxels (M, 3), the inverse of `coords_of`."""
    solid = np.zeros(shape, dtype=bool)
    solid[tuple(coords.T - 1)] = True
    return solid


def topology(solid: Bools) -> tuple[int, int, int]:
    """Count the 26-connected components, the independent loops, and the cavities (6-connected background inside)."""
    padded = np.pad(solid, 1)
    components = int(label(padded, connectivity=3).max())
    cavities = int(label(~padded, connectivity=1).max()) - 1
    return components, components + cavities - int(euler_number(padded, connectivity=3)), cavities


def blob(seed: int, size: int = 16, share: float = 0.4, blur: float = 1.0) -> Bools:
    """Return smooth random noise above a threshold: components, tunnels and cavities."""
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(size, size, size)), blur, mode="wrap")
    return np.asarray(noise > np.quantile(noise, 1 - share))


def swept(curve: Floats, radius: float, shape: tuple[int, int, int]) -> Bools:
    """Return the voxels whose centres lie within `radius` voxels of a curve (P, 3), in voxels."""
    grid = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    distance = np.min([np.linalg.norm(grid - part, axis=2).min(axis=1) for part in np.array_split(curve, 8)], axis=0)
    return np.asarray((distance <= radius).reshape(shape))


def ring(center: Array, radius: float, normal: int = 2) -> Floats:
    """Return a circle (P, 3) square to an axis, in voxels."""
    t = np.linspace(0, 2 * np.pi, 120)
    return np.asarray(center + radius * np.insert(np.column_stack((np.cos(t), np.sin(t))), normal, 0, axis=1))


def trefoil(center: Array, scale: float) -> Floats:
    """Return a trefoil knot (P, 3), in voxels."""
    t = np.linspace(0, 2 * np.pi, 300)
    loops = (np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t))
    return np.asarray(center + scale * np.column_stack(loops))
