"""A transparent sheet to draw on, laid over the image in the end.

What is drawn replaces what lies below it on the sheet, so a half-transparent ribbon that overlaps itself does not
darken. The sheet is premultiplied RGBA, in which OpenCV's antialiasing blends colour and transparency rightly.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ..types import Array, Floats
from .palette import Rgb

_SHIFT = 4  # binary digits of a pixel: OpenCV draws at sixteenths
_FAR = 2**14  # px; OpenCV's coordinates are 32-bit with the shift


class Canvas:
    """A sheet of (H, W) pixels; points are (N, 2) float pixels (x right, y down)."""

    def __init__(self, height: int, width: int) -> None:
        self.sheet = np.zeros((height, width, 4), np.uint8)

    def polygon(self, corners: Floats, color: Rgb, alpha: float) -> None:
        """A filled polygon, convex or not."""
        cv2.fillPoly(self.sheet, [_fixed(corners)], _paint(color, alpha), cv2.LINE_AA, _SHIFT)

    def line(self, points: Floats, color: Rgb, alpha: float, width: float) -> None:
        """A line through the points, `width` px wide, to the nearest whole pixel."""
        cv2.polylines(self.sheet, [_fixed(points)], False, _paint(color, alpha), max(1, round(width)), cv2.LINE_AA, _SHIFT)

    def disc(self, center: Floats, radius: float, color: Rgb, alpha: float) -> None:
        """A filled circle; with `alpha` 0 a hole in what was drawn."""
        (at,) = _fixed(center[None])
        cv2.circle(self.sheet, at.tolist(), round(radius * 2**_SHIFT), _paint(color, alpha), -1, cv2.LINE_AA, _SHIFT)

    def box(self, low: Sequence[int], high: Sequence[int], color: Rgb, alpha: float) -> None:
        """A filled rectangle between two corners, (x, y) whole pixels."""
        cv2.rectangle(self.sheet, tuple(low), tuple(high), _paint(color, alpha), -1)

    def over(self, image: Array) -> Array:
        """The (H, W, 3) uint8 image with the sheet laid over it, as a new array."""
        rest = cv2.cvtColor(255 - self.sheet[:, :, 3], cv2.COLOR_GRAY2RGB)
        return np.asarray(cv2.add(cv2.multiply(image, rest, scale=1 / 255), np.ascontiguousarray(self.sheet[:, :, :3])))


def _fixed(points: Floats) -> Array:
    return np.asarray(np.rint(np.clip(points, -_FAR, _FAR) * 2**_SHIFT), dtype=np.int32)


def _paint(color: Rgb, alpha: float) -> tuple[float, float, float, float]:
    red, green, blue = (part * alpha for part in color)
    return red, green, blue, 255 * alpha
