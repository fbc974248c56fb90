"""Positions compared with a depth image, against a plain computation in NumPy."""

import numpy as np
import pytest

from doo3d.kernels import classify_positions

OUTSIDE, NO_DEPTH, MASKED, SURFACE, HIDDEN, FREE = range(6)
CAMERA = np.array((60.0, 65.0, 29.5, 19.5))


def slow_classes(points, depth, mask, margin, own_counts):
    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    u, v = CAMERA[0] * points[:, 0] / z + CAMERA[2], CAMERA[1] * points[:, 1] / z + CAMERA[3]
    inside = (u > -0.5) & (v > -0.5) & (u < mask.shape[1] - 0.5) & (v < mask.shape[0] - 0.5)
    u, v = np.rint(np.where(inside, (u, v), 0)).astype(int)
    reading, masked = depth[v, u], mask[v, u]
    classes = np.where(masked, SURFACE, HIDDEN)
    classes[reading < z - margin] = HIDDEN
    classes[(reading > z + margin) & (own_counts | ~masked)] = FREE
    classes[reading <= 0] = np.where(masked, MASKED, NO_DEPTH)[reading <= 0]
    behind = np.flatnonzero(inside & (classes == HIDDEN) & ~masked & (reading >= z - margin))
    return np.where(inside, classes, OUTSIDE), behind, np.column_stack((u, v))[behind], reading[behind]


@pytest.mark.parametrize("own_counts", [True, False])
def test_classes_are_those_of_a_plain_computation(own_counts):
    rng = np.random.default_rng(0)
    points = rng.normal(0, 0.3, (5000, 3)) + np.array((0, 0, 0.6))
    points[7] = np.nan
    points[8, 0] = np.inf
    depth = np.where(rng.random((40, 60)) < 0.8, rng.normal(0.6, 0.1, (40, 60)), 0).astype(np.float32)
    mask = rng.random((40, 60)) < 0.4
    found = classify_positions(points, CAMERA, depth, mask, 0.05, own_counts, np.arange(6))
    for values, expected in zip(found, slow_classes(points, depth, mask, 0.05, own_counts), strict=True):
        np.testing.assert_array_equal(values, expected)
    assert set(found[0].tolist()) == set(range(6))
