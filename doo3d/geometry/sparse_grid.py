"""Points in the cells of a sparse grid, and the spacing of surface points."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..types import Bools, Floats, Ints

SAMPLE_POINTS, SAMPLE_SEEDS = 8000, 80
"""Points of a cloud, and seeds among them, on which its density is measured."""

KEY_LIMIT = 2**62
"""Keys are 64-bit; the box must have fewer cells than this."""


@dataclass(frozen=True)
class Cells:
    """Occupied cells of a box: keys (M,) int64 ascending, shape (D,) of the box, cell (N,) index of each point's cell."""

    keys: Ints
    shape: tuple[int, ...]
    cell: Ints

    @property
    def coords(self) -> Ints:
        """The coordinates of each cell in the box, (M, D) int64, in lexicographic order."""
        return unpack_keys(self.keys, self.shape)

    def sums(self, values: Floats) -> Floats:
        """Return the sums (M, C) of the points' values (N, C) in each cell."""
        return np.column_stack([np.bincount(self.cell, weights=column, minlength=len(self.keys)) for column in values.T])


def voxelize_points(points: Floats, origin: Floats, size: float, margin: int) -> Cells | float:
    """Sort points into the cells of a sparse grid.

    Parameters
    ----------
    points
        (N, D)
    origin
        (D,) corner of the box, below all points
    size
        edge of a cell, in the unit of the points
    margin
        free cells beyond the last

    Returns
    -------
    The occupied cells, or the number of cells of the box if that is too large for 64-bit keys.
    """
    coords = np.floor((points - origin) / size)
    shape = coords.max(axis=0) + margin + 1
    total = math.prod(shape.tolist())
    if total > KEY_LIMIT:
        return float(total)
    box = tuple(int(side) for side in shape)
    cell = np.ravel_multi_index(tuple(coords.astype(np.int64).T), box).astype(np.int64)
    keys = sorted_unique(cell)
    return Cells(keys, box, np.searchsorted(keys, cell))


def unpack_keys(keys: Ints, shape: tuple[int, ...]) -> Ints:
    """Return the coordinates (M, D) of cells in a box from their keys (M,)."""
    return np.column_stack(np.unravel_index(keys, shape)).astype(np.int64)


def sorted_unique(keys: Ints) -> Ints:
    """Return the different keys, ascending. (np.unique hashes integers, which is slower than sorting nearly sorted ones.)"""
    keys = np.sort(keys)
    return keys[np.concatenate(([True], keys[1:] != keys[:-1]))] if len(keys) else keys


def contains(keys: Ints, wanted: Ints) -> Bools:
    """Return which of the wanted keys are among the ascending keys."""
    at = np.searchsorted(keys, wanted)
    at[at == len(keys)] = 0
    return np.asarray(keys[at] == wanted)


def cloud_spacing(points: Floats) -> float:
    """Return the typical distance between neighboring points (N, 3) of a surface in m, from their number in a disc."""
    sample = points[:: max(1, len(points) // SAMPLE_POINTS)]
    nearest = min(8, len(sample) - 1)
    if nearest < 1:
        return 1e-3
    distance = cKDTree(sample).query(sample[:: max(1, len(sample) // SAMPLE_SEEDS)], k=[nearest + 1])[0][:, 0]
    spacing = float(np.median(distance)) * math.sqrt(math.pi / nearest) * math.sqrt(len(sample) / len(points))
    return max(spacing, 1e-6)
