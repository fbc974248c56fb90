"""The renderer against formulas; the sensor model against its own numbers."""

import numpy as np
import pytest

from doo3d.evaluation.rendering.depth_sensor import SENSORS, measure_depth
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.model import Scene, Solid, Table, Truth
from doo3d.evaluation.scenes.stacking import spline_axis
from doo3d.types import Camera

CAMERA = Camera(fx=460.0, fy=460.0, cx=160.0, cy=90.0, width=320, height=180)
RADIUS, DEPTH = 0.008, 0.5


def _straight(y=0.0, occluders=(), shiny=()):
    axis = spline_axis(np.column_stack((np.linspace(-0.1, 0.1, 9), np.full(9, y), np.full(9, DEPTH))))
    cable = Truth(axis, RADIUS, shiny=shiny)
    table = Table(np.array([0.0, 0.0, DEPTH + RADIUS]), np.array([0.0, 0.0, -1.0]))
    return Scene("test", "test", 0, CAMERA, (cable,), occluders, table)


def _slab(center, size):
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * size + center
    return Solid(corners, np.array([(0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]))


def test_depth_of_a_straight_cable_is_that_of_a_cylinder():
    rendered = render(_straight(), "none")
    rows = np.arange(85, 96)
    slope = (rows - CAMERA.cy) / CAMERA.fy
    # (slope z)^2 + (z - DEPTH)^2 = RADIUS^2, the nearer root
    a = 1 + slope**2
    expected = (DEPTH - np.sqrt(DEPTH**2 - a * (DEPTH**2 - RADIUS**2))) / a
    assert np.abs(rendered.frame.depth[rows, 160] - expected).max() < 5e-5
    assert rendered.frame.depth[10, 10] == pytest.approx(DEPTH + RADIUS, abs=1e-6)
    assert (rendered.labels[rows, 160] == 1).all()
    assert rendered.labels[10, 10] == 0
    assert rendered.truths[0].seen.all()


def test_color_of_the_cable_stands_out():
    rendered = render(_straight(), "none")
    red, green, _ = rendered.frame.color[90, 160].astype(int)
    assert red > 2 * green
    red, green, _ = rendered.frame.color[20, 20].astype(int)
    assert abs(red - green) < 15


def test_hidden_run_is_the_shadow_of_the_occluder():
    rendered = render(_straight(occluders=(_slab((0.02, 0.0, 0.4), (0.03, 0.1, 0.01)),)), "none")
    truth = rendered.truths[0]
    hidden = truth.axis[~truth.seen, 0]
    # the slab's edges at x = 0.005 and 0.035; its near face at z = 0.395 bounds the far side, its far face the near side
    surface = DEPTH - RADIUS
    assert hidden.min() == pytest.approx(0.005 * surface / 0.405, abs=0.001)
    assert hidden.max() == pytest.approx(0.035 * surface / 0.395, abs=0.001)
    assert (rendered.labels == 255).any()


def test_strand_under_another_is_hidden():
    scene = _straight()
    over = np.column_stack((np.zeros(9), np.linspace(-0.05, 0.05, 9), np.full(9, DEPTH - 2 * RADIUS)))
    scene = Scene(**{**vars(scene), "cables": (*scene.cables, Truth(spline_axis(over), RADIUS))})
    lower, upper = render(scene, "none").truths
    assert upper.seen.all()
    width = (~lower.seen).sum() * 0.0005
    assert 1.6 * RADIUS < width < 2.4 * RADIUS
    assert np.abs(lower.axis[~lower.seen, 0]).max() < 1.5 * RADIUS


def test_shiny_run_has_color_but_no_depth():
    rendered = render(_straight(shiny=((0.09, 0.11),)), "none")
    assert rendered.frame.depth[90, 160] == 0
    assert rendered.mask[90, 160]
    assert rendered.frame.depth[90, 110] > 0
    assert rendered.truths[0].seen.all()


def test_same_scene_renders_the_same():
    one, other = render(_straight(), "d435"), render(_straight(), "d435")
    assert np.array_equal(one.frame.depth, other.frame.depth)
    assert np.array_equal(one.frame.color, other.frame.color)


def test_unknown_sensor_names_the_known_ones():
    with pytest.raises(ValueError, match="d435"):
        render(_straight(), "kinect")


@pytest.mark.parametrize("name", ["d435", "d455"])
def test_stereo_noise_grows_with_the_square_of_the_depth(name):
    camera = Camera(fx=920.0, fy=920.0, cx=320.0, cy=240.0, width=640, height=480)
    sensor = SENSORS[name]
    nothing = np.zeros((480, 640), dtype=bool)
    for z in (0.6, 1.2):
        exact = z + np.linspace(0, 0.005, 640) * np.ones((480, 1))  # a ramp, so that rounding acts as noise
        depth = measure_depth(exact, nothing, camera, sensor, np.random.default_rng(3)).astype(float)
        got = (depth - exact)[depth > 0]
        per_pixel = z**2 / (camera.fx * sensor.baseline)
        floor = np.hypot(per_pixel * sensor.disparity_step, sensor.depth_step) / np.sqrt(12)
        low, high = np.hypot(np.array(sensor.noise) * per_pixel, floor)
        assert 0.9 * low < got.std() < 1.1 * high
        assert np.allclose(depth * 1000, np.round(depth * 1000), atol=1e-3)
        assert (depth == 0).mean() == pytest.approx(sensor.holes, rel=0.05)


def test_noise_is_alike_between_neighbours():
    camera = Camera(fx=920.0, fy=920.0, cx=320.0, cy=240.0, width=640, height=480)
    smooth = SENSORS["zivid"]
    depth = measure_depth(np.full((480, 640), 0.6), np.zeros((480, 640), dtype=bool), camera, smooth, np.random.default_rng(0))
    noise = np.where(depth > 0, depth - 0.6, 0.0)
    assert noise.std() == pytest.approx(0.0001, rel=0.05)
    assert np.corrcoef(noise[:, :-1].ravel(), noise[:, 1:].ravel())[0, 1] > 0.3
    assert abs(np.corrcoef(noise[:, :-8].ravel(), noise[:, 8:].ravel())[0, 1]) < 0.05


def test_edges_get_flying_points_and_holes():
    camera = Camera(fx=920.0, fy=920.0, cx=320.0, cy=240.0, width=640, height=480)
    exact = np.full((480, 640), 0.7)
    exact[:, 320:] = 0.6
    depth = measure_depth(exact, np.zeros((480, 640), dtype=bool), camera, SENSORS["d435"], np.random.default_rng(0))
    edge = depth[:, 319:321]
    assert ((edge > 0.61) & (edge < 0.69)).mean() == pytest.approx(0.3 * 0.8, abs=0.06)
    assert (edge == 0).mean() == pytest.approx(0.25, abs=0.06)
    assert (depth[:, 400:] > 0.61).sum() == 0
