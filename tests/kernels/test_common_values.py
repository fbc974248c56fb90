"""The half-width of a strand and the hues of an object, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import hue_modes, usual_half_width


def slow_half_width(half_width, least, bin_width, share):
    """Return what `usual_half_width` returns."""
    half_width = half_width[half_width >= least].astype(float)
    if not len(half_width):
        return 0.0
    logs = np.log(half_width)
    edges = np.arange(np.log(least), logs.max() + 4 * bin_width, bin_width)
    count = np.histogram(logs, edges)[0].astype(float)
    near, middle = np.convolve(count, np.ones(5))[2:-2], (edges[1:] + edges[:-1]) / 2
    for k in np.flatnonzero(near >= share * len(half_width)):
        if near[k] >= near[max(0, k - 4) : k + 5].max():
            around = slice(max(0, k - 2), k + 3)
            return np.exp(np.average(middle[around], weights=count[around]))
    return 0.0


def slow_modes(hue, weight, bins, deviation, max_saddle):
    """Return what `hue_modes` returns."""
    count, angle = np.bincount(hue, weight, bins), np.arange(bins)
    apart = (angle[:, None] - angle + bins // 2) % bins - bins // 2
    kernel = np.exp(-((apart / deviation) ** 2) / 2)
    height = kernel @ count / kernel[0].sum()
    if not height.any():
        return np.zeros(bins, dtype=int)
    cuts = np.flatnonzero((height < np.roll(height, 1)) & (height <= np.roll(height, -1))).tolist()
    while len(cuts) > 1:
        ends = cuts[1:] + cuts[:1]
        parts = [np.arange(a, b if b > a else b + bins) % bins for a, b in zip(cuts, ends, strict=True)]
        peak = [height[part].max() for part in parts]
        saddle = np.array([height[cut] / min(peak[k - 1], peak[k]) for k, cut in enumerate(cuts)])
        if saddle.max() <= max_saddle:
            break
        cuts.pop(int(np.argmax(saddle)))
    number = np.searchsorted(cuts, angle, side="right")
    return np.where(number == 0, max(len(cuts), 1), number)


@pytest.mark.parametrize("seed", range(8))
def test_the_least_half_width_that_is_frequent(seed):
    rng = np.random.default_rng(seed)
    half_width = np.concatenate([rng.normal(rng.uniform(1, 12), 0.2, rng.integers(3, 200)) for _ in range(4)]).astype(np.float32)
    half_width = np.abs(half_width)
    assert usual_half_width(half_width, 0.9, 0.05, 0.12) == pytest.approx(slow_half_width(half_width, 0.9, 0.05, 0.12), rel=1e-6)


def test_no_strand_has_no_half_width():
    assert usual_half_width(np.zeros(0, dtype=np.float32), 0.9, 0.05, 0.12) == 0
    assert usual_half_width(np.full(9, 0.5, dtype=np.float32), 0.9, 0.05, 0.12) == 0


@pytest.mark.parametrize("seed", range(8))
def test_hues_are_parted_at_low_saddles(seed):
    rng = np.random.default_rng(seed)
    middle = rng.integers(0, 72, 4)
    hue = (rng.choice(middle, 800) + rng.normal(0, 3, 800).round().astype(np.int64)) % 72
    weight = rng.random(800).astype(np.float32)
    np.testing.assert_array_equal(hue_modes(hue, weight, 72, 1.5, 0.4), slow_modes(hue, weight, 72, 1.5, 0.4))


def test_an_object_without_hue_has_no_modes():
    assert not hue_modes(np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.float32), 72, 1.5, 0.4).any()
