"""Projections: positions, distances and scales by formula, and axes that are right-handed and orthonormal."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry.projection import Projection, axes_along, spread_axes, upright_axes_along
from doo3d.types import Camera

CAMERA = Camera(600, 400, 320, 240, 640, 480)
POINTS = np.array([[0.0, 0.0, 2.0], [0.1, -0.2, 0.5]])


def test_the_camera_projects_with_its_intrinsics():
    view = Projection.of_camera(CAMERA)
    np.testing.assert_allclose(view.project(POINTS), [[320, 240], [440, 80]])
    np.testing.assert_allclose(view.distance(POINTS), [2, 0.5])
    np.testing.assert_allclose(view.scale(np.array([2.0, 0.5])), np.sqrt(600 * 400) / np.array([2, 0.5]))


def test_behind_the_camera_there_is_no_position_and_no_scale():
    view = Projection.of_camera(CAMERA)
    behind = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
    assert np.isnan(view.project(behind)).all()
    assert np.isnan(view.scale(view.distance(behind))).all()


def test_perspective_from_a_viewpoint_is_the_camera_of_moved_points():
    axes, viewpoint = axes_along(np.array([0.2, -0.5, 1.0])), np.array([0.3, 0.1, -0.4])
    view, camera = Projection.perspective(viewpoint, axes, CAMERA), Projection.of_camera(CAMERA)
    moved = POINTS @ axes + viewpoint
    np.testing.assert_allclose(view.project(moved), camera.project(POINTS))
    np.testing.assert_allclose(view.distance(moved), camera.distance(POINTS))


def test_parallel_has_one_scale_at_any_distance():
    view = Projection.parallel(np.array([1.0, 2.0, 3.0]), np.eye(3), 10.0, np.array([5.0, 7.0]))
    np.testing.assert_allclose(view.project(np.array([[2.0, 2.0, 9.0]])), [[15, 7]])
    np.testing.assert_allclose(view.distance(np.array([[2.0, 2.0, 9.0]])), [6])
    np.testing.assert_allclose(view.scale(np.array([[1.0, 6.0]])), [[10, 10]])


def test_planar_points_keep_their_positions():
    view = Projection.planar()
    np.testing.assert_array_equal(view.project(np.array([[3.0, 4.0]])), [[3, 4]])
    np.testing.assert_array_equal(view.distance(np.array([[3.0, 4.0]])), [0])
    np.testing.assert_array_equal(view.scale(np.zeros(2)), [1, 1])


@pytest.mark.parametrize("make", [axes_along, upright_axes_along])
@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 1, 0), (0, -1, 0), (-3, 0.1, 2), (0, 0, -0.01)])
def test_axes_are_a_right_handed_system_along_the_direction(make, direction):
    axes = make(np.array(direction, dtype=float))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    np.testing.assert_allclose(axes[2], np.array(direction) / np.linalg.norm(direction), atol=1e-12)


def test_upright_axes_keep_down_below():
    assert upright_axes_along(np.array([1.0, 0.3, 1.0]))[1, 1] > 0.9


def test_spread_axes_begin_with_the_longest_extent():
    points = np.random.default_rng(0).normal(size=(500, 3)) * (0.1, 5.0, 1.0)
    axes = spread_axes(points - points.mean(axis=0))
    np.testing.assert_allclose(np.abs(axes), np.eye(3)[[1, 2, 0]], atol=0.05)
    assert np.linalg.det(axes) == pytest.approx(1)
