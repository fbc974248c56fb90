"""Points and pixels of a pinhole camera, against NumPy."""

from __future__ import annotations

import numpy as np

from doo3d.kernels import project_pinhole, unproject_pinhole

CAMERA = (600.0, 610.0, 319.5, 239.5)


def test_points_are_projected_as_by_numpy():
    points = np.random.default_rng(0).normal(size=(200, 3))
    points[3, 2], points[4] = 0.0, (np.inf, 1.0, 2.0)
    fx, fy, cx, cy = CAMERA
    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    expected = np.column_stack((fx * points[:, 0] / z + cx, fy * points[:, 1] / z + cy))
    np.testing.assert_array_equal(project_pinhole(points, *CAMERA), expected)
    np.testing.assert_array_equal(project_pinhole(np.asfortranarray(points), *CAMERA), expected)
    assert project_pinhole(points[:0], *CAMERA).shape == (0, 2)


def test_pixels_with_depth_are_points_and_project_back():
    rng = np.random.default_rng(1)
    pixels, depth = rng.uniform(0, 640, (200, 2)), rng.uniform(0.2, 3, 200)
    fx, fy, cx, cy = CAMERA
    points = unproject_pinhole(pixels, depth, *CAMERA)
    expected = np.column_stack(((pixels[:, 0] - cx) * depth / fx, (pixels[:, 1] - cy) * depth / fy, depth))
    np.testing.assert_array_equal(points, expected)
    np.testing.assert_allclose(project_pinhole(points, *CAMERA), pixels, atol=1e-9)
