"""Move the edge of a ragged mask to where the colors of the image say that it is."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from ...geometry.mask import bounding_box
from ...types import Array, Bools, Floats

CELLS = 1 << 12
SHADES = (0.85, 0.7, 0.55, 0.4)
SHADOW_SHARE = 0.03
FLOOR = 1e-5
BAND_PX = 4
"""px; the edge of a mask is looked for up to so far beyond the mask."""

RING_PX = 24
"""px; the colors of the background are taken from the band's edge to so far from the mask."""

COLOR_BITS = 4
"""Bits per channel that tell colors apart."""

HISTOGRAM_SMOOTHING = 0.6
"""Cells of the color histograms by which they are smoothed: light varies along a cable."""

ITERATIONS = 4

MAX_LOG_RATIO = 4.0
"""Largest log ratio of one pixel: neighbors may outweigh it."""

SMOOTHING_PX = 0.8

EDGE_PX = 1.2
MIN_RAGGEDNESS = 0.25
"""px; a mask whose edge is off by less, in the mean, is left as it is."""

MAX_ELSEWHERE_RATIO, MAX_RING_SHARE = 0.05, 0.016
MIN_THICKNESS_PX, MIN_ELONGATION = 3.5, 16.0
MIN_CONTRAST = 2.5
"""Mean log ratio of the colors of the mask over those of the background that tells them apart."""


def repair_mask(mask: Bools, color: Array) -> Bools:
    """Move the edge of a mask to where the colors of the image change, and drop the parts in the colors of the background.

    The colors of the mask and of a ring around it are compared. Where they are told apart, a pixel in the mask or up to 4 px from it
    belongs to the object if its color, with those of its neighbors, is more frequent in the mask than around it.

    Parameters
    ----------
    mask
        (H, W) bool.
    color
        (H, W, 3) uint8 RGB.

    Returns
    -------
    (H, W) bool; `mask` itself if it is empty, its edge already is where the colors change, or the colors do not tell.
    """
    if not mask.any():
        return mask
    rows, columns = _widened(bounding_box(mask), RING_PX, mask.shape)
    part, image = mask[rows, columns], color[rows, columns]
    distance = cv2.distanceTransform((~part).astype(np.uint8), cv2.DIST_L2, 3)
    square = np.ones((3, 3), np.uint8)
    found, around = part, (distance > BAND_PX) & (distance <= RING_PX)
    for _ in range(ITERATIONS):
        core = cv2.erode(found.view(np.uint8), square) > 0
        inside = core if np.count_nonzero(core) > 0.4 * np.count_nonzero(found) else found
        ratio, contrast = _log_ratio(image, inside, around)
        if contrast < MIN_CONTRAST:
            return mask
        smooth = cv2.GaussianBlur(ratio, (0, 0), SMOOTHING_PX)
        found = (smooth > 0) & (distance <= BAND_PX)
        around = (distance <= RING_PX) & (cv2.dilate(found.view(np.uint8), square) == 0)
    perimeter = np.count_nonzero(part & (cv2.erode(part.view(np.uint8), np.ones((3, 3), np.uint8)) == 0))
    far = (distance > BAND_PX) & (distance <= RING_PX)
    import os
    found |= _long_parts(part & ~found)
    elsewhere = np.count_nonzero((smooth > 0) & far)
    if elsewhere > MAX_ELSEWHERE_RATIO * np.count_nonzero(part) and elsewhere > MAX_RING_SHARE * np.count_nonzero(far):
        return mask
    off = (found & (distance > EDGE_PX)) | (part & ~found & (cv2.distanceTransform(part.astype(np.uint8), cv2.DIST_L2, 3) > EDGE_PX))
    if np.count_nonzero(off) < MIN_RAGGEDNESS * perimeter:
        return mask
    result = np.zeros_like(mask)
    result[rows, columns] = found
    return result


def _long_parts(dropped: Bools) -> Bools:
    """Return the connected parts of what is dropped from a mask that are as thick as a cable and long."""
    distance = cv2.distanceTransform(dropped.astype(np.uint8), cv2.DIST_L2, 3)
    count, label, stats, _ = cv2.connectedComponentsWithStats(dropped.view(np.uint8), connectivity=8)
    thickest = np.zeros(count)
    np.maximum.at(thickest, label[dropped], distance[dropped])
    area = stats[:, cv2.CC_STAT_AREA]
    long = (thickest > MIN_THICKNESS_PX) & (area > MIN_ELONGATION * thickest**2)
    long[0] = False
    return np.asarray(long[label])


def _widened(box: tuple[slice, slice], margin: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    rows, columns = (slice(max(0, side.start - margin), min(size, side.stop + margin)) for side, size in zip(box, shape, strict=True))
    return rows, columns


def _log_ratio(image: Array, inside: Bools, around: Bools) -> tuple[Array, float]:
    """Return the log ratio (H, W) of each pixel's color inside over around, and its median over the inside."""
    ours, theirs = image[inside], image[around]
    step = max(1, len(theirs) // 20000)
    theirs = theirs[::step]
    shadows = [np.bincount(_keys((theirs * shade).astype(np.uint8)), minlength=CELLS) for shade in SHADES]
    table = np.log(_frequency(np.bincount(_keys(ours), minlength=CELLS)))
    table -= np.log(_frequency(np.bincount(_keys(theirs), minlength=CELLS) + SHADOW_SHARE * sum(shadows)))
    ratio = np.clip(table, -MAX_LOG_RATIO, MAX_LOG_RATIO).astype(np.float32)[_keys(image)]
    return ratio, float(np.median(ratio[inside]))


def _keys(colors: Array) -> Array:
    """Return the number of the histogram cell of each color (..., 3) uint8."""
    cells = (colors >> (8 - COLOR_BITS)).astype(np.int32)
    return (cells[..., 0] << 2 * COLOR_BITS) + (cells[..., 1] << COLOR_BITS) + cells[..., 2]


def _frequency(counts: Array) -> Floats:
    side = 1 << COLOR_BITS
    smooth = gaussian_filter(counts.reshape(side, side, side).astype(float), HISTOGRAM_SMOOTHING, mode="nearest").ravel()
    smooth = smooth / smooth.sum()
    return smooth + FLOOR
