"""Agreement of a depth reading with its neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import count_agreeing_neighbors, sigma_filter


def slow_agreement(depth, mask, v, u, half, tolerance):
    support, among, means = [], [], []
    for row, column in zip(v, u, strict=True):
        here = float(depth[row, column])
        agree, there = [here], 0
        for dv in range(-half, half + 1):
            for du in range(-half, half + 1):
                y, x = row + dv, column + du
                if (dv, du) == (0, 0) or not (0 <= y < depth.shape[0] and 0 <= x < depth.shape[1]):
                    continue
                z = float(depth[y, x])
                if not mask[y, x] or z <= 0:
                    continue
                there += 1
                if abs(np.float32(z) - np.float32(here)) < tolerance * max(abs(dv), abs(du)):
                    agree.append(z)
        support.append(len(agree) - 1)
        among.append(there)
        means.append(np.mean(agree))
    return np.array(support), np.array(among), np.array(means)


@pytest.mark.parametrize("half", [1, 2, 4])
@pytest.mark.parametrize("seed", range(3))
def test_against_plain_loops(seed, half):
    random = np.random.default_rng(seed)
    depth = (0.5 + 0.004 * random.normal(size=(17, 23))).astype(np.float32)
    depth[random.random(depth.shape) < 0.2] = 0
    mask = random.random(depth.shape) < 0.8
    v, u = np.nonzero(mask & (depth > 0))
    support, among, mean = count_agreeing_neighbors(depth, mask, v, u, half, 0.003)
    slow_support, slow_among, slow_mean = slow_agreement(depth, mask, v, u, half, 0.003)
    np.testing.assert_array_equal(support, slow_support)
    np.testing.assert_array_equal(among, slow_among)
    np.testing.assert_allclose(mean, slow_mean, rtol=1e-6)


def test_a_flying_point_stands_alone():
    depth = np.full((9, 9), 0.5, np.float32)
    depth[:, 5:] = 0.6
    depth[4, 4] = 0.55
    support, among, mean = count_agreeing_neighbors(depth, np.ones((9, 9), bool), np.array([4, 4]), np.array([4, 2]), 2, 0.003)
    assert support[0] == 0
    assert among[0] == 24
    assert mean[0] == pytest.approx(0.55)
    assert support[1] == 23
    assert mean[1] == pytest.approx(0.5)


def test_the_sigma_filter_reduces_noise_and_keeps_depth_steps():
    depth = (0.8 + 0.002 * np.random.default_rng(0).normal(size=(40, 400))).astype(np.float32)
    mask = np.zeros(depth.shape, bool)
    mask[15:25] = True
    depth[20:25] += 0.1
    v, u = np.nonzero(mask)
    mean = sigma_filter(depth, mask, v, u, 10, 0.012)
    true = np.where(v < 20, 0.8, 0.9)
    assert np.abs(mean - true).max() < 0.001
    assert (mean - true).std() < 0.0004
