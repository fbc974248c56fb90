"""Colors of an object against those of its surround."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.geometry.noise import SURFACE_SAMPLES
from doo3d.kernels import MaskEdge
from doo3d.scene.appearance import BAND_PX, RING_PX, Appearance

RED, GRAY = (200, 40, 30), (150, 150, 145)


def cable(length=200, width=10):
    """The mask (120, 240) of a straight cable."""
    mask = np.zeros((120, 240), bool)
    mask[55 : 55 + width, 20 : 20 + length] = True
    return mask


def photographed(mask, color=RED, surround=GRAY, noise=4.0, seed=0):
    image = np.where(mask[..., None], color, surround).astype(float)
    return np.clip(image + np.random.default_rng(seed).normal(0, noise, image.shape), 0, 255).astype(np.uint8)


def learned(mask, image):
    edge = MaskEdge(mask, BAND_PX, RING_PX)
    return Appearance(image, edge.inside(), edge.around(SURFACE_SAMPLES))


def answer(mask, image, rgb):
    """The log-odds of a color and their noise, asked at a pixel far from the cable."""
    shown = image.copy()
    shown[0, 0] = rgb
    appearance, corner = learned(mask, shown), np.zeros((1, 2), int)
    return float(appearance.log_odds_at(corner)[0]), float(appearance.noise_at(corner)[0])


def test_pixels_of_a_red_cable_on_gray_have_positive_log_odds_and_those_around_negative_ones():
    mask = cable()
    appearance = learned(mask, photographed(mask))
    v, u = np.nonzero(mask)
    assert np.median(appearance.log_odds_at(np.column_stack((u, v)))) == pytest.approx(appearance.separation)
    assert (appearance.log_odds_at(np.column_stack((u, v))) > 3).all()
    v, u = np.nonzero(~mask)
    assert (appearance.log_odds_at(np.column_stack((u, v))) < -3).all()
    assert np.abs(appearance.log_odds).max() < -np.log(1e-5)


def test_a_color_that_was_never_seen_is_of_neither_and_its_noise_says_so():
    mask = cable()
    log_odds, noise = answer(mask, photographed(mask), (0, 0, 255))
    assert log_odds == 0
    assert noise > 2 * answer(mask, photographed(mask), RED)[1]


def test_shadows_of_the_surround_are_not_of_the_object():
    mask = cable()
    for shade in (0.85, 0.7, 0.55, 0.4):
        assert answer(mask, photographed(mask), [int(value * shade) for value in GRAY])[0] < -3


def test_equal_colors_do_not_separate():
    mask = cable()
    assert abs(learned(mask, photographed(mask, GRAY)).separation) < 0.5


def test_the_noise_falls_with_the_root_of_the_pixels():
    few, many = (answer(cable(length), photographed(cable(length), GRAY), GRAY)[1] for length in (20, 80))
    assert 1.5 < few / many < 2.2


def test_the_noise_bounds_the_spread_of_the_answers():
    mask = cable(40)
    images = (photographed(mask, GRAY, noise=10, seed=seed) for seed in range(40))
    log_odds, noise = np.array([answer(mask, image, (152, 152, 152)) for image in images]).T
    assert 0.2 < np.std(log_odds) / noise.mean() < 1
