"""Pixels near a mask, against the distance transform of OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import near_mask


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
