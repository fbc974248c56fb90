"""Move the edge of a ragged mask to where the colors of the image say that it is."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from ...geometry.mask import bounding_box
from ...types import Array, Bools, Floats

BAND_PX = 4
"""px; the edge of the object is looked for up to so far outside the mask, and on either side in the quick test of its edge."""

RING_PX = 24
"""px; the colors of the background are those from the band to so far from the mask."""

ITERATIONS = 3
"""Times the colors are learned: the first time from the mask as given, then from what was found."""

COLOR_BITS = 4
"""Bits per channel that tell colors apart."""

HISTOGRAM_SMOOTHING = 0.6
"""Cells of the color histograms by which they are smoothed: light varies along a cable."""

SHADES, SHADOW_SHARE = (0.85, 0.7, 0.55, 0.4), 0.03
"""Brightness of the background in the cable's shadow, and how frequent each is held to be: a ragged mask seldom shows it."""

MIN_FREQUENCY = 1e-5
"""Frequency of a color that was never seen; it bounds the log ratios. With 1e-4, 2 of 45 right frames of 48 are lost."""

SMOOTHING_PX = 0.8
"""px; standard deviation of the Gauss filter of log ratios."""

MIN_CONTRAST = 2.5
"""Median log ratio in the mask from which on the colors tell the object from what is around it."""

MIN_THICKNESS_PX, MIN_ELONGATION = 3.5, 16.0
"""Half-width in px, and area in its squares, of a part that is not dropped: a cable in the colors of the background."""

MIN_RAGGEDNESS = 0.25
"""Pixels more than one px off, per pixel of the mask's edge, that make a mask ragged; true masks have 0.03, ragged ones 0.4."""

MAX_OFF_SHARE = 0.12
"""Share of the edge's pixels whose largest step within BAND_PX is not at the edge, up to which a mask surely is not ragged."""


def repair_mask(mask: Bools, color: Array) -> Bools:
    """Move the edge of a ragged mask to where the colors of the image change, and drop the parts that show the background.

    The colors in the mask and in a ring around it are compared. A pixel up to 4 px outside the mask, or in it, belongs to the
    object if its color and those of its neighbors are more frequent in the mask than around it. The colors are then learned again
    from what was found. Darker shades of the background count as background, since cables cast shadows.

    Parameters
    ----------
    mask
        (H, W) bool.
    color
        (H, W, 3) uint8 RGB.

    Returns
    -------
    (H, W) bool; `mask` itself if its edge already is where the colors change, or the colors do not tell the object from the
    background.
    """
    if not _may_be_ragged(mask, color):
        return mask
    rows, columns = _widened(bounding_box(mask), RING_PX, mask.shape)
    part, image = np.ascontiguousarray(mask[rows, columns]), color[rows, columns]
    outside = cv2.distanceTransform((~part).view(np.uint8), cv2.DIST_L2, 3)
    in_band, in_ring = outside <= BAND_PX, outside <= RING_PX
    square = np.ones((3, 3), np.uint8)
    found, around = part, in_ring & ~in_band
    for _ in range(ITERATIONS):
        core = cv2.erode(found.view(np.uint8), square).view(bool)
        inside = core if core.any() else found
        ratio = _log_ratio(image, inside, around)
        if not inside.any() or np.median(ratio[inside]) < MIN_CONTRAST:
            return mask
        likely = cv2.GaussianBlur(ratio, (0, 0), SMOOTHING_PX) > 0
        found = likely & in_band
        around = in_ring & ~cv2.dilate(found.view(np.uint8), square).view(bool)
    found |= _long_parts(part & ~found)
    within = cv2.distanceTransform(part.view(np.uint8), cv2.DIST_L2, 3)
    off = (found & (outside > 1)) | (~found & (within > 1))
    if np.count_nonzero(off) < MIN_RAGGEDNESS * np.count_nonzero(_edge(part)):
        return mask
    result = np.zeros_like(mask)
    result[rows, columns] = found
    return result


