"""The picture of a comparison: the chains of both modes over the image, and circles where they differ."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from ..types import Array, Floats, Frame
from .backdrop import backdrop_of
from .canvas import Canvas
from .palette import CHAINS, DARK, LIGHT, UNIT_PX, Rgb

SOLID, FLAT = CHAINS[0], CHAINS[1]
MARK: Rgb = (255, 60, 60)
_CIRCLE = 14.0  # px at unit size: the least radius of a circle


def draw_comparison(
    data: Frame, solid: Sequence[Floats], flat: Sequence[Floats], places: Sequence[tuple[tuple[float, float], float]]
) -> Array:
    """The chains of the 3-D mode over those of the 2-D mode.

    Parameters
    ----------
    data : the frame. solid, flat : per chain the joints in the image, (N + 1, 2) px.
    places : ((x, y) px, the tolerance there in px) where they differ; each is circled.

    Returns
    -------
    (H, W, 3) uint8 RGB, of the frame's size.
    """
    image = backdrop_of(data).image
    height, width = image.shape[:2]
    unit = max(1.0, float(np.sqrt(height * width)) / UNIT_PX)
    canvas = Canvas(height, width)
    for at, tolerance in places:
        radius = max(_CIRCLE * unit, 2.5 * tolerance)
        canvas.disc(np.array(at), radius + 3.4 * unit, DARK, 0.8)
        canvas.disc(np.array(at), radius + 2.4 * unit, MARK, 1.0)
    for at, tolerance in places:
        canvas.disc(np.array(at), max(_CIRCLE * unit, 2.5 * tolerance), DARK, 0.0)
    for lines, color, wide in ((flat, FLAT, 5.0), (solid, SOLID, 1.8)):
        for line in lines:
            canvas.line(line, DARK, 0.6, (wide + 1.6) * unit)
            canvas.line(line, color, 1.0, wide * unit)
            canvas.disc(line[0], 1.6 * wide * unit, color, 1.0)
    return _legend(canvas.over(image), unit)


def _legend(picture: Array, unit: float) -> Array:
    """The image with what is what, in its upper left corner."""
    size, row = 0.42 * unit, round(20 * unit)
    if picture.shape[1] < 10 * row or picture.shape[0] < 4 * row:
        return picture
    cv2.rectangle(picture, (0, 0), (round(5.0 * row), round(2.4 * row)), DARK, -1)
    for i, (text, color) in enumerate((("3-D, projected", SOLID), ("2-D", FLAT))):
        base = round((i + 0.95) * row)
        cv2.rectangle(picture, (round(0.3 * row), base - row // 3), (round(0.7 * row), base), color, -1)
        cv2.putText(picture, text, (row, base), cv2.FONT_HERSHEY_DUPLEX, size * 0.9, LIGHT, max(1, round(unit)), cv2.LINE_AA)
    return picture
