"""Axis and radius from the seen part of a cylinder."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, depth_of, line, surface

from doo3d.geometry.curves import Curves
from doo3d.geometry.polyline import densify, perpendicular, unit
from doo3d.scene.axis_in_views import mask_sample, measure_silhouette
from doo3d.scene.cross_sections import CrossSections, axis_depth, cross_sections, fit_circles, section_axes
from doo3d.scene.frame_facts import FrameFacts

RADIUS = 0.006
AXIS = densify(line([-0.1, 0.03, 0.5], [0.12, -0.02, 0.6]), 0.002)
PATH = np.zeros(len(AXIS), dtype=np.int64)
REACH = np.full(len(AXIS), 2.2 * RADIUS)
INNER = slice(8, -8)


def frames(viewpoint=(0, 0, 0)):
    return section_axes(AXIS, Curves.of([AXIS]).tangents, None if viewpoint is None else np.array(viewpoint, dtype=float))


@pytest.mark.parametrize("viewpoint", [(0, 0, 0), (1, -2, 0.3), None])
def test_axes_are_square_and_away_points_away(viewpoint):
    found = frames(viewpoint)
    basis = np.stack((found.tangent, found.lateral, found.depth), axis=1)
    np.testing.assert_allclose(basis @ basis.transpose(0, 2, 1), np.tile(np.eye(3), (len(AXIS), 1, 1)), atol=1e-9)
    if viewpoint is not None:
        assert (np.einsum("ij,ij->i", found.depth, AXIS - viewpoint) > 0).all()
        np.testing.assert_allclose(np.einsum("ij,ij->i", found.lateral, AXIS - viewpoint), 0, atol=1e-9)


def test_axes_turn_little_without_a_viewpoint():
    t = np.linspace(0, 4 * np.pi, 300)
    curve = np.column_stack((np.cos(t), np.sin(t), 0.3 * t))
    found = section_axes(curve, Curves.of([curve]).tangents, None)
    assert (np.einsum("ij,ij->i", found.lateral[1:], found.lateral[:-1]) > 0.99).all()


def test_axes_of_a_line_that_runs_away_from_the_camera():
    places = np.array([0.0, 0, 1]) * np.linspace(0.4, 0.6, 20)[:, None]
    found = section_axes(places, Curves.of([places]).tangents, np.zeros(3))
    np.testing.assert_allclose(np.linalg.norm(found.lateral, axis=1), 1)
    np.testing.assert_allclose(found.lateral @ [0, 0, 1], 0, atol=1e-12)


def test_points_belong_to_their_nearest_station():
    points = surface(AXIS, RADIUS)
    far = AXIS[5] + 3 * RADIUS * perpendicular(unit(AXIS[-1] - AXIS[0]))
    found = cross_sections(np.concatenate((points, [far])), AXIS, frames(), REACH)
    assert len(found.sample) == len(points)
    expected = np.argmin(np.linalg.norm(points[:, None] - AXIS[None], axis=2), axis=1)
    assert (np.abs(found.sample - expected) <= 1).all()
    inner = (found.sample > 3) & (found.sample < len(AXIS) - 4)
    np.testing.assert_allclose(np.hypot(found.lateral, found.depth)[inner], RADIUS, rtol=0.02)


def arc(center, radius, span, count=40, noise=0.0, samples=3):
    """Points of one arc that faces the sensor, as the section of each of some samples."""
    angle = np.radians(np.linspace(-span / 2, span / 2, count) - 90)
    points = center + radius * np.column_stack((np.cos(angle), np.sin(angle)))
    points = np.tile(points, (samples, 1)) + noise * np.random.default_rng(1).normal(size=(samples * count, 2))
    return CrossSections(np.repeat(np.arange(samples), count), points[:, 0], points[:, 1])


@pytest.mark.parametrize("span", [90, 120, 180, 360])
@pytest.mark.parametrize("center", [(0.0, 0.0), (0.002, 0.005)])
def test_circles_through_arcs(span, center):
    section = arc(np.array(center), RADIUS, span)
    centers, radii, count = fit_circles(section, np.zeros(3, np.int64), None, 1)
    np.testing.assert_allclose(radii, RADIUS, rtol=0.02 if span < 120 else 1e-3)
    np.testing.assert_allclose(centers, [center] * 3, atol=0.02 * RADIUS)
    assert count.tolist() == [80, 120, 80]


@pytest.mark.parametrize("span", [120, 180])
def test_circles_through_noisy_arcs_are_not_small(span):
    """The algebraic fit alone makes them too small."""
    section = arc(np.array([0.0, 0.003]), RADIUS, span, count=2000, noise=0.08 * RADIUS)
    centers, radii, _ = fit_circles(section, np.zeros(3, np.int64), None, 1)
    np.testing.assert_allclose(radii, RADIUS, rtol=0.04)
    np.testing.assert_allclose(centers, [[0, 0.003]] * 3, atol=0.05 * RADIUS)


def test_circles_of_a_known_radius():
    section = arc(np.array([0.001, 0.004]), RADIUS, 60, noise=0.02 * RADIUS)
    centers, _, _ = fit_circles(section, np.zeros(3, np.int64), np.full(3, RADIUS), 1)
    np.testing.assert_allclose(centers, [[0.001, 0.004]] * 3, atol=0.05 * RADIUS)


def test_too_few_points_give_no_circle():
    section = arc(np.zeros(2), RADIUS, 180, count=4, samples=1)
    _, radii, count = fit_circles(section, np.zeros(2, np.int64), None, 0)
    assert np.isnan(radii).all()
    assert count.tolist() == [4, 0]


@pytest.mark.parametrize("shift", [-1.0, -0.4, 0.5])
def test_the_axis_lies_behind_the_half_shell(shift):
    """Stations `shift` radii off in depth; points all round from -80 to 80 degrees of the side that is seen."""
    section = arc(np.array([0.0, shift * RADIUS]), RADIUS, 160, count=100)
    depth, count = axis_depth(section, np.zeros(3, np.int64), np.full(3, RADIUS), 1)
    np.testing.assert_allclose(depth, shift * RADIUS, atol=1e-9)
    assert (count > 100).all()


def test_a_few_points_of_something_else_do_not_move_the_axis():
    good = arc(np.array([0.0, 0.003]), RADIUS, 160, count=100)
    other = np.random.default_rng(0).integers(0, 3, 25)
    section = CrossSections(
        np.append(good.sample, other), np.append(good.lateral, np.zeros(25)), np.append(good.depth, np.full(25, 0.02))
    )
    depth, _ = axis_depth(section, np.zeros(3, np.int64), np.full(3, RADIUS), 1)
    np.testing.assert_allclose(depth, 0.003, atol=0.05 * RADIUS)


def test_points_beside_the_shell_do_not_count():
    """At the rim the depth says little, and beyond it there is none."""
    good = arc(np.array([0.0, 0.003]), RADIUS, 160, count=100)
    beside = np.tile([-1.5, -0.95, 0.95, 1.5], 6) * RADIUS
    section = CrossSections(
        np.append(good.sample, np.repeat([0, 1, 2], 8)), np.append(good.lateral, beside), np.append(good.depth, 0 * beside)
    )
    depth, _ = axis_depth(section, np.zeros(3, np.int64), np.full(3, RADIUS), 1)
    np.testing.assert_allclose(depth, 0.003, atol=1e-9)


def test_no_points_say_nothing():
    empty = CrossSections(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    _, count = axis_depth(empty, np.zeros(3, np.int64), np.full(3, RADIUS), 1)
    assert count.tolist() == [0, 0, 0]
    _, radii, _ = fit_circles(empty, np.zeros(3, np.int64), None, 1)
    assert np.isnan(radii).all()


@pytest.mark.parametrize("aside", [0.0, 0.5, -0.7])
def test_the_mask_tells_the_middle_and_the_width(aside):
    """Stations `aside` radii to the side of the axis: the mask's middle is as far on the other side."""
    _, which = depth_of([AXIS], [RADIUS])
    found = frames()
    places = AXIS + aside * RADIUS * found.lateral
    seen = measure_silhouette(places, found, PATH, FrameFacts(which >= 0), CAMERA, REACH, 3)
    np.testing.assert_allclose(seen[1][INNER], RADIUS, rtol=0.05)
    np.testing.assert_allclose(seen[0][INNER], -aside * RADIUS, atol=0.08 * RADIUS)
    assert np.median(seen[1][INNER]) == pytest.approx(RADIUS, rel=0.02)


def test_an_empty_mask_tells_nothing():
    seen = measure_silhouette(AXIS, frames(), PATH, FrameFacts(np.zeros((4, 4), bool)), CAMERA, REACH, 3)
    assert not seen[1].any()


def test_a_sample_of_a_mask_is_even_in_rows_columns_and_squares():
    mask = np.ones((400, 402), bool)
    mask[:, :2] = False
    pixels, share = mask_sample(FrameFacts(mask))
    assert share == 400 * 400 / len(pixels) == 8
    for size in ((1, 400), (400, 1), (20, 20)):
        counts = np.unique((pixels - (2, 0)) // size, axis=0, return_counts=True)[1]
        assert len(counts) == 400
        assert np.abs(counts - 50).max() <= 2
    small = FrameFacts(np.ones((90, 90), bool))
    assert mask_sample(small)[0].tolist() == small.pixels.tolist()
    assert mask_sample(FrameFacts(np.zeros((4, 9), bool)))[0].shape == (0, 2)
