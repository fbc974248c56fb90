"""Points in the cells of a sparse grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels import sort_into_cells
from ..types import Floats, Ints

KEY_LIMIT = 2**62
"""Keys are 64-bit; the box must have fewer cells than this."""


@dataclass(frozen=True)
class Cells:
    """The M occupied cells of a sparse grid, and the cell of each of N points.

    The grid is a box of cells, as `voxelize_points` lays it around the points; only the cells that hold points are stored. The
    key of a cell is its row-major index in the box (np.ravel_multi_index).

    Attributes
    ----------
    keys
        (M,) int64 ascending, key of each occupied cell.
    shape
        (D,) number of cells of the box along each axis.
    cell
        (N,) int, index in `keys` of the cell that each point lies in.
    """

    keys: Ints
    shape: tuple[int, ...]
    cell: Ints

    def sums(self, values: Floats) -> Floats:
        """Return the sums of the points' values in each cell.

        values : (N, C), C values for each point, in the order of the points. Returns (M, C), one row per cell, in the order of
        `keys`.
        """
        return np.column_stack([np.bincount(self.cell, weights=column, minlength=len(self.keys)) for column in values.T])


def voxelize_points(points: Floats, origin: Floats, size: float, margin: int) -> Cells | float:
    """Sort points into the cells of a sparse grid.

    The grid is a box of cells from `origin` to `margin` cells beyond the last point along each axis.

    Parameters
    ----------
    points
        (N, D), N >= 1 points, in any unit.
    origin
        (D,), lower corner of the box, in the unit of the points; no point is below it along any axis.
    size
        edge of a cell, in the unit of the points.
    margin
        number of empty cells beyond the last point along each axis.

    Returns
    -------
    The occupied cells; or, if the box has too many cells for 64-bit keys, the number of its cells as a float.
    """
    keys, shape, cell, total = sort_into_cells(np.ascontiguousarray(points), np.asarray(origin, float), size, margin, KEY_LIMIT)
    return Cells(keys, tuple(shape.tolist()), cell) if total <= KEY_LIMIT else total


def unpack_keys(keys: Ints, shape: tuple[int, ...]) -> Ints:
    """Return the index along each axis of cells given by their keys.

    Parameters
    ----------
    keys
        (M,) int64, row-major index of each of M cells in a box.
    shape
        (D,) number of cells of the box along each axis.

    Returns
    -------
    (M, D) int64, in the order of the keys.
    """
    return np.column_stack(np.unravel_index(keys, shape)).astype(np.int64)


def sorted_unique(keys: Ints) -> Ints:
    """Return the distinct values of an integer array in ascending order.

    keys : (M,), in any order. Returns (K,), K <= M.

    The same as np.unique, but faster for keys that are nearly sorted, since it sorts while np.unique hashes.
    """
    keys = np.sort(keys)
    return keys[np.concatenate(([True], keys[1:] != keys[:-1]))] if len(keys) else keys
