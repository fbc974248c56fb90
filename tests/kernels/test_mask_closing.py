"""Closed gaps of a mask, and its long parts, against OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from doo3d.kernels import FrameFacts, close_mask, long_parts


def ellipse(px):
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * px + 1, 2 * px + 1))


@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.floats(0, 12), st.sampled_from([(40, 150), (1, 70), (64, 3)]))
def test_closed_as_by_opencv_on_a_wider_image(seed, px, distance, shape):
    random = np.random.default_rng(seed)
    noise = cv2.GaussianBlur(random.normal(size=shape).astype(np.float32), (0, 0), 3)
    mask = noise > np.quantile(noise, random.random())
    closed, deep = close_mask(mask, ellipse(px)[px:].sum(axis=1, dtype=np.int64) // 2, distance)
    padded = cv2.morphologyEx(np.pad(mask, px).astype(np.uint8), cv2.MORPH_CLOSE, ellipse(px))
    np.testing.assert_array_equal(closed, padded[px:-px, px:-px] > 0)
    inside = cv2.distanceTransform(np.pad(closed, 1).astype(np.uint8), cv2.DIST_L2, 5)
    assert np.count_nonzero(inside > distance + 1e-3) <= deep <= np.count_nonzero(inside > distance - 1e-3)
    assert FrameFacts(np.pad(mask, 2)).closed_core(ellipse(px)[px:].sum(axis=1, dtype=np.int64) // 2, distance) == deep


@pytest.mark.parametrize("half_widths", [[3], [0, 0, 0]])
def test_nothing_is_added_beyond_the_mask(half_widths):
    mask = np.zeros((9, 30), bool)
    mask[4, [3, 8, 9, 20]] = True
    closed, _ = close_mask(mask, np.array(half_widths), 0.0)
    expected = mask.copy()
    expected[4, 3:9] = half_widths[0] > 1
    np.testing.assert_array_equal(closed, mask | expected)


def test_shapes_that_widen_are_refused():
    for half_widths in ([0, 1], [-1], []):
        with pytest.raises(ValueError, match="half_widths"):
            close_mask(np.ones((9, 9), bool), np.array(half_widths, np.int64), 0.0)


@given(st.integers(0, 2**32 - 1), st.integers(0, 12), st.sampled_from([(40, 150), (1, 70), (64, 3)]))
def test_long_parts_as_by_labels(seed, extent, shape):
    random = np.random.default_rng(seed)
    mask = random.random(shape) < random.uniform(0, 0.6)
    _, label, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    long = stats[:, cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1].max(axis=1) >= extent
    np.testing.assert_array_equal(long_parts(mask, extent), mask & long[label])
