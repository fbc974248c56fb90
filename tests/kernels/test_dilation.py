"""Pixels near a mask, against the distance transform of OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import largest_within, near_mask


@pytest.mark.parametrize("reach", [0.0, 0.9, 1.0, 1.5, 3.3, 7.25, 60.0])
@pytest.mark.parametrize("share", [0.001, 0.02, 0.4])
def test_against_a_distance_transform(reach, share):
    mask = np.random.default_rng(int(10 * reach)).random((37, 53)) < share
    mask[5, 7] = True
    distance = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5)
    np.testing.assert_array_equal(near_mask(mask, reach, True), distance <= reach + 1e-4)
    np.testing.assert_array_equal(near_mask(mask, reach, False), distance < reach - 1e-4)


def test_nothing_is_near_an_empty_mask():
    assert not near_mask(np.zeros((4, 6), bool), 100.0, True).any()


def test_a_negative_reach_is_refused():
    with pytest.raises(ValueError, match="reach is negative"):
        near_mask(np.ones((4, 6), bool), -1.0, True)


def test_a_disc_with_holes_is_widened_in_all_directions():
    mask = np.zeros((80, 90), np.uint8)
    cv2.circle(mask, (45, 40), 20, 1, -1)
    mask[30:34, 40:44] = mask[45, 50] = mask[21, 40:50] = 0
    distance = cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5)
    for reach in (1.0, 2.3, 9.0):
        np.testing.assert_array_equal(near_mask(mask > 0, reach, True), distance <= reach + 1e-4)


@pytest.mark.parametrize(("shape", "radius"), [((50, 70), 3), ((20, 90), 33), ((100, 40), 1), ((30, 30), 0), ((1, 5), 9)])
def test_the_largest_within_a_radius_is_a_dilation_by_an_ellipse(shape, radius):
    random = np.random.default_rng(0)
    values, wanted = random.normal(size=shape).astype(np.float32), random.random(shape) < 0.7
    ellipse = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    half = ellipse[radius:].sum(axis=1, dtype=np.int64) // 2
    expected = np.where(wanted, cv2.dilate(values, ellipse), 0)
    np.testing.assert_array_equal(largest_within(values, wanted, half), expected)


def test_windows_that_make_no_sense_are_refused():
    values, wanted = np.zeros((3, 4), np.float32), np.ones((3, 4), bool)
    for half, others, message in (([], wanted, "no row"), ([1, -1], wanted, "negative"), ([1], wanted[:2], "differ in shape")):
        with pytest.raises(ValueError, match=message):
            largest_within(values, others, np.array(half, np.int64))
