"""Planes fitted to points, and pixels raised from a plane, against NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from doo3d.kernels import fit_plane, raised_pixels


def slow_plane(points, corners, distance, refinements):
    """Return the normal and the offset of the plane that `fit_plane` fits."""
    a, b, c = (points[corners[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    size = np.linalg.norm(normals, axis=1)
    if not size.any():
        return np.array([0.0, 0.0, 1.0]), points[0, 2]
    normals, through = normals[size > 0] / size[size > 0, None], a[size > 0]
    offsets = (normals * through).sum(axis=1)
    best = np.argmax((np.abs(points @ normals.T - offsets) < distance).sum(axis=0))
    normal, offset, before = normals[best], offsets[best], np.zeros(len(points), dtype=bool)
    for _ in range(refinements):
        near = np.abs(points @ normal - offset) < 2 * distance
        if near.sum() < 3 or np.array_equal(near, before):
            break
        before, center = near, points[near].mean(axis=0)
        normal = np.linalg.eigh(np.cov(points[near].T))[1][:, 0]
        offset = normal @ center
    return normal, offset


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("refinements", [0, 1, 3])
def test_the_plane_with_the_most_points_near_it_is_fitted_to_them(seed, refinements):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(500, 3))
    points[:300, 2] = 0.3 * points[:300, 0] - 0.2 * points[:300, 1] + 0.01 * rng.normal(size=300)
    corners = rng.integers(0, 500, (40, 3))
    corners[0] = 7
    normal, offset = fit_plane(points, corners, 0.03, refinements)
    expected, height = slow_plane(points, corners, 0.03, refinements)
    sign = np.sign(normal @ expected)
    np.testing.assert_allclose(sign * normal, expected, atol=1e-9)
    assert sign * offset == pytest.approx(height, abs=1e-9)


def test_points_on_one_line_give_a_plane_across_the_line_of_sight():
    points = np.column_stack((np.arange(9.0), np.arange(9.0), np.full(9, 0.7)))
    normal, offset = fit_plane(points, np.random.default_rng(0).integers(0, 9, (20, 3)), 0.1, 3)
    assert normal.tolist() == [0, 0, 1]
    assert offset == 0.7


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
