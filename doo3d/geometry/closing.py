"""Morphological closing of a sparse grid."""

from __future__ import annotations

import math

import numpy as np

from ..types import Ints
from .sparse_grid import contains, sorted_unique


def close_cells(keys: Ints, shape: tuple[int, ...], iterations: int) -> Ints:
    """Close holes in a sparse grid: morphological closing with a cube of 2 iterations + 1 cells.

    The cube is separable: all axes are dilated one after the other, then eroded. A cell's key is its row-major index in the box.

    Parameters
    ----------
    keys
        (M,) int64 ascending, keys of the occupied cells.
    shape
        (D,) cells of the box along each axis; more than `iterations` cells at every face are empty.
    iterations
        number of dilations along each axis, followed by as many erosions; 0 returns the keys as they are.

    Returns
    -------
    (K,) int64 ascending, keys of the occupied cells after closing, K >= M: the given ones are among them.
    """
    strides = [math.prod(shape[d + 1 :]) for d in range(len(shape))]
    closed = keys
    for stride in strides:
        for _ in range(iterations):
            closed = sorted_unique(np.concatenate((closed, closed - stride, closed + stride)))
    for stride in strides:
        for _ in range(iterations):
            closed = closed[contains(closed, closed - stride) & contains(closed, closed + stride)]
    return sorted_unique(np.concatenate((closed, keys))) if iterations else keys
