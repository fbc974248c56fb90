"""End tangents against least squares."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry.polyline import arc_length, unit
from doo3d.kernels import end_tangents


def end_tangent(points, reach):
    """Where the last end of a polyline (P, D) is heading, by numpy's least squares.

    Of a parabola (a line, from fewer than four points) fitted over `reach` of it: a line over a length of a curve of
    radius R lags behind its end by length / 2R.
    """
    back = arc_length(points[::-1])
    near = back <= max(reach, back[1]) * (1 + 1e-9)
    powers = np.vander(-back[near], 3 if near.sum() > 3 else 2, increasing=True)
    fitted = np.linalg.lstsq(powers, points[::-1][near], rcond=None)[0]
    return unit(fitted[1])


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
    found = end_tangents(np.concatenate(lines), bounds, reach * scale)
    np.testing.assert_allclose(
        found, [end_tangent(points, reach * scale) for line in lines for points in (line[::-1], line)], atol=1e-9
    )


def ends(points, reach):
    """Directions of a polyline's two ends."""
    return end_tangents(np.ascontiguousarray(points, dtype=float), np.array([0, len(points)]), reach)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("reach", [0.05, 0.4, 1.0])
def test_the_tangent_at_the_ends_of_an_arc(dim, reach):
    """A line through the last stretch of an arc lags by half of it; the tangent of the fitted parabola does not."""
    t = np.linspace(0, 2.0, 360)
    points = np.pad(np.column_stack((np.cos(t), np.sin(t))), ((0, 0), (0, dim - 2)))
    first, last = ends(points, reach)
    np.testing.assert_allclose(first[:2], [0, -1], atol=0.35 * reach**2 + 0.01)
    np.testing.assert_allclose(last[:2], [-np.sin(2.0), np.cos(2.0)], atol=0.35 * reach**2 + 0.01)
    assert np.linalg.norm(first) == pytest.approx(1)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_tangent_of_the_last_segment(dim):
    points = np.pad([[0.0, 0], [1, 0], [1, 1], [1, 2]], ((0, 0), (0, dim - 2)))
    first, last = ends(points, 0.0)
    np.testing.assert_allclose(first[:2], [-1, 0], atol=1e-12)
    np.testing.assert_allclose(last[:2], [0, 1], atol=1e-12)
    first, last = ends(points[:2], 5.0)
    np.testing.assert_allclose(first[:2], [-1, 0], atol=1e-12)
    np.testing.assert_allclose(last[:2], [1, 0], atol=1e-12)
