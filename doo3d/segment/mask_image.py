"""Tell an image that is a mask, two values on black, from a photograph, and a mask from its inverse."""

from __future__ import annotations

import cv2
import numpy as np

from ..geometry.noise import SAMPLES
from ..types import Array, Bools

MAX_OBJECT_FRACTION = 0.5
"""Fraction of the image that an object covers at most; more is a drawing on white."""

MIN_STRAND_AREA_RADII = 20
"""Area in squares of the largest radius from which a region is long and thin: that of a strand 10 radii long; a disk has 3."""


def inversion_note(mask: Bools) -> str:
    """Return a sentence if a mask seems to be black on white; "" if not, and for a mask of points.

    mask : (H, W) bool. It is if it covers more than half of the image and all of its corners, and leaves a thin strand out.
    """
    share = float(np.mean(mask)) if mask.ndim > 1 else 0.0
    if share <= MAX_OBJECT_FRACTION or share == 1 or not mask[:: len(mask) - 1 or 1, :: mask.shape[1] - 1 or 1].all():
        return ""
    outside = np.pad(~mask, 1).astype(np.uint8)
    radius = float(cv2.distanceTransform(outside, cv2.DIST_L2, cv2.DIST_MASK_PRECISE).max())
    if np.count_nonzero(outside) < MIN_STRAND_AREA_RADII * radius**2:
        return ""
    return (
        f"segment: the mask covers {share:.0%} of the image, and what it leaves out is thin: is it inverted? The object is True"
    )


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
