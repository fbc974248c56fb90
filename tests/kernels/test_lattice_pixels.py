"""A part of a mask's pixels on a lattice, against all of its pixels."""

import math

import numpy as np
import pytest
from scipy.constants import golden

from doo3d.kernels import FrameFacts


@pytest.mark.parametrize("most", [5000, 600, 300, 100, 20])
def test_pixels_are_those_of_the_lattice(most):
    mask = np.random.default_rng(most).random((37, 61)) < 0.4
    mask[:, 20:24], mask[5] = False, True
    u, v = np.nonzero(mask.T)
    step = math.ceil(len(u) / most)
    slope = min((k for k in range(1, step) if math.gcd(k, step) == 1), key=lambda k: abs(k - step / golden), default=0)
    kept = (u + slope * v) % step == 0
    pixels, share = FrameFacts(mask).lattice_pixels(most, golden)
    assert pixels.tolist() == np.column_stack((u, v))[kept].tolist()
    assert share == len(u) / len(pixels)


def test_an_empty_mask_has_none():
    for shape in ((0, 0), (4, 9)):
        pixels, share = FrameFacts(np.zeros(shape, bool)).lattice_pixels(2, golden)
        assert pixels.shape == (0, 2)
        assert share == 0
