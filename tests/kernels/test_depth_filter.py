"""Depth readings of a mask: their median and noise, and their agreement with their neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import FrameFacts


def slow_agreement(depth, mask, row, column, half, slope, median, beyond):
    """The number of neighbours that agree, of all with a reading, and the mean of those that agree and the reading itself."""
    here = depth[row, column]
    agree, there = [float(here)], 0
    for y in range(max(row - half, 0), min(row + half + 1, depth.shape[0])):
        for x in range(max(column - half, 0), min(column + half + 1, depth.shape[1])):
            if (y, x) == (row, column) or not mask[y, x] or depth[y, x] <= 0:
                continue
            there += 1
            if abs(depth[y, x] - here) < slope * max(abs(y - row), abs(x - column)) * (here / median if here > beyond else 1):
                agree.append(float(depth[y, x]))
    return len(agree) - 1, there, np.mean(agree)


def noisy_depth(seed):
    random = np.random.default_rng(seed)
    depth = (0.5 + 0.004 * random.normal(size=(17, 23))).astype(np.float32)
    depth[random.random(depth.shape) < 0.2] = 0
    return depth, random.random(depth.shape) < 0.8


@pytest.mark.parametrize("median", [0.4, 0.5, 0.6])
@pytest.mark.parametrize("half", [1, 2, 4])
@pytest.mark.parametrize("seed", range(3))
def test_against_plain_loops(seed, half, median):
    depth, mask = noisy_depth(seed)
    low, high, needed = 0.495, 0.508, 7
    beyond = np.float32(2) * np.float32(median) - depth[mask & (depth >= low)].min()
    expected, dropped = [], 0
    for row, column in zip(*np.nonzero(mask & (depth >= low) & (depth <= high)), strict=True):
        support, among, mean = slow_agreement(depth, mask, row, column, half, 0.003, median, beyond)
        if support >= min(needed, among / 2):
            expected.append((row, column, mean))
        else:
            dropped += 1
    assert dropped > 10 or half > 2 or median < 0.5
    assert len(expected) > 10
    pixels, own, mean, number = FrameFacts(mask, depth).agreeing_readings(low, high, half, 0.003, median, needed)
    assert number == dropped
    np.testing.assert_array_equal(pixels[:, ::-1], [found[:2] for found in expected])
    np.testing.assert_array_equal(own, [depth[found[:2]] for found in expected])
    np.testing.assert_allclose(mean, [found[2] for found in expected], rtol=1e-6)


def test_a_flying_point_stands_alone():
    depth = np.full((9, 9), 0.5, np.float32)
    depth[:, 5:] = 0.6
    depth[4, 4] = 0.55
    pixels, _, mean, dropped = FrameFacts(np.ones((9, 9), bool), depth).agreeing_readings(0.1, 10.0, 2, 0.003, 1, 7)
    assert dropped == 1
    assert [4, 4] not in pixels.tolist()
    assert mean[(pixels == (2, 4)).all(axis=1)] == pytest.approx(0.5)


@pytest.mark.parametrize("seed", range(6))
def test_median_and_noise_against_numpy(seed):
    depth, mask = noisy_depth(seed)
    readings = np.where(mask, depth, 0)
    both = (readings[:, 1:] > 0) & (readings[:, :-1] > 0)
    expected = (readings > 0).sum(), np.median(readings[readings > 0]), np.median(np.abs(np.diff(readings, axis=1)[both]))
    assert FrameFacts(mask, depth).depth_summary() == expected


@pytest.mark.parametrize("seed", range(6))
def test_the_deviation_of_inverse_depth_against_numpy(seed):
    depth, mask = noisy_depth(seed)
    known = mask & (depth > 0)
    inverse = np.where(known, 1 / np.where(known, depth, 1).astype(float), np.nan)
    bends = np.abs(inverse[:, :-2] - 2 * inverse[:, 1:-1] + inverse[:, 2:])
    steps = np.abs(np.diff(inverse, axis=1))
    smaller = [np.sort(some[np.isfinite(some)])[: int(0.75 * np.isfinite(some).sum())].mean() for some in (steps, bends)]
    jumps = np.sort(steps[steps > 0])
    expected = np.hypot(max(smaller / np.sqrt((2, 6))) / 0.5149, jumps[len(jumps) // 4] / np.sqrt(12))
    assert FrameFacts(mask, depth).inverse_depth_deviation(mask.size) == pytest.approx(expected, rel=1e-9)


def test_without_readings_all_is_zero():
    facts = FrameFacts(np.ones((3, 4), bool), np.zeros((3, 4), np.float32))
    assert facts.depth_summary() == (0, 0.0, 0.0)
    assert facts.inverse_depth_deviation(100) == 0
    with pytest.raises(ValueError, match="pixels"):
        facts.inverse_depth_deviation(0)


def test_without_depth_there_is_no_summary():
    facts = FrameFacts(np.ones((3, 4), bool))
    with pytest.raises(ValueError, match="made without depth"):
        facts.depth_summary()
    with pytest.raises(ValueError, match="made without depth"):
        facts.inverse_depth_deviation(100)
    with pytest.raises(ValueError, match="made without depth"):
        facts.agreeing_readings(0.1, 1.0, 2, 0.01, 1, 7)
