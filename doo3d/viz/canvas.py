"""A transparent layer to draw on, blended over an image at the end.

A shape replaces what is below it on the layer, so a half-transparent ribbon that overlaps itself does not darken. The layer is
premultiplied RGBA, in which OpenCV's antialiasing blends color and transparency correctly.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ..types import Array, Floats
from .palette import Rgb

_FRACTION_BITS = 4  # of a pixel: OpenCV draws at sixteenths
_MAX_COORDINATE_PX = 2**14  # OpenCV's coordinates are 32-bit, fraction included


class Canvas:
    """A transparent layer to draw shapes on, to be blended over an image. A shape replaces what is below it on the layer.

    Positions are (x, y) px as floats, x right and y down. Edges are antialiased.

    Parameters
    ----------
    height, width
        size of the layer, px.

    Attributes
    ----------
    layer
        (height, width, 4) uint8 RGBA, the colors premultiplied by the opacity; transparent at first.
    """

    def __init__(self, height: int, width: int) -> None:
        self.layer = np.zeros((height, width, 4), np.uint8)

    def polygon(self, corners: Floats, color: Rgb, alpha: float) -> None:
        """Draw a filled polygon, convex or not.

        Parameters
        ----------
        corners
            (K, 2) px, the K corners in order.
        color
            RGB, 0 to 255.
        alpha
            opacity, 0 to 1.
        """
        cv2.fillPoly(self.layer, [_fixed_point(corners)], _rgba(color, alpha), cv2.LINE_AA, _FRACTION_BITS)

    def line(self, points: Floats, color: Rgb, alpha: float, width: float) -> None:
        """Draw an open polyline.

        Parameters
        ----------
        points
            (N, 2) px, its N points.
        color
            RGB, 0 to 255.
        alpha
            opacity, 0 to 1.
        width
            width of the line in px, rounded to whole pixels, at least 1.
        """
        thickness = max(1, round(width))
        cv2.polylines(self.layer, [_fixed_point(points)], False, _rgba(color, alpha), thickness, cv2.LINE_AA, _FRACTION_BITS)

    def disc(self, center: Floats, radius: float, color: Rgb, alpha: float) -> None:
        """Draw a filled circle; with opacity 0, cut a transparent hole into what is drawn on the layer.

        Parameters
        ----------
        center
            (2,) px, x and y.
        radius
            radius of the circle, px.
        color
            RGB, 0 to 255.
        alpha
            opacity, 0 to 1.
        """
        (at,) = _fixed_point(center[None])
        radius_fixed = round(radius * 2**_FRACTION_BITS)
        cv2.circle(self.layer, at.tolist(), radius_fixed, _rgba(color, alpha), -1, cv2.LINE_AA, _FRACTION_BITS)

    def box(self, low: Sequence[int], high: Sequence[int], color: Rgb, alpha: float) -> None:
        """Draw a filled rectangle.

        Parameters
        ----------
        low, high
            (x, y) px of the upper left and the lower right corner, whole pixels, both included.
        color
            RGB, 0 to 255.
        alpha
            opacity, 0 to 1.
        """
        cv2.rectangle(self.layer, tuple(low), tuple(high), _rgba(color, alpha), -1)

    def blend_over(self, image: Array) -> Array:
        """Return the layer blended over an image of its size, as a new image: (height, width, 3) uint8 RGB, like `image`."""
        transparency = cv2.cvtColor(255 - self.layer[:, :, 3], cv2.COLOR_GRAY2RGB)
        background = cv2.multiply(image, transparency, scale=1 / 255)
        return np.asarray(cv2.add(background, np.ascontiguousarray(self.layer[:, :, :3])))


def _fixed_point(points: Floats) -> Array:
    clipped = np.clip(points, -_MAX_COORDINATE_PX, _MAX_COORDINATE_PX)
    return np.asarray(np.rint(clipped * 2**_FRACTION_BITS), dtype=np.int32)


def _rgba(color: Rgb, alpha: float) -> tuple[float, float, float, float]:
    red, green, blue = (channel * alpha for channel in color)
    return red, green, blue, 255 * alpha
