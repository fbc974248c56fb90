"""Colors of an object against those of its surround."""

from __future__ import annotations

import numpy as np

from doo3d.evidence.appearance import Appearance

INSIDE, AROUND = np.arange(400), np.arange(400, 4000)


def photographed(object_color, surround_color, noise=4.0):
    """A noisy image (40, 100, 3) whose first pixels, INSIDE, show the object."""
    image = np.full((4000, 3), surround_color, float)
    image[INSIDE] = object_color
    image += np.random.default_rng(0).normal(0, noise, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8).reshape(40, 100, 3)


def answer(appearance, rgb):
    red, green, blue = (value >> 4 for value in rgb)
    return appearance.log_odds[256 * red + 16 * green + blue]


def test_colors_of_the_object_have_positive_log_odds_and_those_around_negative_ones():
    learned = Appearance.learn(photographed((20, 60, 200), (150, 150, 145)), INSIDE, AROUND)
    assert answer(learned, (20, 60, 200)) > 5
    assert answer(learned, (150, 150, 145)) < -5
    assert answer(learned, (255, 0, 0)) == 0
    assert learned.separation > 5
    assert np.abs(learned.log_odds).max() < -np.log(1e-5)


def test_shadows_of_the_surround_are_not_of_the_object():
    learned = Appearance.learn(photographed((20, 60, 200), (150, 150, 145)), INSIDE, AROUND)
    for shade in (0.85, 0.7, 0.55, 0.4):
        assert answer(learned, [int(value * shade) for value in (150, 150, 145)]) < -3


def test_equal_colors_do_not_separate():
    learned = Appearance.learn(photographed((150, 150, 145), (150, 150, 145)), INSIDE, AROUND)
    assert abs(learned.separation) < 0.5


def test_the_noise_is_that_of_the_counts():
    image = photographed((150, 150, 145), (150, 150, 145), noise=10)
    drawn = [np.random.default_rng(seed).choice(4000, 400, replace=False) for seed in range(40)]
    answers = [answer(Appearance.learn(image, some[:200], some[200:]), (152, 152, 152)) for some in drawn]
    cell = (image.reshape(-1, 3) >> 4 == 9).all(axis=1).mean() * 200
    assert 0.3 < np.std(answers) / np.sqrt(2 / cell) < 1.3
