"""Sums per voxel."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.fusion.voxel_sums import VoxelSums


def test_the_middles_of_voxels_lie_in_them():
    points = np.random.default_rng(0).uniform(-3, 3, (500, 3))
    voxels = VoxelSums(0.01)
    voxels.add_frame(points, np.ones((500, 1)))
    np.testing.assert_array_equal(voxels.keys_of(voxels.centers()), voxels.keys)
    middle = voxels.centers()[np.searchsorted(voxels.keys, voxels.keys_of(points))]
    assert np.abs(points - middle).max() <= 0.005 + 1e-12


@pytest.mark.parametrize("depth", np.linspace(0.4, 1.2, 9))
def test_a_voxel_whose_points_lie_on_its_border_is_in_the_coarse_one_of_its_middle(depth):
    """The mean of points on a border may lie beyond it, by rounding."""
    u, v = np.meshgrid(np.arange(-40, 41), np.arange(-3, 4))
    points = np.column_stack((u.ravel() * depth / 600, v.ravel() * depth / 600, np.full(u.size, depth)))
    fine, coarse = VoxelSums(depth / 600), VoxelSums(4 * depth / 600)
    for _ in range(3):
        fine.add_frame(points, points)
        coarse.add_frame(points, points)
    assert np.isin(coarse.keys_of(fine.centers()), coarse.keys).all()
