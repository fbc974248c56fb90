"""Select the pixels or points whose color lies in given ranges."""

import cv2
import numpy as np

from ...config import HsvRange, SegmentConfig
from ...errors import InputError
from ...types import Array, Bools, Cloud, Frame, Image


def in_ranges(color: Array, ranges: tuple[HsvRange, ...]) -> Bools:
    """Return which pixels of a color image lie in at least one of several color ranges, (H, W) bool.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    ranges
        boxes in OpenCV's 8-bit HSV (hue 0 to 179, saturation and value 0 to 255), bounds included. If the low hue is above the
        high hue, the box contains the hues from low to 179 and from 0 to high. Without ranges no pixel is selected.
    """
    hsv = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2HSV)
    inside = np.zeros(color.shape[:2], dtype=np.uint8)
    for box in ranges:
        spans = [(box.low[0], box.high[0])] if box.low[0] <= box.high[0] else [(box.low[0], 179), (0, box.high[0])]
        for low, high in spans:
            inside |= cv2.inRange(hsv, np.array((low, *box.low[1:])), np.array((high, *box.high[1:])))
    return np.asarray(inside > 0)


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Select the pixels, (H, W) bool, or the points of a cloud, (N,) bool, whose color lies in one of the configured ranges.

    Parameters
    ----------
    data
        a Frame, a Cloud or an Image, with color.
    config
        section `segment` of the settings: `ranges`.
    seed
        not used.

    Raises
    ------
    InputError : the data has no color.
    """
    is_cloud = isinstance(data, Cloud)
    color = data.colors if isinstance(data, Cloud) else data.color
    if color is None:
        missing = "cloud has no colors" if is_cloud else "frame has no color"
        raise InputError(f"segment.method is hsv but the {missing}: use everything, plane, or a mask", code="method-needs-color")
    return in_ranges(color[:, None], config.ranges)[:, 0] if is_cloud else in_ranges(color, config.ranges)
