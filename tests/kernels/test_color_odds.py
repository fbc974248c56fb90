"""Log-odds of colors against histograms by NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from doo3d.kernels import ColorOdds

SHADES, SHARE, LEAST, SIGMA = np.array([0.85, 0.5]), 0.03, 1e-5, 0.6


def cells(colors):
    level = (colors >> 4).astype(int)
    return 256 * level[..., 0] + 16 * level[..., 1] + level[..., 2]


def counts(colors):
    return np.bincount(cells(colors), minlength=4096).astype(float)


def frequencies(count):
    smooth = gaussian_filter(count.reshape(16, 16, 16), SIGMA, mode="nearest").ravel()
    total = max(smooth.sum(), 1e-9)
    return smooth / total + LEAST, total


@given(st.integers(0, 2**32 - 1), st.integers(1, 300), st.integers(0, 300))
def test_log_odds_as_by_numpy(seed, ours, theirs):
    random = np.random.default_rng(seed)
    image = random.integers(0, random.integers(2, 257), (20, 30, 3), np.uint8)
    inside, around = (random.integers(0, 600, size) for size in (ours, theirs))
    learned = ColorOdds(image, inside, around, SHADES, SHARE, SIGMA, LEAST)
    found, every = learned.log_odds, np.indices((30, 20)).reshape(2, -1).T
    surround = image.reshape(-1, 3)[around]
    background = counts(surround) + SHARE * sum(counts((surround * shade).astype(np.uint8)) for shade in SHADES)
    (own, pixels), (other, beside) = frequencies(counts(image.reshape(-1, 3)[inside])), frequencies(background)
    expected = np.log(own / other).astype(np.float32)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-12)
    shown = cells(image[every[:, 1], every[:, 0]])
    np.testing.assert_array_equal(learned.log_odds_at(every), found[shown])
    noise = np.sqrt(1 / (own * pixels) + 1 / (other * beside))
    np.testing.assert_allclose(learned.noise_at(every), noise[shown], rtol=1e-6)
    assert learned.separation == np.median(found[cells(image.reshape(-1, 3)[inside])])


def test_without_pixels_nothing_is_told():
    none = np.zeros(0, np.int64)
    learned = ColorOdds(np.zeros((2, 2, 3), np.uint8), none, none, SHADES, SHARE, SIGMA, LEAST)
    assert not learned.log_odds.any()
    assert learned.separation == 0


def test_pixels_beyond_the_image_are_refused():
    image, some = np.zeros((2, 2, 3), np.uint8), np.array([0])
    for pixels in (np.array([4]), np.array([-1])):
        with pytest.raises(ValueError, match="pixel"):
            ColorOdds(image, pixels, some, SHADES, SHARE, SIGMA, LEAST)
        with pytest.raises(ValueError, match="pixel"):
            ColorOdds(image, some, pixels, SHADES, SHARE, SIGMA, LEAST)
    with pytest.raises(ValueError, match="shade"):
        ColorOdds(image, some, some, np.array([1.5]), SHARE, SIGMA, LEAST)
    with pytest.raises(ValueError, match="smoothing"):
        ColorOdds(image, some, some, SHADES, SHARE, 0.0, LEAST)


def test_only_pixels_of_the_image_are_asked():
    learned = ColorOdds(np.zeros((2, 3, 3), np.uint8), np.array([0]), np.array([1]), SHADES, SHARE, SIGMA, LEAST)
    assert learned.log_odds_at(np.array([(2, 1)])).shape == (1,)
    for pixel in ((3, 0), (0, 2), (-1, 0), (0, -1)):
        with pytest.raises(ValueError, match="pixel"):
            learned.log_odds_at(np.array([pixel]))
    with pytest.raises(ValueError, match="pixels"):
        learned.noise_at(np.zeros((1, 3), np.int64))
