"""Closing of a sparse grid against SciPy's of the full one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from doo3d.kernels import close_cells


@pytest.mark.parametrize("shape", [(14,), (9, 14), (9, 8, 10)])
@pytest.mark.parametrize("iterations", [0, 1, 2])
def test_closing(shape, iterations):
    margin = iterations + 1
    for seed in range(5):
        grid = np.pad(np.random.default_rng(seed).random(shape) < 0.25, margin)
        expected = grid
        if iterations:
            cube = np.ones((2 * iterations + 1,) * len(shape), bool)
            expected = ndimage.binary_erosion(ndimage.binary_dilation(grid, cube), cube) | grid
        strides = np.array([int(np.prod(grid.shape[d + 1 :])) for d in range(grid.ndim)])
        closed = close_cells(np.flatnonzero(grid), strides, iterations)
        assert closed.tolist() == np.flatnonzero(expected).tolist()
        assert closed.dtype == np.int64


def test_keys_that_are_not_ascending_are_refused():
    with pytest.raises(ValueError, match="ascending"):
        close_cells(np.array([4, 3]), np.array([1]), 1)
    with pytest.raises(ValueError, match="64 bits"):
        close_cells(np.array([4]), np.array([2**62]), 3)
