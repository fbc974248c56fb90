"""What the depth image says about a position."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from doo3d.scene.depth_model import DepthModel
from doo3d.scene.frame_facts import FrameFacts
from doo3d.scene.point_visibility import PointVisibility
from doo3d.types import Camera

CAMERA = Camera(fx=100.0, fy=120.0, cx=20.0, cy=15.0, width=40, height=30)
PIXELS = {
    PointVisibility.FREE: (5, 5),
    PointVisibility.NO_DEPTH: (10, 5),
    PointVisibility.MASKED: (15, 5),
    PointVisibility.SURFACE: (20, 5),
    PointVisibility.HIDDEN: (25, 5),
}


@pytest.fixture
def model():
    """Depth 0.8 m; at five pixels one of each case for a place 0.5 m away, to be told apart at 20 mm."""
    depth, mask = np.full((30, 40), 0.8, np.float32), np.zeros((30, 40), bool)
    for seen, (u, v) in PIXELS.items():
        depth[v, u] = {
            PointVisibility.NO_DEPTH: 0,
            PointVisibility.MASKED: 0,
            PointVisibility.SURFACE: 0.495,
            PointVisibility.HIDDEN: 0.3,
        }.get(seen, 0.8)
        mask[v, u] = seen in (PointVisibility.MASKED, PointVisibility.SURFACE)
    return DepthModel(FrameFacts(mask, depth), CAMERA, 0.02)


def place(pixel, z=0.5):
    return CAMERA.unproject(np.array([pixel]), np.array([z]))


@pytest.mark.parametrize("seen", PIXELS)
def test_each_case(model, seen):
    assert model.classify(place(PIXELS[seen])).tolist() == [seen]


def test_all_at_once(model):
    points = np.concatenate([place(pixel) for pixel in PIXELS.values()])
    assert model.classify(points).tolist() == list(PIXELS)
    assert model.classify(np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize(
    "point", [place((-0.6, 10))[0], place((39.6, 10))[0], place((10, -0.6))[0], place((10, 29.6))[0], [0, 0, -0.5], [0, 0, 0]]
)
def test_outside_the_image_or_behind_the_camera(model, point):
    assert model.classify(np.array([point], dtype=float)).tolist() == [PointVisibility.OUTSIDE]


@pytest.mark.parametrize("pixel", [(-0.4, -0.4), (39.4, 29.4)])
def test_the_corners_are_inside(model, pixel):
    assert model.classify(place(pixel)).tolist() == [PointVisibility.FREE]


def test_the_object_behind_a_place_is_free_space_only_where_that_is_asked_for(model):
    """A strand that the camera sees beyond a place is not hidden by anything at that place."""
    assert model.classify(place(PIXELS[PointVisibility.SURFACE], 0.6)).tolist() == [PointVisibility.HIDDEN]
    assert model.classify(place(PIXELS[PointVisibility.SURFACE], 0.4)).tolist() != [PointVisibility.FREE]
    assert replace(model, own_object_counts_as_free=True).classify(place(PIXELS[PointVisibility.SURFACE], 0.4)).tolist() == [
        PointVisibility.FREE
    ]


def test_within_the_margin_nothing_is_free(model):
    assert model.classify(place(PIXELS[PointVisibility.FREE], 0.785)).tolist() != [PointVisibility.FREE]
    assert model.classify(place(PIXELS[PointVisibility.FREE], 0.775)).tolist() == [PointVisibility.FREE]


def odds_at(reading, masked=False, z=0.5, noise=0.002, **settings):
    """Return the log-odds at one pixel with a reading; noise : m, of the readings of a flat object 0.5 m away."""
    rng = np.random.default_rng(0)
    depth, mask = rng.normal(0.5, noise, (30, 40)).astype(np.float32), np.ones((30, 40), bool)
    depth[15, 20], mask[15, 20] = reading, masked
    model = DepthModel(FrameFacts(mask, depth), CAMERA, 0.02, **settings)
    return [float(state[0]) for state in model.log_odds(place((20, 15), z))], model


def test_the_noise_is_that_of_the_sensor_in_inverse_depth():
    assert odds_at(0.5)[1].noise == pytest.approx(0.002 / 0.5**2, rel=0.1)
    assert DepthModel(FrameFacts(np.ones((30, 40), bool), np.ones((30, 40), np.float32)), CAMERA, 0.02).noise > 0


def test_five_cm_before_or_behind_or_at_a_reading():
    (seen, free, hidden, bare, unknown), model = odds_at(0.55)
    assert free == pytest.approx((1 / 0.5 - 1 / 0.55 - 0.02 / 0.5 / 0.55) / model.noise, rel=1e-6)
    assert (seen, bare, unknown) == (-np.inf,) * 3
    assert hidden == -free < 0
    (seen, free, hidden, bare, unknown), _ = odds_at(0.45, masked=True)
    assert hidden == -seen > 0
    assert (free, bare, unknown) == (-np.inf,) * 3
    (seen, free, hidden, _, _), model = odds_at(0.5, masked=True, own_object_counts_as_free=True)
    assert seen == pytest.approx(0.02 / 0.5**2 / model.noise, rel=1e-6)
    assert free == hidden == -seen


@pytest.mark.parametrize("masked", [True, False])
def test_without_a_reading_or_outside_all_but_unknown_is_undecided(masked):
    assert odds_at(0.0, masked)[0] == [0, 0, 0, 0, np.inf]
    assert [float(state[0]) for state in odds_at(0.0)[1].log_odds(place((-5, 15)))] == [0, 0, 0, 0, np.inf]


def test_twice_the_noise_halves_the_log_odds():
    (one, of_one), (two, of_two) = odds_at(0.55), odds_at(0.55, noise=0.004)
    assert of_two.noise == pytest.approx(2 * of_one.noise, rel=0.01)
    assert two[1] == pytest.approx(one[1] * of_one.noise / of_two.noise)


@pytest.mark.parametrize("own_counts", [True, False])
def test_the_class_is_the_most_likely_state(own_counts):
    rng = np.random.default_rng(1)
    depth = np.where(rng.random((30, 40)) < 0.8, rng.normal(0.6, 0.1, (30, 40)), 0).astype(np.float32)
    model = DepthModel(FrameFacts(rng.random((30, 40)) < 0.4, depth), CAMERA, 0.03, own_counts)
    points = rng.normal((0, 0, 0.6), 0.1, (3000, 3))
    classes = model.classify(points)
    kinds = np.array((PointVisibility.SURFACE, PointVisibility.FREE, PointVisibility.HIDDEN, PointVisibility.BARE, 0))
    likeliest = kinds[np.column_stack(model.log_odds(points)).argmax(axis=1)]
    np.testing.assert_array_equal(np.where(classes <= PointVisibility.MASKED, 0, classes), likeliest)
