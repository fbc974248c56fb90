"""Distinguish images that are masks (one gray value on black) from photographs, and masks from inverted masks."""

import cv2
import numpy as np

from ..geometry.noise import SAMPLES
from ..types import Array, Bools

MAX_OBJECT_FRACTION = 0.5
"""Maximum fraction of the image that an object covers; a drawing on white covers more."""

MIN_STRAND_AREA_RADII = 20
"""Minimum area of a thin region, in squares of its largest radius: the area of a strand 10 radii long; a disk has 3."""


def inversion_note(mask: Bools) -> str:
    """Return a note if a mask seems to be inverted; "" if not, and for a mask of points.

    mask : (H, W) bool. It is inverted if it covers all corners and more than half of the image, and the rest is thin.
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
    """Return the object in an image that is a mask itself, with one gray value on black; None for any other image.

    image : (H, W, 3) uint8. Returns (H, W) bool, True on the object, which covers at most half of the image.
    """
    stride = max(1, int((image.size / SAMPLES) ** 0.5))  # enough to reject a photograph
    sample = image[::stride, ::stride]
    if not _has_two_values(sample, int(sample.max(initial=0))):
        return None
    value = int(image.max(initial=0))
    if not value or not _has_two_values(image, value):
        return None
    selected = image[..., 0] > 0
    return selected if np.count_nonzero(selected) <= MAX_OBJECT_FRACTION * selected.size else None


def _has_two_values(image: Array, value: int) -> bool:
    """Return whether all pixels (H, W, 3) are black or have the gray value `value`."""
    first = image[..., 0]
    return bool(((first == 0) | (first == value)).all() and (image[..., 1:] == first[..., None]).all())
