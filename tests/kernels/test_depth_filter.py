"""Agreement of a depth reading with its neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import agreeing_readings, depth_differences, readings_in_mask


def slow_agreement(depth, mask, row, column, half, slope):
    """The number of neighbours that agree, of all with a reading, and the mean of those that agree and the reading itself."""
    here = depth[row, column]
    agree, there = [float(here)], 0
    for y in range(max(row - half, 0), min(row + half + 1, depth.shape[0])):
        for x in range(max(column - half, 0), min(column + half + 1, depth.shape[1])):
            if (y, x) == (row, column) or not mask[y, x] or depth[y, x] <= 0:
                continue
            there += 1
            if abs(depth[y, x] - here) < slope * max(abs(y - row), abs(x - column)):
                agree.append(float(depth[y, x]))
    return len(agree) - 1, there, np.mean(agree)


def noisy_depth(seed):
    random = np.random.default_rng(seed)
    depth = (0.5 + 0.004 * random.normal(size=(17, 23))).astype(np.float32)
    depth[random.random(depth.shape) < 0.2] = 0
    return depth, random.random(depth.shape) < 0.8


@pytest.mark.parametrize("half", [1, 2, 4])
@pytest.mark.parametrize("seed", range(3))
def test_against_plain_loops(seed, half):
    depth, mask = noisy_depth(seed)
    low, high, needed = 0.495, 0.508, 7
    expected, dropped = [], 0
    for row, column in zip(*np.nonzero(mask & (depth >= low) & (depth <= high)), strict=True):
        support, among, mean = slow_agreement(depth, mask, row, column, half, 0.003)
        if support >= min(needed, among / 2):
            expected.append((row, column, mean))
        else:
            dropped += 1
    assert dropped > 10 or half > 2
    assert len(expected) > 10
    rows, columns, mean, number = agreeing_readings(depth, mask, low, high, half, 0.003, needed)
    assert number == dropped
    np.testing.assert_array_equal(np.column_stack((rows, columns)), [found[:2] for found in expected])
    np.testing.assert_allclose(mean, [found[2] for found in expected], rtol=1e-6)


def test_a_flying_point_stands_alone():
    depth = np.full((9, 9), 0.5, np.float32)
    depth[:, 5:] = 0.6
    depth[4, 4] = 0.55
    rows, columns, mean, dropped = agreeing_readings(depth, np.ones((9, 9), bool), 0.1, 10.0, 2, 0.003, 7)
    assert dropped == 1
    assert (4, 4) not in zip(rows, columns, strict=True)
    assert mean[(rows == 4) & (columns == 2)] == pytest.approx(0.5)


def test_readings_and_differences_of_a_mask():
    depth, mask = noisy_depth(0)
    readings = np.where(mask, depth, 0)
    np.testing.assert_array_equal(readings_in_mask(depth, mask), readings[readings > 0])
    both = (readings[:, 1:] > 0) & (readings[:, :-1] > 0)
    np.testing.assert_array_equal(depth_differences(depth, mask), np.abs(np.diff(readings, axis=1)[both]))
