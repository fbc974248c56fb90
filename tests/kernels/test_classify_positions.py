"""Positions compared with a depth image, against a plain computation in NumPy."""

import numpy as np
import pytest

from doo3d.kernels import classify_positions

OUTSIDE, NO_DEPTH, MASKED, SURFACE, HIDDEN, FREE = range(6)
CAMERA = np.array((60.0, 65.0, 29.5, 19.5))


def slow_classes(points, depth, mask, margin, own_counts, noise):
    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    u, v = CAMERA[0] * points[:, 0] / z + CAMERA[2], CAMERA[1] * points[:, 1] / z + CAMERA[3]
    inside = (u > -0.5) & (v > -0.5) & (u < mask.shape[1] - 0.5) & (v < mask.shape[0] - 0.5)
    u, v = np.rint(np.where(inside, (u, v), 0)).astype(int)
    reading, masked = depth[v, u].astype(float), mask[v, u]
    classes = np.where(masked, SURFACE, HIDDEN)
    classes[reading < z - margin] = HIDDEN
    classes[(reading > z + margin) & (own_counts | ~masked)] = FREE
    classes[reading <= 0] = np.where(masked, MASKED, NO_DEPTH)[reading <= 0]
    with np.errstate(all="ignore"):
        beyond, before = (
            (1 / z - 1 / reading - margin / z / reading) / noise,
            (1 / reading - 1 / z - margin / z / reading) / noise,
        )
    never = np.full(len(points), -np.inf)
    free = np.where(masked & (not own_counts), never, beyond)
    seen = np.where(masked, -np.maximum(before, free), never)
    odds = np.column_stack((seen, np.where(masked, before, -beyond), free))
    odds[~inside | (reading <= 0)] = 0
    behind = np.flatnonzero(inside & (classes == HIDDEN) & ~masked & (reading >= z - margin))
    return np.where(inside, classes, OUTSIDE), odds, behind, np.column_stack((u, v))[behind], reading[behind]


@pytest.mark.parametrize("own_counts", [True, False])
def test_classes_are_those_of_a_plain_computation(own_counts):
    rng = np.random.default_rng(0)
    points = rng.normal(0, 0.3, (5000, 3)) + np.array((0, 0, 0.6))
    points[7] = np.nan
    points[8, 0] = np.inf
    depth = np.where(rng.random((40, 60)) < 0.8, rng.normal(0.6, 0.1, (40, 60)), 0).astype(np.float32)
    mask = rng.random((40, 60)) < 0.4
    found = classify_positions(points, CAMERA, depth, mask, 0.05, own_counts, 0.02)
    classes, odds, *rest = slow_classes(points, depth, mask, 0.05, own_counts, 0.02)
    np.testing.assert_array_equal(found[0], classes)
    np.testing.assert_allclose(found[1], odds, rtol=1e-9, atol=1e-9)
    for values, expected in zip(found[2:], rest, strict=True):
        np.testing.assert_array_equal(values, expected)
    assert set(classes.tolist()) == set(range(6))
    known = classes >= SURFACE
    assert (found[1][known].argmax(axis=1) == np.array((0, 1, 2))[classes[known] - SURFACE]).all()


def test_noise_of_zero_is_refused():
    with pytest.raises(ValueError, match="noise"):
        classify_positions(np.ones((1, 3)), CAMERA, np.ones((2, 2), np.float32), np.ones((2, 2), bool), 0.1, True, 0.0)


def test_in_two_dimensions_the_mask_decides():
    rng = np.random.default_rng(0)
    mask = rng.random((40, 60)) < 0.4
    points = rng.uniform(-10, 70, (2000, 2))
    points[7] = np.nan
    inside = (points > -0.5).all(axis=1) & (points < (59.5, 39.5)).all(axis=1)
    u, v = np.rint(np.where(inside[:, None], points, 0)).astype(int).T
    classes, odds, behind, *_ = classify_positions(points, np.zeros(0), np.zeros((0, 0), np.float32), mask, 0.1, True, 1.0)
    np.testing.assert_array_equal(classes, np.where(inside, np.where(mask[v, u], SURFACE, FREE), OUTSIDE))
    on, never = mask[v, u], np.full(2000, -np.inf)
    expected = np.column_stack((np.where(on, np.inf, -np.inf), never, np.where(on, -np.inf, np.inf)))
    np.testing.assert_array_equal(odds, np.where(inside[:, None], expected, 0))
    assert not len(behind)
