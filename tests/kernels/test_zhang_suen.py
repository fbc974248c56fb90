"""Thinning of masks: against Zhang and Suen's rule by plain loops, and what must hold whatever the mask."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from skimage.measure import euler_number, label

from doo3d.kernels import thin_pixels

ROUND = [(-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1)]


def blob(seed, blur, share=0.5):
    noise = cv2.GaussianBlur(np.random.default_rng(seed).random((50, 60)), (0, 0), blur)
    return np.pad(noise > np.quantile(noise, 1 - share), 1)


def thinned(mask):
    """The skeleton of a mask (H, W) whose border is free, as the kernel has it."""
    coords = np.argwhere(mask).astype(np.int64)
    result = np.zeros_like(mask)
    result[tuple(coords[thin_pixels(coords)].T)] = True
    return result


def around(image, row, column):
    return [int(image[row + v, column + u]) for v, u in ROUND]


def wanted(near, half):
    """Zhang and Suen's conditions for P1, its neighbours P2 to P9."""
    rises = sum(a == 0 and b == 1 for a, b in zip(near, near[1:] + near[:1], strict=True))
    p2, p4, p6, p8 = near[::2]
    sides = (p2 * p4 * p6, p4 * p6 * p8) if half == 0 else (p2 * p4 * p8, p2 * p6 * p8)
    return 2 <= sum(near) <= 6 and rises == 1 and sides == (0, 0)


def may_go(near):
    """No end, and without its middle the 3 x 3 window has as many pieces, and as many holes, as with it."""
    window = np.zeros((5, 5), int)
    for (v, u), value in zip(ROUND, near, strict=True):
        window[2 + v, 2 + u] = value
    without = (label(window, connectivity=2).max(), euler_number(window, connectivity=2))
    window[2, 2] = 1
    return sum(near) > 1 and without == (label(window, connectivity=2).max(), euler_number(window, connectivity=2))


def slow_thinned(mask):
    image = mask.copy()
    changed = True
    while changed:
        changed = False
        for half in range(2):
            for row, column in [place for place in np.argwhere(image) if wanted(around(image, *place), half)]:
                if may_go(around(image, row, column)):
                    image[row, column] = False
                    changed = True
    for row, column in np.argwhere(image):
        if may_go(around(image, row, column)):
            image[row, column] = False
    return image


@pytest.mark.parametrize(("seed", "blur"), [(0, 0.1), (1, 1.0), (2, 2.0), (3, 4.0)])
def test_against_plain_loops(seed, blur):
    mask = blob(seed, blur)
    np.testing.assert_array_equal(thinned(mask), slow_thinned(mask))


@pytest.mark.parametrize("blur", [0.8, 1.5, 3.0, 6.0])
@pytest.mark.parametrize("seed", range(4))
def test_pieces_and_holes_stay_and_nothing_is_left_that_could_go(seed, blur):
    mask = blob(seed, blur, 0.3 + 0.1 * seed)
    skeleton = thinned(mask)
    assert not (skeleton & ~mask).any()
    assert label(skeleton, connectivity=2).max() == label(mask, connectivity=2).max()
    assert euler_number(skeleton, connectivity=2) == euler_number(mask, connectivity=2)
    assert not any(may_go(around(skeleton, row, column)) for row, column in np.argwhere(skeleton))


def test_a_pixel_alone_and_a_line_stay():
    mask = np.zeros((12, 30), bool)
    mask[3, 4] = mask[8, 2:25] = True
    np.testing.assert_array_equal(thinned(mask), mask)