def _may_be_ragged(mask: Bools, color: Array) -> bool:
    """Tell whether the largest step of color across the edge of the mask lies elsewhere at many places, by a sample of them."""
    height, width = mask.shape
    margin = 2 * BAND_PX
    v, u = np.divmod(np.flatnonzero(_edge(mask))[:: 2 * BAND_PX + 1], width)  # nearer ones have the same profiles
    inner = (u >= margin) & (v >= margin) & (u < width - margin) & (v < height - margin)
    u, v = u[inner], v[inner]
    side = np.arange(-BAND_PX, BAND_PX + 1)
    dv, du = np.repeat(side, len(side)), np.tile(side, len(side))
    window = mask.ravel()[(v * width + u)[:, None] + dv * width + du]
    outwards = -np.column_stack((window @ du, window @ dv)).astype(float)
    size = np.linalg.norm(outwards, axis=1)
    directed = size > 0
    outwards = outwards[directed] / size[directed, None]
    along = np.arange(-BAND_PX, BAND_PX + 1)
    at = np.rint(np.column_stack((u, v))[directed, None] + outwards[:, None] * along[:, None]).astype(int)
    profile = color[at[..., 1], at[..., 0]].astype(int)
    largest = np.abs(np.diff(profile, axis=1)).sum(axis=2).argmax(axis=1)
    return bool(len(largest)) and float(np.mean(np.abs(along[largest]) > 1)) > MAX_OFF_SHARE


def _edge(mask: Bools) -> Bools:
    """Return the pixels of a mask (H, W) that have a neighbor outside it."""
    return np.asarray(mask & ~cv2.erode(mask.view(np.uint8), np.ones((3, 3), np.uint8)).view(bool))


def _widened(box: tuple[slice, slice], margin: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return the box with a margin in px on all sides, within the image."""
    rows, columns = (slice(max(0, s.start - margin), min(size, s.stop + margin)) for s, size in zip(box, shape, strict=True))
    return rows, columns


def _long_parts(dropped: Bools) -> Bools:
    """Return the connected parts of what is dropped from a mask that are as thick as a cable, and long."""
    distance = cv2.distanceTransform(dropped.view(np.uint8), cv2.DIST_L2, 3)
    count, label, stats, _ = cv2.connectedComponentsWithStats(dropped.view(np.uint8), connectivity=8)
    thickest = np.zeros(count)
    np.maximum.at(thickest, label[dropped], distance[dropped])
    long = (thickest > MIN_THICKNESS_PX) & (stats[:, cv2.CC_STAT_AREA] > MIN_ELONGATION * thickest**2)
    long[0] = False
    return np.asarray(long[label])


def _log_ratio(image: Array, inside: Bools, around: Bools) -> Array:
    """Return the log ratio (H, W) float32 of each pixel's color: how frequent it is inside over how frequent around."""
    theirs = image[around]
    theirs = theirs[:: max(1, len(theirs) // 20_000)]
    background = _counts(theirs) + SHADOW_SHARE * sum(_counts((theirs * shade).astype(np.uint8)) for shade in SHADES)
    table = np.log(_frequencies(_counts(image[inside])) / _frequencies(background))
    return np.asarray(table.astype(np.float32)[_cells(image)])


def _cells(colors: Array) -> Array:
    """Return the number of the histogram's cell that each color (..., 3) uint8 falls into."""
    cell = (colors >> (8 - COLOR_BITS)).astype(np.int32)
    return (cell[..., 0] << 2 * COLOR_BITS) + (cell[..., 1] << COLOR_BITS) + cell[..., 2]


def _counts(colors: Array) -> Floats:
    return np.bincount(_cells(colors), minlength=1 << 3 * COLOR_BITS).astype(float)


def _frequencies(counts: Floats) -> Floats:
    """Return the smoothed frequencies of the cells, (4096,), none of them 0."""
    side = 1 << COLOR_BITS
    smooth = gaussian_filter(counts.reshape(side, side, side), HISTOGRAM_SMOOTHING, mode="nearest").ravel()
    return np.asarray(smooth / max(float(smooth.sum()), 1e-9) + MIN_FREQUENCY)
