"""What a mask alone says about the object: where it is, and how thick."""

from __future__ import annotations

import cv2
import numpy as np

from .types import Array, Bools, Ints


def bounding_box(mask: Bools) -> tuple[slice, slice]:
    """Rows and columns of the smallest box that holds the mask (H, W), which must not be empty."""
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    return slice(y, y + height), slice(x, x + width)


def mask_pixels(mask: Bools) -> Ints:
    """(N, 2) the (u, v) of the pixels of the mask (H, W), in lexicographic order."""
    if not mask.any():
        return np.zeros((0, 2), dtype=np.int64)
    rows, columns = bounding_box(mask)
    u, v = np.nonzero(mask[rows, columns].T)
    return np.column_stack((u + columns.start, v + rows.start))


def ridge_radius(inside: Array, scale: Array) -> float:
    """The usual half-width along the middle lines of a mask: the median, each pixel of a middle line weighted by its width.

    The weight makes it the median over the area, so that specks count for little.
    inside : (H, W) px, distance to the nearest pixel outside the mask. scale : (H, W) m per px, 0 = unknown.
    Returns m; 0 where there is no middle line of known scale. A strip of w pixels has the distance (w + 1) / 2 in its middle.
    """
    ridge = (inside > 0) & (inside >= cv2.dilate(inside, np.ones((3, 3), np.uint8)) - 1e-3) & (scale > 0)
    half = np.sort((inside[ridge] - 0.5) * scale[ridge])
    if not len(half):
        return 0.0
    weight = np.cumsum(half)
    return float(half[np.searchsorted(weight, weight[-1] / 2)])
