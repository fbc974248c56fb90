"""Readings deep inside surfaces, against OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d.kernels import wide_readings


def plain(depth, stride, scale, max_depth, half_width):
    depth = depth[::stride, ::stride]
    seen = cv2.morphologyEx((depth > 0).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    inside = cv2.distanceTransform(np.pad(seen, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
    inside *= scale * np.minimum(depth, max_depth)
    return np.count_nonzero((inside > half_width) & (depth > 0)), np.count_nonzero(depth > 0)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("holes", [0.0, 0.05, 0.3])
@pytest.mark.parametrize(("shape", "stride"), [((120, 160), 4), ((121, 163), 4), ((1, 40), 1), ((40, 1), 1), ((50, 60), 1)])
def test_as_opencv(shape, stride, holes, seed):
    random = np.random.default_rng(seed)
    depth = random.uniform(0.4, 0.9, shape).astype(np.float32)
    depth[random.random(shape) < holes] = 0
    depth[:, : shape[1] // 4] = 0
    arguments = (stride, 0.004, 0.8, 0.01)
    assert wide_readings(depth, *arguments) == plain(depth, *arguments)


def test_without_readings_there_are_none():
    assert wide_readings(np.full((9, 9), np.nan, np.float32), 2, 0.1, 3.0, 0.01) == (0, 0)


def test_a_stride_of_nothing_is_refused():
    with pytest.raises(ValueError, match="stride"):
        wide_readings(np.ones((3, 3), np.float32), 0, 0.1, 3.0, 0.01)
