"""What a mask alone says about the object: where it is, and how thick."""

from __future__ import annotations

import cv2
import numpy as np

from ..kernels.medial_axis import medial_axis
from ..types import Array, Bools, Ints


def bounding_box(mask: Bools) -> tuple[slice, slice]:
    """Rows and columns of the smallest box that holds the mask (H, W), which must not be empty."""
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    return slice(y, y + height), slice(x, x + width)


def mask_pixels(mask: Bools) -> Ints:
    """(N, 2) int64, the (u, v) of the pixels of the mask (H, W), in lexicographic order."""
    if not mask.any():
        return np.zeros((0, 2), dtype=np.int64)
    rows, columns = bounding_box(mask)
    found = cv2.findNonZero(cv2.transpose(mask[rows, columns].view(np.uint8))).reshape(-1, 2)
    pixels = np.empty(found.shape, dtype=np.int64)
    np.add(found[:, 1], columns.start, out=pixels[:, 0])
    np.add(found[:, 0], rows.start, out=pixels[:, 1])
    return pixels


def mask_radius(mask: Bools, depth: Array | None = None, focal: float = 1.0) -> float:
    """The usual half-width along the middle lines of a mask (H, W): the median, as `median_half_width` weights it.

    depth : (H, W) m, 0 = unknown; focal : px. Returns m, or px without a depth; 0 where there is no middle line of known depth.
    A strip of w pixels has the distance (w + 1) / 2 from its outside in its middle.
    """
    if not mask.any():
        return 0.0
    box = bounding_box(mask)
    rows, columns, inside = medial_axis(mask[box].copy())
    if depth is None:
        return median_half_width(inside - 0.5)
    scale = depth[box][rows, columns] / focal
    return median_half_width((inside[scale > 0] - 0.5) * scale[scale > 0])


def ridge_radius(inside: Array, scale: Array) -> float:
    """The same from a distance transform: inside (H, W) px, distance to the nearest pixel outside the mask."""
    ridge = (inside > 0) & (inside >= cv2.dilate(inside, np.ones((3, 3), np.uint8)) - 1e-3) & (scale > 0)
    return median_half_width((inside[ridge] - 0.5) * scale[ridge])


def median_half_width(half: Array) -> float:
    """The median of the half-widths (K,) of pixels of middle lines, each weighted by its width; 0 of none.

    The weight makes it the median over the area, so that specks count for little.
    """
    if not len(half):
        return 0.0
    half = np.sort(half)
    weight = np.cumsum(half)
    return float(half[np.searchsorted(weight, weight[-1] / 2)])
