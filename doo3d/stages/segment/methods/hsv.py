"""The object has a colour of its own."""

from __future__ import annotations

import cv2
import numpy as np

from ....config import HsvRange, SegmentConfig
from ....errors import InputError
from ....types import Array, Bools, Cloud, Frame, Image


def in_ranges(color: Array, ranges: tuple[HsvRange, ...]) -> Bools:
    """(H, W, 3) uint8 RGB -> (H, W) bool, inside any of the boxes of OpenCV's 8-bit HSV; low hue above high wraps."""
    hsv = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2HSV)
    found = np.zeros(color.shape[:2], dtype=np.uint8)
    for box in ranges:
        spans = [(box.low[0], box.high[0])] if box.low[0] <= box.high[0] else [(box.low[0], 179), (0, box.high[0])]
        for low, high in spans:
            found |= cv2.inRange(hsv, np.array((low, *box.low[1:])), np.array((high, *box.high[1:])))
    return np.asarray(found > 0)


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Pixels or points whose colour lies in one of `config.ranges`.

    Raises
    ------
    InputError : the data has no colour.
    """
    if isinstance(data, Cloud):
        if data.colors is None:
            raise InputError(
                "segment.method is hsv but the cloud has no colours: use everything, plane, or a mask", code="method-needs-color"
            )
        return in_ranges(data.colors[:, None], config.ranges)[:, 0]
    if data.color is None:
        raise InputError(
            "segment.method is hsv but the frame has no colour: use everything, plane, or a mask", code="method-needs-color"
        )
    return in_ranges(data.color, config.ranges)
