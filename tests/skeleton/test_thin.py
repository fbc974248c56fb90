"""Thinning as a stage: voxels to skeleton points."""

from __future__ import annotations

import numpy as np
import pytest
from builders.blobs import component_of
from builders.drawn_masks import helix, surface
from builders.scenes import cloud_scene
from scipy.spatial import cKDTree

from doo3d.kernels import neighbor_table
from doo3d.skeleton.thin import thin
from doo3d.skeleton.voxelize import voxelize
from doo3d.types import VoxelGrid


def test_skeleton_of_a_helix():
    axis, radius = helix(), 0.005
    points = surface(axis, radius, np.zeros(3))
    grid = voxelize(cloud_scene(points, voxel=0.003, radius=radius))
    skeleton = thin(grid)
    assert component_of(neighbor_table(skeleton.coords)).max() == 0
    assert cKDTree(axis).query(skeleton.points)[0].max() < 1.3 * radius
    assert cKDTree(skeleton.points).query(axis)[0].max() < 2.5 * radius
    places = {tuple(voxel): centroid for voxel, centroid in zip(grid.coords.tolist(), grid.centroids, strict=True)}
    np.testing.assert_array_equal(skeleton.points, [places[tuple(voxel)] for voxel in skeleton.coords.tolist()])


@pytest.mark.parametrize("dim", [2, 3])
def test_empty_in_empty_out(dim):
    empty = np.zeros((0, dim))
    grid = VoxelGrid(empty.astype(np.int64), empty, np.zeros(0, np.int64), 1.0, np.zeros(dim))
    skeleton = thin(grid)
    assert skeleton.coords.shape == skeleton.points.shape == (0, dim)
