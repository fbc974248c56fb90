"""Morphological closing of a sparse grid."""

from __future__ import annotations

import math

import numpy as np

from ..types import Ints
from .sparse_grid import contains, sorted_unique


def close_cells(keys: Ints, shape: tuple[int, ...], iterations: int) -> Ints:
    """Return the cells of a sparse grid after a morphological closing with a cube of 2 iterations + 1 cells.

    The cube is separable: one axis after the other, dilations first.

    Parameters
    ----------
    keys
        (M,) int64 ascending
    shape
        (D,) of the box, which is padded by more than `iterations` cells
    iterations
        dilations, and then erosions, along each axis

    Returns
    -------
    (K,) int64 ascending keys, the given ones among them
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
