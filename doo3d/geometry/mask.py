"""Bounding box, pixels and radius of the object from its mask alone."""

from __future__ import annotations

import cv2
import numpy as np

from ..kernels import medial_axis
from ..types import Array, Bools, Ints


def bounding_box(mask: Bools) -> tuple[slice, slice]:
    """Return the bounding box of the True pixels of a mask (H, W) as slices: rows, columns. The mask must not be empty."""
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    return slice(y, y + height), slice(x, x + width)


def mask_pixels(mask: Bools) -> Ints:
    """Return the True pixels of a mask (H, W) as (u, v) = (column, row), (N, 2) int64, sorted by u and then v."""
    if not mask.any():
        return np.zeros((0, 2), dtype=np.int64)
    rows, columns = bounding_box(mask)
    nonzero = cv2.findNonZero(cv2.transpose(mask[rows, columns].view(np.uint8))).reshape(-1, 2)
    pixels = np.empty(nonzero.shape, dtype=np.int64)
    np.add(nonzero[:, 1], columns.start, out=pixels[:, 0])
    np.add(nonzero[:, 0], rows.start, out=pixels[:, 1])
    return pixels


def mask_radius(mask: Bools, depth: Array | None = None, focal: float = 1.0) -> float:
    """Return the radius of the object in a mask: the median half-width along the mask's medial axis.

    The median is weighted by the half-width, so that specks count for little.

    Parameters
    ----------
    mask
        (H, W) bool.
    depth
        (H, W) m, 0 = unknown; None measures in pixels.
    focal
        focal length in px.

    Returns
    -------
    The radius in m, or in px without depth; 0 if the mask is empty or no pixel of its medial axis has a depth.
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
    """Return the radius of the object in a mask from the mask's distance transform.

    It is the median half-width along the ridges of the transform. The median is weighted by the half-width, so that specks
    count for little.

    Parameters
    ----------
    inside
        (H, W) px, distance of each pixel to the nearest pixel outside the mask; 0 outside.
    scale
        (H, W), length of a pixel's side, such as m per px; 0 = unknown.

    Returns
    -------
    The radius in the unit of `scale`; 0 without any ridge.
    """
    ridge = (inside > 0) & (inside >= cv2.dilate(inside, np.ones((3, 3), np.uint8)) - 1e-3) & (scale > 0)
    return median_half_width((inside[ridge] - 0.5) * scale[ridge])


def median_half_width(half_width: Array) -> float:
    """Return the median of half-widths (K,), each weighted by itself; 0 if there are none.

    Half-widths are measured at pixels along medial axes. The weight makes it a median over the area, so that specks count for
    little.
    """
    if not len(half_width):
        return 0.0
    half_width = np.sort(half_width)
    weight = np.cumsum(half_width)
    return float(half_width[np.searchsorted(weight, weight[-1] / 2)])
