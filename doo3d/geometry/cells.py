"""Find the occupied cells of a sparse grid and their neighbors, and close them.

A cell of a box has a key, its row-major index. Letters: N points, M cells, D in {2, 3} axes.
"""

import math

import numpy as np

from ..kernels import neighbor_table
from ..types import Floats, Ints
from .limits import KEY_LIMIT

Shape = tuple[int, ...]


def box_shape(points: Floats, origin: Floats, size: float, margin: int) -> tuple[Shape, float]:
    """Return the number of cells of a box around points, along each axis and in all.

    Parameters
    ----------
    points
        (N, D), N >= 1, none below the origin.
    origin
        (D,), lower corner of the box, in the unit of the points.
    size
        edge of a cell.
    margin
        number of empty cells beyond the last point along each axis.

    Returns
    -------
    shape : D numbers; empty if the box has more cells than KEY_LIMIT.
    total : number of cells of the box.
    """
    sides = (np.floor((extent(points)[1] - origin) / size) + (margin + 1)).tolist()
    total = math.prod(sides)
    return (tuple(int(side) for side in sides) if total <= KEY_LIMIT else ()), total


def cell_keys(points: Floats, origin: Floats, size: float, shape: Shape) -> Ints:
    """Return the key of the cell of each of N points, (N,) int64.

    The arguments are as for `box_shape`.
    """
    return np.asarray(np.ravel_multi_index(tuple(((points - origin) / size).astype(np.int64).T), shape))


def cell_coords(keys: Ints, shape: Shape) -> Ints:
    """Return the indices along each axis of the cells with given keys, (M, D) int64."""
    return np.column_stack(np.unravel_index(keys, shape))


def neighbors_of(coords: Ints) -> Ints:
    """Return the table (M, 26) int32 of the neighbors of cells (M, D).

    The order is lexicographic; in 2-D all cells are in one layer.
    """
    return neighbor_table(coords if coords.shape[1] == 3 else np.pad(coords, ((0, 0), (0, 1)), constant_values=1))


def close_cells(keys: Ints, shape: Shape, iterations: int) -> Ints:
    """Return the keys of the cells after morphological closing, ascending.

    The structuring element is a cube of 2 `iterations` + 1 cells.

    Parameters
    ----------
    keys
        (M,) int64, ascending, of the occupied cells; they stay occupied.
    shape
        cells of the box along each axis. More than `iterations` layers at each face are empty.
    iterations
        half of the size of the cube, in cells.
    """
    closed = keys
    strides = [math.prod(shape[axis + 1 :]) for axis in range(len(shape))] * iterations
    for stride in strides:
        closed = distinct(closed - stride, closed, closed + stride)
    for stride in strides:
        shifted = np.sort(np.concatenate((closed - stride, closed, closed + stride)), kind="stable")
        closed = shifted[2:][shifted[2:] == shifted[:-2]]
    return distinct(closed, keys)


def distinct(*keys: Ints) -> Ints:
    """Return the keys in any of some arrays, ascending and each once."""
    together = np.sort(np.concatenate(keys), kind="stable")  # merges ascending runs in linear time
    return np.asarray(together[np.append(np.ones(min(len(together), 1), dtype=bool), together[1:] != together[:-1])])


def extent(points: Floats) -> tuple[Floats, Floats]:
    """Return the smallest and the largest coordinates of N >= 1 points, (D,) each."""
    low, high = (np.array([of_all(axis) for axis in points.T]) for of_all in (np.min, np.max))
    return low, high
