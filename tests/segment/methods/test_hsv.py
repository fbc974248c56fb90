"""The object by its color."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.errors import refuses

from doo3d.config import HsvRange, SegmentConfig
from doo3d.segment.methods.hsv import in_ranges, mask
from doo3d.types import Camera, Cloud, Frame

CAMERA = Camera(fx=100.0, fy=100.0, cx=16.0, cy=16.0, width=32, height=32)
RED, ORANGE, GREEN, BLUE, GREY = (255, 0, 0), (255, 128, 0), (0, 255, 0), (0, 0, 255), (128, 128, 128)


def ranges(*boxes):
    return tuple(HsvRange(low=low, high=high) for low, high in boxes)


WARM = ((170, 100, 100), (10, 255, 255))


def picture(*colors):
    """One row of each color."""
    return np.repeat(np.array(colors, np.uint8)[:, None], 32, axis=1)


@pytest.mark.parametrize(
    ("box", "found"),
    [
        (((0, 100, 100), (10, 255, 255)), [True, False, False, False, False]),
        (((10, 100, 100), (20, 255, 255)), [False, True, False, False, False]),
        (((50, 0, 0), (70, 255, 255)), [False, False, True, False, False]),
        (((170, 100, 100), (20, 255, 255)), [True, True, False, False, False]),
        (((100, 0, 0), (70, 255, 255)), [True, True, True, True, True]),
        (((0, 0, 0), (179, 50, 255)), [False, False, False, False, True]),
        (((0, 0, 200), (179, 255, 255)), [True, True, True, True, False]),
    ],
)
def test_boxes(box, found):
    inside = in_ranges(picture(RED, ORANGE, GREEN, BLUE, GREY), ranges(box))
    assert inside.shape == (5, 32)
    assert inside.all(axis=1).tolist() == found
    assert inside.any(axis=1).tolist() == found


def test_both_ends_belong_to_a_box():
    """Every hue once; and a box that wraps is the rest of the one that does not."""
    hues = np.stack((np.arange(180), np.full(180, 255), np.full(180, 255)), axis=-1).astype(np.uint8)[None]
    color = cv2.cvtColor(hues, cv2.COLOR_HSV2RGB)
    exact = cv2.cvtColor(color, cv2.COLOR_RGB2HSV)[0, :, 0].astype(int)
    straight = in_ranges(color, ranges(((20, 0, 0), (160, 255, 255))))[0]
    wrapped = in_ranges(color, ranges(((160, 0, 0), (20, 255, 255))))[0]
    np.testing.assert_array_equal(straight, (exact >= 20) & (exact <= 160))
    np.testing.assert_array_equal(wrapped, (exact >= 160) | (exact <= 20))


def test_boxes_are_joined():
    both = in_ranges(picture(RED, GREEN, BLUE), ranges(((0, 100, 100), (5, 255, 255)), ((115, 0, 0), (125, 255, 255))))
    assert both.all(axis=1).tolist() == [True, False, True]


def test_frame_and_cloud_alike():
    color = np.random.default_rng(0).integers(0, 256, (32, 32, 3)).astype(np.uint8)
    config = SegmentConfig(method="hsv", ranges=ranges(WARM))
    frame = mask(Frame(color, np.ones((32, 32), np.float32), CAMERA), config, 0)
    cloud = mask(Cloud(np.random.default_rng(0).random((1024, 3)), colors=color.reshape(-1, 3)), config, 0)
    assert frame.shape == (32, 32)
    np.testing.assert_array_equal(cloud, frame.ravel())
    assert 0 < frame.sum() < 1024


@pytest.mark.parametrize("data", [Frame(None, np.ones((32, 32), np.float32), CAMERA), Cloud(np.random.rand(9, 3))])  # noqa: NPY002
def test_no_color(data):
    with refuses("method-needs-color", "hsv"):
        mask(data, SegmentConfig(method="hsv", ranges=ranges(WARM)), 0)
