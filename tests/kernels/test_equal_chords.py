"""Chords of one length along a polyline, against a search."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from doo3d.kernels import lay_equal_chords


def curve(seed, dim, count=60):
    """A random smooth polyline, with a repeated point in it."""
    points = np.cumsum(np.cumsum(np.random.default_rng(seed).normal(size=(count, dim)), axis=0) / 10, axis=0)
    return np.insert(points, 7, points[7], axis=0)


def slow_chords(points, length):
    """The same by search: from each joint the first place farther along that is `length` away."""
    joints, at = [points[0]], [0.0]
    edge, low, before = 0, 0.0, 0.0
    while edge < len(points) - 1:
        a, b = points[edge], points[edge + 1]

        def excess(part, a=a, b=b):
            return float(np.linalg.norm(a + part * (b - a) - joints[-1])) - length

        if excess(1.0) < 0:
            before += float(np.linalg.norm(b - a))
            edge, low = edge + 1, 0.0
            continue
        low = brentq(excess, low, 1.0, xtol=1e-15)
        joints.append(a + low * (b - a))
        at.append(before + low * float(np.linalg.norm(b - a)))
    return np.array(joints), np.array(at)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("length", [0.05, 0.31, 2.0, 5.0])
def test_against_search(seed, dim, length):
    points = curve(seed, dim)
    joints, at = lay_equal_chords(points, length)
    slow, slow_at = slow_chords(points, length)
    np.testing.assert_allclose(joints, slow, atol=1e-9)
    np.testing.assert_allclose(at, slow_at, atol=1e-9)
    assert joints.shape[1] == dim
    np.testing.assert_allclose(np.linalg.norm(np.diff(joints, axis=0), axis=1), length, rtol=1e-12)


def test_there_and_back_is_left_at_the_first_exit():
    joints, at = lay_equal_chords(np.array([[0.0, 0.0], [0.9, 0.0], [0.0, 0.0], [-3.0, 0.0]]), 1.0)
    np.testing.assert_allclose(joints[:, 0], [0, -1, -2, -3], atol=1e-12)
    np.testing.assert_allclose(at, [0, 2.8, 3.8, 4.8], atol=1e-12)


@pytest.mark.parametrize("points", [[[1.0, 2.0, 3.0]], [[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]], [[1.0, 1.0, 1.0]] * 3])
def test_too_short_for_a_chord(points):
    joints, at = lay_equal_chords(np.array(points), 0.5)
    np.testing.assert_array_equal(joints, points[:1])
    np.testing.assert_array_equal(at, [0])


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_any_scale(scale):
    points = curve(3, 3)
    joints, scaled = lay_equal_chords(points, 0.3)[0], lay_equal_chords(scale * points, 0.3 * scale)[0]
    np.testing.assert_allclose(scaled, scale * joints, rtol=1e-9, atol=1e-9 * scale)
