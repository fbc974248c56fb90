"""The picture of what a configuration takes of an image: what of the object, what it misses, and what besides."""

from __future__ import annotations

import cv2
import numpy as np

from ..types import Array, Bools
from .palette import DARK, LIGHT, Rgb

TAKEN: Rgb = (60, 220, 90)
MISSED: Rgb = (255, 50, 50)
BESIDES: Rgb = (255, 222, 60)
_UNIT = 700.0  # px: the root of the picture's area for which lines have their unit width
_TINT = 0.55


def draw_tuned(image: Array, mask: Bools, thing: Bools | None) -> Array:
    """The image, greyed, with what is taken in green, what of the thing is missed in red, and what is taken besides in yellow.

    Parameters
    ----------
    image : (H, W, 3) uint8 RGB. mask : (H, W) bool, what is taken.
    thing : (H, W) bool, the object; None where that is not known, and all that is taken is green.

    Returns
    -------
    (H, W, 3) uint8 RGB.
    """
    grey = cv2.cvtColor(cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
    picture: Array = np.rint(0.55 * grey + 0.25 * image).astype(np.uint8)
    parts = [("taken", TAKEN, mask if thing is None else mask & thing)]
    if thing is not None:
        parts += [("missed", MISSED, thing & ~mask), ("besides", BESIDES, mask & ~thing)]
    for _, color, where in parts:
        picture[where] = np.rint((1 - _TINT) * image[where] + _TINT * np.array(color)).astype(np.uint8)
    unit = max(1.0, float(np.sqrt(picture.shape[0] * picture.shape[1])) / _UNIT)
    row = round(20 * unit)
    if picture.shape[1] < 10 * row or picture.shape[0] < 5 * row:
        return picture
    cv2.rectangle(picture, (0, 0), (5 * row, round((len(parts) + 0.4) * row)), DARK, -1)
    for i, (text, color, _) in enumerate(parts):
        base = round((i + 0.95) * row)
        cv2.rectangle(picture, (round(0.3 * row), base - row // 2), (round(0.8 * row), base), color, -1)
        cv2.putText(
            picture, text, (round(1.1 * row), base), cv2.FONT_HERSHEY_DUPLEX, 0.42 * unit, LIGHT, max(1, round(unit)), cv2.LINE_AA
        )
    return picture
