"""Points near planes, and pixels raised from a plane, against NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from doo3d.kernels import best_plane, raised_pixels


@pytest.mark.parametrize("seed", range(5))
def test_the_plane_with_the_most_points_near_it(seed):
    rng = np.random.default_rng(seed)
    points, normals, offsets = rng.normal(size=(500, 3)), rng.normal(size=(20, 3)), rng.normal(size=20)
    near = (np.abs(points @ normals.T - offsets) < 0.4).sum(axis=0)
    assert best_plane(points, normals, offsets, 0.4) == np.argmax(near)
    assert best_plane(np.vstack((points, points)), normals, offsets, 0.4) == np.argmax(near)


def test_of_planes_with_as_many_points_it_is_the_first():
    points = np.zeros((200, 3))
    assert best_plane(points, np.eye(3)[[0, 1, 2, 0]], np.array([1.0, 0.0, 0.0, 0.0]), 0.1) == 1
    assert best_plane(points, np.eye(3), np.ones(3), 0.1) == 0


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (17, 23)])
def test_components_with_a_seed_are_kept_whole(seed, shape):
    rng = np.random.default_rng(seed)
    along_v, along_u = (rng.uniform(0.4, 0.6, size).astype(np.float32) for size in shape)
    height = rng.random(shape)
    depth = ((2 - height) / (along_v[:, None] + along_u)).astype(np.float32)
    depth[rng.random(shape) < 0.1] = 0
    height[depth == 0] = 0
    label, count = ndimage.label(height > 0.6, np.ones((3, 3)))
    expected = np.isin(label, [i for i in range(1, count + 1) if (height[label == i] > 0.9).any()])
    found = raised_pixels(depth, along_u, along_v, 2.0, 0.6, 0.9)
    np.testing.assert_array_equal(found, expected)
    assert found.any()
    assert not found.all()


def test_not_a_number_is_raised_from_nothing():
    depth = np.array([[1.0, np.nan, 1.3, 0.0]], np.float32)
    found = raised_pixels(depth, np.zeros(4, np.float32), np.ones(1, np.float32), 2.0, 0.5, 0.9)
    np.testing.assert_array_equal(found, [[True, False, False, False]])


def test_thresholds_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match="low is above high"):
        raised_pixels(np.ones((1, 1), np.float32), np.zeros(1, np.float32), np.ones(1, np.float32), 2.0, 0.5, 0.4)
