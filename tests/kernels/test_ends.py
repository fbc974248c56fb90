"""The courses of ends, against least squares."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry import end_course
from doo3d.kernels.ends import courses


def chains(seed, dim, scale):
    """Smooth random polylines of two points and more."""
    random = np.random.default_rng(seed)
    return [scale * np.cumsum(np.cumsum(random.normal(size=(n, dim)), axis=0), axis=0) for n in (2, 3, 4, 5, 9, 30)]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scale", [1e-3, 10.0])
@pytest.mark.parametrize("reach", [0.0, 4.0, 40.0, 1e3])
@pytest.mark.parametrize("seed", range(4))
def test_against_least_squares(seed, reach, scale, dim):
    lines = chains(seed, dim, scale)
    bounds = np.cumsum([0, *map(len, lines)])
    directions, curvatures = courses(np.concatenate(lines), bounds, reach * scale)
    expected = [end_course(points, reach * scale) for line in lines for points in (line[::-1], line)]
    np.testing.assert_allclose(directions, [direction for direction, _ in expected], atol=1e-9)
    np.testing.assert_allclose(curvatures * scale, [curvature * scale for _, curvature in expected], atol=1e-9)


@pytest.mark.parametrize("end", [0, 1])
def test_of_a_circle(end):
    """Over a quarter of a circle of radius 2, from its end back: heading along it, bent towards its middle."""
    turn = np.linspace(0, np.pi / 2, 60)[:: -1 if end == 0 else 1]
    directions, curvatures = courses(2 * np.column_stack((np.cos(turn), np.sin(turn))), np.array([0, 60]), 0.6)
    np.testing.assert_allclose(directions[end], [-1, 0], atol=0.02)
    np.testing.assert_allclose(curvatures[end], [0, -0.5], atol=0.02)
