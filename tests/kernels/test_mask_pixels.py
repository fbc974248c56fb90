"""Bounding box and pixels of a mask, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.kernels import FrameFacts, bounding_box


@pytest.mark.parametrize("shape", [(1, 1), (3, 40), (40, 3), (17, 23)])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.2, 1.0])
def test_random_masks(shape, share):
    for seed in range(20):
        mask = np.random.default_rng(seed).random(shape) < share
        v, u = np.nonzero(mask)
        assert FrameFacts(mask).pixel_list().tolist() == sorted(map(list, zip(u.tolist(), v.tolist(), strict=True)))
        expected = (v.min(), v.max() + 1, u.min(), u.max() + 1) if len(u) else (0, 0, 0, 0)
        assert bounding_box(mask) == expected


@pytest.mark.parametrize("size", range(1, 40))
def test_one_pixel_anywhere(size):
    for at in range(size):
        mask = np.zeros((3, size), bool)
        mask[1, at] = True
        assert bounding_box(mask) == (1, 2, at, at + 1)
        assert bounding_box(np.ascontiguousarray(mask.T)) == (at, at + 1, 1, 2)


def test_any_byte_but_zero_is_true():
    mask = np.array([[0, 255], [0, 2]], np.uint8).view(bool)
    assert bounding_box(mask) == (0, 2, 1, 2)
    assert FrameFacts(mask).pixel_list().tolist() == [[1, 0], [1, 1]]


def test_no_rows():
    assert bounding_box(np.zeros((0, 5), bool)) == (0, 0, 0, 0)
    assert FrameFacts(np.zeros((0, 0), bool)).pixel_list().shape == (0, 2)
