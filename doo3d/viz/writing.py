"""Write text and legends into pictures."""

from collections.abc import Sequence

import cv2
import numpy as np

from ..types import Array, Floats
from .palette import DARK, LIGHT, Rgb, line_unit

FONT = cv2.FONT_HERSHEY_DUPLEX


def write_outlined(picture: Array, text: str, at: Floats, size: float, widths: tuple[float, float]) -> None:
    """Write light text with a dark outline into a picture.

    Parameters
    ----------
    picture
        (H, W, 3) uint8 RGB, which is changed.
    text
        the words.
    at
        (x, y) px, the left end of their base line.
    size
        factor of the font's own size.
    widths
        widths of the outline's and the text's strokes, px.
    """
    place = np.rint(at).astype(int).tolist()
    for color, width in zip((DARK, LIGHT), widths, strict=True):
        cv2.putText(picture, text, place, FONT, size, color, max(1, round(width)), cv2.LINE_AA)


def write_legend(picture: Array, entries: Sequence[tuple[str, Rgb]]) -> None:
    """Write a legend into the upper left corner of a picture, unless that is too small; entries : words and colors."""
    unit = line_unit(picture)
    row = round(20 * unit)
    if picture.shape[1] < 10 * row or picture.shape[0] < (len(entries) + 2) * row:
        return
    cv2.rectangle(picture, (0, 0), (round(5.5 * row), round((len(entries) + 0.4) * row)), DARK, -1)
    for i, (text, color) in enumerate(entries):
        base = round((i + 0.95) * row)
        cv2.rectangle(picture, (round(0.3 * row), base - row // 2), (round(0.8 * row), base), color, -1)
        cv2.putText(picture, text, (round(1.1 * row), base), FONT, 0.38 * unit, LIGHT, max(1, round(unit)), cv2.LINE_AA)
