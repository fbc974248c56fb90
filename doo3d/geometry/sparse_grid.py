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
    """The M occupied cells of a sparse grid, and the cell of each of N points.

    Attributes
    ----------
    keys
        (M,) int64 ascending, row-major index of each occupied cell in the box.
    shape
        (D,) number of cells of the box along each axis.
    cell
        (N,) int, index of each point's cell in `keys`.
    """

    keys: Ints
    shape: tuple[int, ...]
    cell: Ints

    @property
    def coords(self) -> Ints:
        """The index of each occupied cell along each axis of the box: (M, D) int64, in lexicographic order."""
        return unpack_keys(self.keys, self.shape)

    def sums(self, values: Floats) -> Floats:
        """Return the sum over the points in each cell of their values: (N, C) for the points -> (M, C) for the cells."""
        return np.column_stack([np.bincount(self.cell, weights=column, minlength=len(self.keys)) for column in values.T])


def voxelize_points(points: Floats, origin: Floats, size: float, margin: int) -> Cells | float:
    """Sort points into the cells of a sparse grid.

    Parameters
    ----------
    points
        (N, D), in any unit.
    origin
        (D,), lower corner of the box in that unit; no point is below it.
    size
        edge of a cell, in that unit.
    margin
        number of empty cells kept beyond the last point along each axis.

    Returns
    -------
    The occupied cells; or, if the box has too many cells for 64-bit keys, their number as a float.
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
    """Return the index along each axis, (M, D) int64, of cells in a box of a given shape.

    Parameters
    ----------
    keys
        (M,) int64, row-major index of each cell.
    shape
        (D,) number of cells of the box along each axis.
    """
    return np.column_stack(np.unravel_index(keys, shape)).astype(np.int64)


def sorted_unique(keys: Ints) -> Ints:
    """Return the distinct keys (M,) in ascending order.

    It is np.unique by sorting: np.unique hashes integers, which is slower for keys that are nearly sorted.
    """
    keys = np.sort(keys)
    return keys[np.concatenate(([True], keys[1:] != keys[:-1]))] if len(keys) else keys


def contains(keys: Ints, wanted: Ints) -> Bools:
    """Tell which of the wanted keys (Q,) are among the given keys: (Q,) bool.

    Parameters
    ----------
    keys
        (M,) ascending, at least one.
    wanted
        (Q,) in any order.
    """
    at = np.searchsorted(keys, wanted)
    at[at == len(keys)] = 0
    return np.asarray(keys[at] == wanted)


def cloud_spacing(points: Floats) -> float:
    """Return the typical distance between neighboring points (N, 3) of a surface, in m, at least 1e-6.

    It follows from the radius of the disc that holds a point's eight nearest neighbors. A single point gives 1 mm.
    """
    sample = points[:: max(1, len(points) // SAMPLE_POINTS)]
    nearest = min(8, len(sample) - 1)
    if nearest < 1:
        return 1e-3
    distance = cKDTree(sample).query(sample[:: max(1, len(sample) // SAMPLE_SEEDS)], k=[nearest + 1])[0][:, 0]
    spacing = float(np.median(distance)) * math.sqrt(math.pi / nearest) * math.sqrt(len(sample) / len(points))
    return max(spacing, 1e-6)
