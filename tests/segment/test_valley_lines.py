"""Ends of lines against windows cut out of an image of their numbers."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from doo3d.kernels import mask_parts
from doo3d.segment.valley_lines import find_line_ends


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.sampled_from([(30, 40), (1, 30), (25, 2)]))
def test_ends_as_by_windows_around_them(seed, window, shape):
    random = np.random.default_rng(seed)
    mask = random.random(shape) < 0.2
    pixels, starts, _, _ = mask_parts(mask, mask.size, np.zeros(0, int))
    label = np.full(shape, -1)
    label.ravel()[pixels] = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    around = cv2.filter2D(mask.astype(np.uint8), -1, np.ones((3, 3)), borderType=cv2.BORDER_CONSTANT)
    padded = np.pad(label, window, constant_values=-1)
    expected = []
    for y, x in np.argwhere(mask & (around == 2)):
        offsets = np.argwhere(padded[y : y + 2 * window + 1, x : x + 2 * window + 1] == label[y, x]) - window
        back = offsets.mean(axis=0)
        if np.hypot(*back) > 1e-9:
            expected.append((label[y, x], y, x, *(-back / np.hypot(*back))))
    line, position, direction = find_line_ends(pixels, starts, label, window)
    found = np.column_stack((line, position, direction))
    np.testing.assert_allclose(found, np.reshape(expected, (-1, 5)), atol=1e-9)
