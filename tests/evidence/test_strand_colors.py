"""Colors across strands, and which of two strands explains colors."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.evidence.strand_colors import (
    INDEPENDENT_COLORS,
    MAX_LOG_RATIO,
    PROFILE_OFFSETS,
    color_profiles,
    colors_at,
    first_strand_log_odds,
    medians,
)

RED, BLUE = np.array((200.0, 40, 30)), np.array((20.0, 60, 200))


def striped(middle, rim, noise=0.0):
    """An image (60, 80, 3) of a strand along y = 30, of half-width 8, whose rim is of another color."""
    across = np.abs(np.arange(60) - 30.0)
    image = np.where((across < 4)[:, None, None], middle, rim) + np.zeros((60, 80, 3))
    return np.clip(image + np.random.default_rng(0).normal(0, noise, image.shape), 0, 255).astype(np.uint8)


def positions(first=10, last=70):
    u, v = np.meshgrid(np.arange(first, last), 30 + 8 * PROFILE_OFFSETS, indexing="ij")
    return np.stack((u, v), axis=-1).astype(float)


def test_the_profile_is_the_color_by_lateral_offset():
    profile, measured = color_profiles(striped(RED, BLUE), positions())
    np.testing.assert_array_equal(profile[3], RED)
    np.testing.assert_array_equal(profile[[0, 6]], [BLUE, BLUE])
    assert measured == 60


def test_the_noise_of_a_profile_falls_with_its_samples():
    image = striped(RED, RED, noise=8)
    error = [np.abs(color_profiles(image, positions(10, 10 + count))[0] - RED).mean() for count in (3, 60)]
    assert error[1] < error[0] / 2


def test_a_highlight_on_a_few_samples_changes_nothing():
    image = striped(RED, BLUE)
    image[:, 20:40] = 255
    np.testing.assert_array_equal(color_profiles(image, positions())[0][3], RED)


def test_samples_beyond_the_image_are_not_measured():
    profile, measured = color_profiles(striped(RED, BLUE), positions(-20, 20))
    assert measured == 20
    np.testing.assert_array_equal(profile[3], RED)
    profile, measured = color_profiles(striped(RED, BLUE), positions() + np.nan)
    assert measured == 0
    assert np.isnan(profile).all()


def test_several_strands_are_measured_at_once():
    image = striped(RED, BLUE)
    both, _ = color_profiles(image, np.stack((positions(), positions() + np.array((0.0, 2.0)))))
    np.testing.assert_array_equal(both[0], color_profiles(image, positions())[0])
    assert both.shape == (2, 7, 3)


def test_colors_lie_between_those_of_the_pixels():
    image = np.zeros((2, 2, 3), np.uint8)
    image[:, 1] = 100
    np.testing.assert_allclose(colors_at(image, np.array([[(0.25, 0.0)]])), [[[25, 25, 25]]])


def test_medians_leave_out_unknown_values():
    values = np.array([[1.0, np.nan, 3.0, 5.0], [np.nan] * 4])
    np.testing.assert_array_equal(medians(values), [3, np.nan])


@pytest.mark.parametrize(("shown", "sign"), [(RED, 1), (BLUE, -1)])
def test_two_strands_of_two_colors_are_told_apart(shown, sign):
    seen = shown + np.random.default_rng(0).normal(0, 6, (1, 7, 7, 3))
    log_odds = first_strand_log_odds(seen, RED + np.zeros((1, 7, 1, 3)), BLUE + np.zeros((1, 1, 7, 3)))
    assert log_odds[0] == sign * MAX_LOG_RATIO * INDEPENDENT_COLORS / 2


def test_strands_of_one_color_and_colors_of_neither_tell_nothing():
    red = RED + np.zeros((1, 7, 7, 3))
    assert first_strand_log_odds(red, red, red + 2)[0] == 0
    between = (RED + BLUE) / 2 + np.zeros((1, 7, 7, 3))
    assert first_strand_log_odds(between, red, BLUE + np.zeros((1, 7, 7, 3)))[0] == 0
    assert first_strand_log_odds(red + np.nan, red, red)[0] == 0
