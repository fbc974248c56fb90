"""Detect the valleys between strands side by side in a color image, in a depth image, or in the widths of a mask."""

import math

import cv2
import numpy as np

from ..geometry.noise import SAMPLES
from ..kernels import valley_depth
from ..types import Array, Bools
from .wide_stretches import COARSE_RADIUS_PX, GAP_RADII, MAX_BUNDLE_PX, MAX_BUNDLE_RADII, Bundles, close_gaps

VALLEY_RADII, MIN_VALLEY_PX = 0.38, 1.0
"""Standard deviation of the line detector across a valley, in radii, and its minimum in px."""

VALLEY_LENGTH_RADII = 1.6
"""Standard deviation of the line detector along a valley, in radii."""

ORIENTATIONS = 8
"""Number of orientations of the line detector, a multiple of 8: one every 22.5 degrees."""

ACROSS = np.array(((1, 0), (1, -1), (0, 1), (1, 1)))
"""Steps (rows, columns) across a valley, for orientations an eighth of a turn apart."""

CLIP = 2.0
"""Brightness at which highlights are clipped, in units of the contrast; the background has minus this brightness."""

MIN_CONTRAST = 4.0
"""Minimum contrast within a mask in grey levels; fainter contrast is noise, and the mask is split into strands of equal width."""

AROUND_RADII = 3.0
"""Half-width in radii of the window over which the mean depth around a pixel is computed."""


def find_valleys(shade: Array, radius: float, wide: Bools) -> tuple[Array, Bools]:
    """Return the depth of the valleys in an image, (h, w), and the pixels at their bottoms, (h, w) bool.

    The depth is the largest over all orientations, minus that of a crest through the same pixel: along a strand's highlight the
    image is a shallow valley.

    Parameters
    ----------
    shade
        (h, w) float32.
    radius
        px, usual half-width of one strand.
    wide
        (h, w) bool, the pixels at which valleys are searched.
    """
    scale = min(1.0, COARSE_RADIUS_PX / radius)
    square = np.ones((3, 3), np.uint8)
    small, wanted = shade, cv2.dilate(wide.view(np.uint8), square)  # bottoms are compared with the pixels beside them
    if scale < 1:
        small = cv2.resize(shade, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        covered = cv2.resize(wanted.astype(np.float32), small.shape[::-1], interpolation=cv2.INTER_AREA) > 0
        wanted = cv2.dilate(covered.view(np.uint8), square)
    across, along = max(MIN_VALLEY_PX, VALLEY_RADII * radius * scale), VALLEY_LENGTH_RADII * radius * scale
    depth, orientation = valley_depth(small, wanted.view(bool), across, along, ORIENTATIONS)
    if scale < 1:
        depth = cv2.resize(depth, shade.shape[::-1], interpolation=cv2.INTER_LINEAR)
        orientation = cv2.resize(orientation, shade.shape[::-1], interpolation=cv2.INTER_NEAREST)
    return depth, valley_bottoms(depth, orientation, wide)


def valley_bottoms(depth: Array, orientation: Array, wanted: Bools) -> Bools:
    """Return the wanted pixels (h, w) bool that are at least as deep as their two neighbors across the valley.

    depth, orientation : (h, w) float32 and uint8, as `kernels.valley_depth` returns them. wanted : (h, w) bool.
    """
    padded = np.pad(depth, 1, constant_values=-np.inf)
    rows, columns = np.nonzero(wanted)
    down, right = ACROSS[(orientation[wanted] + ORIENTATIONS // 8) // (ORIENTATIONS // 4) % 4].T
    sides = np.maximum(padded[rows + 1 + down, columns + 1 + right], padded[rows + 1 - down, columns + 1 - right])
    bottom = wanted.copy()
    bottom[wanted] = depth[wanted] >= sides
    return bottom


def shade_strands(
    bundles: Bundles, box: tuple[slice, slice], color: Array | None, depth: Array | None, equal_widths: bool
) -> Array:
    """Return an image in which strands are ridges, in units of the contrast within the mask.

    Parameters
    ----------
    bundles
        the wide stretches of the mask; their images cover its bounding box, with a margin of one pixel.
    box
        the bounding box, slices of rows and columns.
    color
        (H, W, 3) uint8 RGB of the whole frame, or None.
    depth
        (H, W) m of the whole frame, used without color, or None.
    equal_widths
        whether a mask without contrast is split into strands of equal width.

    Returns
    -------
    (h, w) float32; -CLIP in the background. 0 everywhere if there is no contrast and `equal_widths` is False.
    """
    part = bundles.part
    pixels = np.flatnonzero(part[1:-1, 1:-1])
    values, least = np.zeros(len(pixels), dtype=np.float32), 0.0
    if color is not None:
        grey = cv2.transform(color[box].reshape(-1, 3)[pixels][:, None], np.full((1, 3), 1 / 3))
        values, least = grey[:, 0].astype(np.float32), MIN_CONTRAST
    elif depth is not None:
        values = _nearness(depth[box], part[1:-1, 1:-1], bundles.radius).ravel()[pixels]
    low, middle, high = np.percentile(values[:: max(1, len(values) // SAMPLES)], (10, 50, 90))
    contrast = (high - low) / 2
    if contrast <= least:
        return _equal_widths(bundles) if equal_widths else np.zeros(part.shape, dtype=np.float32)
    shade = np.full(part.shape, -CLIP, dtype=np.float32)
    shade[part] = np.clip((values - middle) / contrast, -CLIP, CLIP)
    return shade


def _equal_widths(bundles: Bundles) -> Array:
    """Return an image (h, w) float32 in which ridges of equal width fill a mask, as many side by side as fit its local width.

    The width is that of the mask with the wedges between diverging strands filled, so that the ridges continue straight into
    them.
    """
    part, radius = bundles.part, bundles.radius
    outline = close_gaps(part, math.ceil(GAP_RADII * radius))
    distance = cv2.distanceTransform(np.pad(outline, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    within = min(math.ceil(bundles.widest), math.ceil(max(MAX_BUNDLE_RADII * radius, MAX_BUNDLE_PX)))
    square = round(within / (1 + math.sqrt(2)))  # and a diamond make a regular octagon
    half_width = cv2.dilate(distance, np.ones((2 * square + 1,) * 2, np.uint8))
    half_width = cv2.dilate(half_width, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)), iterations=within - square)
    strand = half_width / np.maximum(1, np.rint((half_width - 0.5) / radius))
    return np.where(part, -np.cos(np.pi * distance / np.maximum(strand, 1)), -CLIP).astype(np.float32)


def _nearness(depth: Array, part: Bools, radius: float) -> Array:
    """Return how much nearer to the camera each pixel (h, w) is than the mask around it on average, m; 0 without a reading."""
    known = (part & (depth > 0)).astype(np.float32)
    side = 2 * math.ceil(AROUND_RADII * radius) + 1
    count, total = (cv2.boxFilter(image, -1, (side, side), normalize=False) for image in (known, known * depth))
    return np.asarray(np.where(known > 0, total / np.maximum(count, 1) - depth, 0.0))
