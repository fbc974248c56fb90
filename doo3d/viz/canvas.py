"""Draw shapes on a transparent layer, which is blended over an image at the end.

A shape replaces what is below it on the layer, so a half-transparent ribbon that overlaps itself does not darken. The layer is
premultiplied RGBA, in which antialiasing blends color and transparency correctly. Bands, lines and discs are drawn together, by
one call of a kernel.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from ..kernels import blend_layer, paint_strokes
from ..types import Array, Floats
from .palette import Rgb

_FRACTION_BITS = 4  # of a pixel: OpenCV draws at sixteenths
_MAX_COORDINATE_PX = 2**14  # OpenCV's coordinates are 32-bit, fraction included


class _Stroke(NamedTuple):
    """A stroke, or discs of one color, not yet drawn on the layer.

    points : (N, 3) px, x, y and half-width of each point. color : premultiplied RGBA. apart : whether each point is a separate
    disc.
    blunt : whether the stroke is cut off at its ends.
    """

    points: Floats
    color: tuple[float, float, float, float]
    apart: bool = False
    blunt: bool = False


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
        self._layer = np.zeros((height, width, 4), np.uint8)
        self._strokes: list[_Stroke] = []

    @property
    def layer(self) -> Array:
        """The layer with all shapes drawn."""
        if self._strokes:
            strokes, self._strokes = self._strokes, []
            lengths = [np.ones(len(points), np.int64) if apart else np.array([len(points)]) for points, _, apart, _ in strokes]
            colors = np.rint([stroke.color for stroke in strokes]).astype(np.uint8)
            each = np.repeat(np.arange(len(strokes)), [len(counts) for counts in lengths])
            blunt = np.array([stroke.blunt for stroke in strokes])
            stops = np.cumsum(np.concatenate(lengths), dtype=np.int64)
            paint_strokes(self._layer, np.concatenate([stroke.points for stroke in strokes]), stops, colors[each], blunt[each])
        return self._layer

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

    def ribbon(self, points: Floats, half_width: Floats, color: Rgb, alpha: float) -> None:
        """Draw a band along an open polyline, as wide at each point as given, cut off at its first and its last point.

        Parameters
        ----------
        points
            (N, 2) px, its N points.
        half_width
            (N,) px, half the width of the band at each point.
        color
            RGB, 0 to 255.
        alpha
            opacity, 0 to 1.
        """
        self._strokes.append(_Stroke(np.column_stack((points, half_width)), _rgba(color, alpha), blunt=True))

    def line(self, points: Floats, color: Rgb, alpha: float, width: float) -> None:
        """Draw an open polyline with round ends.

        Parameters
        ----------
        points
            (N, 2) px, its N points.
        color
            RGB, 0 to 255.
        alpha
            opacity, 0 to 1.
        width
            width of the line in px, at least 1.
        """
        half_width = np.full(len(points), max(1.0, width) / 2)
        self._strokes.append(_Stroke(np.column_stack((points, half_width)), _rgba(color, alpha)))

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
        self.discs(center[None], radius, color, alpha)

    def discs(self, centers: Floats, radius: float, color: Rgb, alpha: float) -> None:
        """Draw filled circles of one size around centers (N, 2) px; the other arguments are as for `disc`."""
        self._strokes.append(_Stroke(np.insert(centers, 2, radius, axis=1), _rgba(color, alpha), apart=True))

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
        picture = np.array(image, order="C")
        blend_layer(picture, self.layer)
        return picture


def _fixed_point(points: Floats) -> Array:
    clipped = np.clip(points, -_MAX_COORDINATE_PX, _MAX_COORDINATE_PX)
    return np.asarray(np.rint(clipped * 2**_FRACTION_BITS), dtype=np.int32)


def _rgba(color: Rgb, alpha: float) -> tuple[float, float, float, float]:
    red, green, blue = (channel * alpha for channel in color)
    return red, green, blue, 255 * alpha
