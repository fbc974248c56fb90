"""Colors of the surface around strands, before there is a mask."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.scene.surround import MIN_DEVIATION, learn_surround, median_hues, to_lab

RED, GRAY = (200, 40, 30), (150, 150, 145)
NOTHING = np.zeros((240, 320), bool)


def table(noise=3.0, width=12):
    """An image (240, 320, 3) of a red strand on a gray surface."""
    image = np.full((240, 320, 3), GRAY, float)
    image[120 : 120 + width] = RED
    return np.clip(image + np.random.default_rng(0).normal(0, noise, image.shape), 0, 255).astype(np.uint8)


def test_the_color_of_the_surface_is_learned_beside_a_strand():
    around, deviation, differs = learn_surround(table(), NOTHING, 7.0)
    gray = to_lab(np.full((1, 1, 3), GRAY, np.uint8))[0, 0]
    np.testing.assert_allclose(np.median(around, axis=(0, 1)), gray, atol=1)
    assert (deviation >= MIN_DEVIATION).all()
    assert differs[31:33].all()
    assert differs[:26].mean() + differs[38:].mean() < 0.01


def test_raised_pixels_are_not_learned_from_unless_there_are_no_others():
    wide = table(width=100)
    raised = (wide[..., 0] > wide[..., 1] + 60).astype(bool)
    gray, red = (to_lab(np.full((1, 1, 3), color, np.uint8))[0, 0] for color in (GRAY, RED))
    np.testing.assert_allclose(learn_surround(wide, raised, 7.0)[0][17:23].mean(axis=(0, 1)), gray, atol=1.5)
    around = learn_surround(wide, np.ones_like(raised), 7.0)[0]
    np.testing.assert_allclose(around[19:23].mean(axis=(0, 1)), red, atol=3)


def test_the_deviation_follows_the_noise():
    plain, noisy = (learn_surround(table(noise), NOTHING, 7.0)[1][0] for noise in (2.0, 20.0))
    assert noisy > 2 * plain


@pytest.mark.parametrize(("color", "sign"), [(RED, 1), ((30, 160, 60), -1)])
def test_the_hue_distinguishes_red_from_green_in_any_light(color, sign):
    bright, dark = (np.full((4, 4, 3), np.multiply(color, light), np.uint8) for light in (1.0, 0.8))
    hues = [median_hues(image, np.arange(16), np.array([16]))[0] for image in (bright, dark)]
    assert sign * (hues[0][0] - 128) > 10
    assert np.linalg.norm(hues[0] - hues[1]) < 20


def test_hues_of_groups_are_their_medians():
    rng = np.random.default_rng(0)
    image, pixels, sizes = (
        rng.integers(0, 256, (9, 9, 3), dtype=np.uint8),
        rng.permutation(81)[:40],
        np.array([3, 0, 5, 31, 1, 0]),
    )
    hues = to_lab(image).reshape(-1, 3)[pixels, 1:]
    parts = np.split(hues, np.cumsum(sizes)[:-1])
    wanted = [np.median(part, axis=0) if len(part) else np.zeros(2) for part in parts]
    np.testing.assert_array_equal(median_hues(image, pixels, sizes), wanted)
