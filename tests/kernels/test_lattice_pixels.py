"""A part of a mask's pixels on a lattice, against all of its pixels."""

import numpy as np
import pytest

from doo3d.kernels import lattice_pixels


@pytest.mark.parametrize(("step", "slope"), [(1, 0), (2, 1), (5, 3), (13, 8), (3, 100)])
def test_pixels_are_those_of_the_lattice(step, slope):
    mask = np.random.default_rng(step).random((37, 61)) < 0.4
    mask[:, 20:24], mask[5] = False, True
    u, v = np.nonzero(mask.T)
    kept = (u + slope * v) % step == 0
    assert lattice_pixels(mask, step, slope).tolist() == np.column_stack((u, v))[kept].tolist()


def test_an_empty_mask_has_none():
    assert lattice_pixels(np.zeros((0, 0), bool), 1, 0).shape == (0, 2)
    assert lattice_pixels(np.zeros((4, 9), bool), 2, 1).shape == (0, 2)
