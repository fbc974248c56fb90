"""Morphological closing of a sparse grid."""

from __future__ import annotations

import math

import numpy as np

from .. import kernels
from ..types import Ints


def close_cells(keys: Ints, shape: tuple[int, ...], iterations: int) -> Ints:
    """Close holes in a sparse grid of cells: morphological closing with a cube of 2 iterations + 1 cells.

    The cells lie in a box; a cell's key is its row-major index in that box (np.ravel_multi_index).

    Parameters
    ----------
    keys
        (M,) int64 ascending, keys of the M occupied cells.
    shape
        (D,) number of cells of the box along each axis. More than `iterations` layers of cells at every face of the box must be
        empty.
    iterations
        number of dilations along each axis, followed by as many erosions; 0 returns the keys as they are.

    Returns
    -------
    (K,) int64 ascending, keys of the K >= M occupied cells after closing; the given keys are among them.
    """
    strides = np.array([math.prod(shape[d + 1 :]) for d in range(len(shape))], dtype=np.int64)
    return kernels.close_cells(keys, strides, iterations)
