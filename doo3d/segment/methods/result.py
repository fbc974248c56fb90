"""The result of a segmentation method, and the checks of the data that several methods make."""

from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...types import Array, Bools, Cloud, Frame, Image, Ints, Plane
from ..mask_parts import NO_PIXELS, Parts

SHADOWS = "only darker than both sides, as shadows and joints are"
"""Reason in the note on bands of a photograph that were rejected as shadows."""


def rejection_note(method: str, count: int, reason: str) -> str:
    """Return the note on the number of bands that a method rejected, with the reason; "" if it rejected none."""
    if not count:
        return ""
    bands = "1 band that is" if count == 1 else f"{count} bands that are"
    return f"segment ({method}): left out {bands} {reason}; give a mask if wrong"


class ColorBands(NamedTuple):
    """The bands of a frame whose color differs from the surface around them.

    Attributes
    ----------
    parts
        the bands, as connected parts.
    surface
        (N,) row-major indices of the raised pixels beside the bands that have the color of the surface.
    raised
        (H, W) bool, the pixels raised from the plane.
    """

    parts: Parts
    surface: Ints
    raised: Bools


NO_BANDS = ColorBands(Parts.of(np.zeros((0, 0), dtype=bool)), NO_PIXELS, np.zeros((0, 0), dtype=bool))


class MethodResult(NamedTuple):
    """The mask that a segmentation method found, and by-products that later steps use.

    Attributes
    ----------
    mask
        (H, W) bool, or (N,) bool for a cloud.
    note
        message to the user; "" if there is none.
    plane
        the dominant plane, its normal to either side; None if the method fits no plane or too few readings lie on it.
    rejected
        row-major indices of the pixels of each band that the rules rejected: as a shadow or a joint in a photograph, as flat in a
        frame.
    by_color
        (N,) row-major indices of the pixels of the strands that were detected by their color in a frame.
    is_certain
        True if each part of a frame's mask, specks aside, contains such a strand: no part is only noise of the depth.
    bands
        the bands of a frame whose color differs from the surface; NO_BANDS if there are none, or if no color was examined.
    probability
        (H, W) float32, the probability that a pixel belongs to a thin object; None if the method does not estimate it.
    """

    mask: Bools
    note: str = ""
    plane: Plane | None = None
    rejected: tuple[Ints, ...] = ()
    by_color: Ints = NO_PIXELS
    is_certain: bool = False
    bands: ColorBands = NO_BANDS
    probability: Array | None = None


def color_of(data: Frame | Cloud | Image, method: str) -> Array:
    """Return the color image (H, W, 3) uint8 of a Frame or an Image; InputError names the method if there is none."""
    color = None if isinstance(data, Cloud) else data.color
    if color is None:
        raise InputError(f"segment.method is {method}, which needs a color image", code="method-needs-color")
    return color


def require_image(data: Frame | Cloud | Image, method: str) -> Frame | Image:
    """Return the data if it is a Frame or an Image; InputError names the method if it is a Cloud."""
    if isinstance(data, Cloud):
        raise InputError(
            f"segment.method is {method}, which needs an image: for a cloud use plane or everything", code="method-needs-image"
        )
    return data


def require_depth(data: Frame | Cloud | Image, method: str) -> Frame | Cloud:
    """Return the data if it is a Frame or a Cloud; InputError names the method if it is an Image."""
    if isinstance(data, Image):
        raise InputError(
            f"segment.method is {method}, which needs depth: for an image use a mask, hsv or ridge", code="method-needs-depth"
        )
    return data
