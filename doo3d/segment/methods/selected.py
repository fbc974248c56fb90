"""What a method selects, with a note."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...types import Array, Bools, Ints, Plane
from ..mask_parts import Parts

SHADOWS = "only darker than both sides, as shadows and joints are"
"""What the bands are that are left out of a photograph."""


def left_out_note(method: str, count: int, reason: str) -> str:
    """Return the sentence on the number of bands that a method left out of an image; empty for none."""
    if not count:
        return ""
    bands = "1 band that is" if count == 1 else f"{count} bands that are"
    return f"segment ({method}): left out {bands} {reason}; give a mask if wrong"


class ColorBands(NamedTuple):
    """What differs in color from the surface around it in a frame.

    Attributes
    ----------
    parts
        the bands.
    surface
        row-major indices of the raised pixels beside them that do not differ.
    raised
        (H, W) bool, the pixels raised from the plane.
    """

    parts: Parts
    surface: Ints
    raised: Bools


class Selected(NamedTuple):
    """The pixels that a method selects, with what else it knows of the image.

    Attributes
    ----------
    mask
        (H, W) bool.
    note
        the sentence; empty if there is nothing to say.
    plane
        the plane that the method found, its normal to either side; None if it looked for none, or found too few readings on it.
    left_out
        row-major indices of the pixels of each band that the rules leave out: as a shadow or a joint of a photograph, or as flat
        in a frame.
    told
        row-major indices of the pixels of the strands that the rules tell by their color in a frame.
    is_certain
        whether each part that the rules select in a frame, specks aside, holds such a strand: it is no noise of depth.
    bands
        what differs in color from the surface in a frame; None if that was not looked at.
    probability
        (H, W) float32, the probability that a pixel belongs to a thin object; None if the method knows none.
    """

    mask: Bools
    note: str = ""
    plane: Plane | None = None
    left_out: tuple[Ints, ...] = ()
    told: Ints = np.zeros(0, dtype=int)
    is_certain: bool = False
    bands: ColorBands | None = None
    probability: Array | None = None
