"""Dimension-generic maths, for D = 2 and 3."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry.polyline import angle, densify, perpendicular, unit, whittaker_smooth

dims = pytest.mark.parametrize("dim", [2, 3])


def circle(dim, count=360, turn=2 * np.pi, radius=1.0):
    t = np.linspace(0, turn, count)
    return np.pad(radius * np.column_stack((np.cos(t), np.sin(t))), ((0, 0), (0, dim - 2)))


@dims
def test_unit(dim):
    vectors = np.random.default_rng(0).normal(size=(4, 5, dim))
    vectors[1, 2] = 0
    lengths = np.linalg.norm(unit(vectors), axis=-1)
    expected = np.ones((4, 5))
    expected[1, 2] = 0
    np.testing.assert_allclose(lengths, expected)
    np.testing.assert_array_equal(unit(np.zeros(dim)), np.zeros(dim))
    np.testing.assert_allclose(unit(1e-100 * np.eye(dim)[0]), np.eye(dim)[0])


@dims
@pytest.mark.parametrize("degrees", [0, 1e-7, 1e-3, 45, 90, 179.999, 180])
def test_angle(dim, degrees):
    a, b = np.eye(dim)[0], np.cos(np.radians(degrees)) * np.eye(dim)[0] + np.sin(np.radians(degrees)) * np.eye(dim)[1]
    assert np.degrees(angle(3 * a, 7 * b)) == pytest.approx(degrees, rel=1e-6, abs=1e-12)
    assert angle(np.zeros(dim), b) == angle(b, np.zeros(dim)) == pytest.approx(np.pi / 2)


@dims
def test_angle_of_many_pairs(dim):
    a, b = np.random.default_rng(1).normal(size=(2, 6, 1, dim))
    b = b.reshape(1, 6, dim)
    expected = np.arccos((a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1))
    np.testing.assert_allclose(angle(a, b), expected, rtol=1e-7)


@dims
@pytest.mark.parametrize("spacing", [0.013, 0.1, 1.0])
def test_densify(dim, spacing):
    points = circle(dim, turn=5.0)
    dense = densify(points, spacing)
    np.testing.assert_allclose(dense[[0, -1]], points[[0, -1]])
    along = np.unwrap(np.arctan2(dense[:, 1], dense[:, 0]))
    np.testing.assert_allclose(np.diff(along), 5.0 / (len(dense) - 1), rtol=2e-3)
    assert np.diff(along).max() <= spacing * 1.001
    assert len(dense) <= 5.0 / spacing + 2
    np.testing.assert_array_equal(densify(points, 50.0), points[[0, -1]])


@dims
@pytest.mark.parametrize("order", [1, 2, 3])
def test_whittaker_smoother_solves_its_equations(dim, order):
    random = np.random.default_rng(3)
    values = random.normal(size=(15, dim))
    root = random.normal(size=(15, dim, dim))
    weights = root @ root.transpose(0, 2, 1)
    difference = np.kron(np.diff(np.eye(15), order, axis=0), np.eye(dim))
    left = 2.5 * difference.T @ difference
    for i in range(15):
        left[i * dim : (i + 1) * dim, i * dim : (i + 1) * dim] += weights[i]
    expected = np.linalg.solve(left, np.einsum("pij,pj->pi", weights, values).ravel()).reshape(15, dim)
    np.testing.assert_allclose(whittaker_smooth(values, weights, 2.5, order), expected, rtol=1e-8)


@dims
def test_whittaker_smoother_keeps_a_line_and_bridges_missing_points(dim):
    values = np.linspace(0, 1, 30)[:, None] * np.arange(1, dim + 1)
    weights = np.tile(np.eye(dim), (30, 1, 1))
    np.testing.assert_allclose(whittaker_smooth(values, weights, 100.0), values, atol=1e-9)
    bad = values.copy()
    bad[10:20] = 7
    weights[10:20] *= 1e-9
    np.testing.assert_allclose(whittaker_smooth(bad, weights, 1.0), values, atol=1e-5)
    np.testing.assert_array_equal(whittaker_smooth(bad, weights, 0.0), bad)
    np.testing.assert_array_equal(whittaker_smooth(bad[:2], weights[:2], 1.0), bad[:2])
    np.testing.assert_allclose(whittaker_smooth(values, 0 * weights, 1.0), values, atol=1e-6)  # a line, whatever the weights


@dims
def test_perpendicular(dim):
    for direction in unit(np.random.default_rng(4).normal(size=(20, dim))):
        side = perpendicular(direction)
        assert abs(side @ direction) < 1e-12
        assert np.linalg.norm(side) == pytest.approx(1)
        np.testing.assert_array_equal(side, perpendicular(direction.copy()))
    for axis in np.eye(dim):
        assert perpendicular(axis) @ axis == 0
