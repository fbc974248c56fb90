"""Voxel sets with holes, tunnels and pieces, and what can be counted in them by brute force."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter
from skimage.measure import euler_number, label

from doo3d.types import Array, Bools, Floats, Ints


def coords_of(solid: Bools) -> Ints:
    """The voxels of a (X, Y, Z) bool array as the kernels take them: from 1 up, in lexicographic order."""
    return np.argwhere(solid).astype(np.int64) + 1


def solid_of(coords: Ints, shape: tuple[int, ...]) -> Bools:
    """The other way round."""
    solid = np.zeros(shape, dtype=bool)
    solid[tuple(coords.T - 1)] = True
    return solid


def topology(solid: Bools) -> tuple[int, int, int]:
    """Number of 26-connected pieces, of independent loops, and of cavities (6-connected background inside)."""
    padded = np.pad(solid, 1)
    pieces = int(label(padded, connectivity=3).max())
    cavities = int(label(~padded, connectivity=1).max()) - 1
    return pieces, pieces + cavities - int(euler_number(padded, connectivity=3)), cavities


def blob(seed: int, size: int = 16, share: float = 0.4, blur: float = 1.0) -> Bools:
    """Smooth random noise above a threshold: pieces, tunnels and cavities."""
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(size, size, size)), blur, mode="wrap")
    return np.asarray(noise > np.quantile(noise, 1 - share))


def swept(curve: Floats, radius: float, shape: tuple[int, int, int]) -> Bools:
    """The voxels whose centres lie within `radius` voxels of a curve (P, 3), in voxels."""
    grid = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    distance = np.min([np.linalg.norm(grid - part, axis=2).min(axis=1) for part in np.array_split(curve, 8)], axis=0)
    return np.asarray((distance <= radius).reshape(shape))


def ring(middle: Array, radius: float, normal: int = 2) -> Floats:
    """A circle square to an axis, in voxels."""
    t = np.linspace(0, 2 * np.pi, 120)
    return np.asarray(middle + radius * np.insert(np.column_stack((np.cos(t), np.sin(t))), normal, 0, axis=1))


def trefoil(middle: Array, scale: float) -> Floats:
    """A closed knot, in voxels."""
    t = np.linspace(0, 2 * np.pi, 300)
    loops = (np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t))
    return np.asarray(middle + scale * np.column_stack(loops))
