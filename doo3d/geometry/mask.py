"""Compute bounding box, dilation and radius of the object from its mask alone."""

import cv2
import numpy as np

from .. import kernels
from ..types import Array, Bools, Floats


def bounding_box(mask: Bools) -> tuple[slice, slice]:
    """Return the bounding box of a mask as slices of rows and of columns.

    mask : (H, W) bool, with at least one True pixel; mask[box] is the part in the box.
    """
    top, bottom, left, right = kernels.bounding_box(mask)
    return slice(top, bottom), slice(left, right)


def dilate(mask: Bools, px: float) -> Bools:
    """Return the pixels within `px` of a mask, (H, W) bool.

    mask : (H, W) bool. The distance is a chamfer distance, with a tolerance for rounding.
    """
    return np.asarray(cv2.distanceTransform((~mask).view(np.uint8), cv2.DIST_L2, 5) <= px + 1e-3)


def grown_box(box: tuple[slice, slice], px: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return a box grown by `px` on all sides, within an image (h, w)."""
    rows, columns = (slice(max(0, side.start - px), min(size, side.stop + px)) for side, size in zip(box, shape, strict=True))
    return rows, columns


def ridge_radius(inside: Array, scale: Array) -> float:
    """Return the radius of the object in a mask from the mask's distance transform.

    It is the median half-width along the ridges of the transform, the medial axes of the strands, weighted by the half-width,
    so that specks weigh little.

    Parameters
    ----------
    inside
        (H, W) float px, distance of each pixel to the nearest pixel outside the mask; 0 outside.
    scale
        (H, W), length of a pixel's side, such as m per px; 0 = unknown.

    Returns
    -------
    The radius in the unit of `scale` times px (m for m per px); 0 if there is no ridge with a known scale.
    """
    ridge = (inside > 0) & (inside >= cv2.dilate(inside, np.ones((3, 3), np.uint8)) - 1e-3) & (scale > 0)
    return median_half_width((inside[ridge] - 0.5) * scale[ridge])


def median_half_width(half_width: Array) -> float:
    """Return the median of half-widths (K,), each weighted by itself; 0 if K is 0.

    Half-widths are measured at pixels along medial axes. The weight makes it a median over the area, so that specks weigh
    little. The unit is that of the half-widths.
    """
    if not len(half_width):
        return 0.0
    half_width = np.sort(half_width)
    weight = np.cumsum(half_width)
    return float(half_width[np.searchsorted(weight, weight[-1] / 2)])


def half_widths(mask: Bools) -> tuple[Array, Floats]:
    """Return the distance of pixels to the edge of a mask, and the first pixel.

    mask : (H, W) bool. The pixel is (u, v), and the distances are float32 px, 0 outside, of the mask's bounding box with a margin
    of one pixel.
    """
    if not mask.any():
        return np.zeros((1, 1), dtype=np.float32), np.zeros(2)
    box = bounding_box(mask)
    inside = cv2.distanceTransform(np.pad(mask[box].astype(np.uint8), 1), cv2.DIST_L2, 5)
    return np.maximum(inside - 0.5, 0.0), np.array([box[1].start, box[0].start]) - 1.0
