"""Tell an image that is a mask, two values on black, from a photograph."""

from __future__ import annotations

import numpy as np

from ...geometry.noise import SAMPLES
from ...types import Array, Bools

MAX_OBJECT_FRACTION = 0.5
"""Fraction of the image that an object covers at most; more is a drawing on white."""


def object_in_mask_image(image: Array) -> Bools | None:
    """Return the object in an image that is a mask itself: black, and one gray value on the object; None for any other image.

    image : (H, W, 3) uint8. Returns (H, W) bool, True on the object, which covers at most half of the image.
    """
    stride = max(1, int((image.size / SAMPLES) ** 0.5))  # a photograph has more than two values in a sample of its pixels
    sample = image[::stride, ::stride]
    if not _has_two_values(sample, int(sample.max(initial=0))):
        return None
    value = int(image.max(initial=0))
    if not value or not _has_two_values(image, value):
        return None
    selected = image[..., 0] > 0
    return selected if np.count_nonzero(selected) <= MAX_OBJECT_FRACTION * selected.size else None


def _has_two_values(image: Array, value: int) -> bool:
    """Tell whether all pixels (H, W, 3) are black or of one gray value."""
    first = image[..., 0]
    return bool(((first == 0) | (first == value)).all() and (image[..., 1:] == first[..., None]).all())
