"""Hysteresis threshold: the kernel against connected components."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from doo3d.kernels import hysteresis


def slow_hysteresis(image, low, high):
    label, count = ndimage.label(image > low, np.ones((3, 3)))
    return np.isin(label, [i for i in range(1, count + 1) if (image[label == i] > high).any()])


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (17, 23)])
def test_components_with_a_seed_are_kept_whole(seed, shape):
    image = np.random.default_rng(seed).random(shape).astype(np.float32)
    found = hysteresis(image, 0.6, 0.9)
    np.testing.assert_array_equal(found, slow_hysteresis(image, np.float32(0.6), np.float32(0.9)))
    assert found.any()
    assert not found.all()


def test_a_diagonal_connects_and_a_gap_does_not():
    image = np.diag(np.full(6, 0.5)).astype(np.float32)
    image[0, 0], image[3, 3] = 1.0, 0.0
    found = hysteresis(image, 0.4, 0.9)
    np.testing.assert_array_equal(np.flatnonzero(found.diagonal()), [0, 1, 2])
    assert found.sum() == 3


def test_not_a_number_is_above_nothing():
    image = np.array([[1.0, np.nan, 0.7]], np.float32)
    np.testing.assert_array_equal(hysteresis(image, 0.5, 0.9), [[True, False, False]])


def test_thresholds_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match="low is above high"):
        hysteresis(np.zeros((2, 2), np.float32), 0.5, 0.4)
