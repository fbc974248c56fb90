"""Fit the HSV box that contains most pixels of an object and few of its background."""

import cv2
import numpy as np

from ...config import HsvRange
from ...scene.frame_facts import FrameFacts
from ...types import Array, Bools, Floats, Ints
from .thin_object import MIN_HUE_SATURATION, MIN_HUE_VALUE, ThinObject, hsv_of, mean_hue

MAX_QUALITY_LOSS = 0.004
"""Greatest loss of a box's quality, 0 to 1, for wider bounds, which leave room for shadows and highlights of other frames."""

MAX_HUE_WIDENING = 6
"""Greatest number of hues (of 180) by which a bound may exceed the object's hues in this frame."""

HUE_COST, LEVEL_COST = 2e-4, 1e-7
"""Least gain of quality per added step of hue, and per step of saturation or value, so that narrow boxes win ties."""

MIN_VALUE, MIN_SATURATION = 20, 25
"""Least lower bounds of value and saturation for an object with a hue; darker or duller pixels have no reliable hue."""

MAX_BACKGROUND_PIXELS = 400_000
"""Greatest number of background pixels, evenly sampled, on which boxes are tested."""

MAX_ROUNDS = 4
"""Greatest number of rounds of the coordinate descent, which usually ends after two."""


def fit_range(color: Array, thin: ThinObject, excluded: Bools | None = None) -> HsvRange:
    """Return the HSV box that best separates a thin object from its background, widened where that costs little.

    A gray object gets a box of all hues.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    thin
        the object; all pixels outside its mask are background.
    excluded
        (H, W) bool, pixels that count as neither object nor background, such as those of other objects; None for none.

    Returns
    -------
    HsvRange
        in OpenCV's 8-bit HSV. If the low hue is above the high hue, the range passes through red (hue 0).

    Notes
    -----
    Coordinate descent over hue, saturation and value maximizes the quality, 0 to 1: the number of object pixels in the box,
    divided by the number of all object pixels plus that of background pixels in the box. Each bound is then moved outwards as
    long as the quality drops by at most 0.004, to leave room for shadows and highlights of other frames.
    """
    hsv = hsv_of(color)
    background = ~thin.mask if excluded is None else ~thin.mask & ~excluded
    inner, outer = hsv[thin.mask].astype(int), hsv[background].astype(int)
    step = int(max(1.0, len(outer) / MAX_BACKGROUND_PIXELS))
    outer = outer[::step]
    has_hue = bool(np.median(inner[:, 1]) > MIN_HUE_SATURATION and np.median(inner[:, 2]) > MIN_HUE_VALUE)
    shift = round(90 - mean_hue(inner[:, 0])) % 180  # their circular mean to 90, far from the wrap at 180
    inner[:, 0], outer[:, 0] = (inner[:, 0] + shift) % 180, (outer[:, 0] + shift) % 180
    bounds = np.array([[0, 179], [0, 255], [0, 255]])
    if has_hue:
        bounds[0] = np.percentile(inner[:, 0], (2, 98)).astype(int)
    axes = (0, 1, 2) if has_hue else (2, 1)
    for _ in range(MAX_ROUNDS):
        before = bounds.copy()
        for axis in axes:
            quality = _qualities(inner, outer, bounds, axis, float(step))
            bounds[axis] = np.unravel_index(int(np.argmax(quality)), quality.shape)
        if (bounds == before).all():
            break
    for axis in axes:
        quality = _qualities(inner, outer, bounds, axis, float(step))
        bounds[axis] = _widened(quality, bounds[axis], MAX_HUE_WIDENING if axis == 0 else 256)
    if has_hue:
        bounds[1:, 0] = np.maximum(bounds[1:, 0], (MIN_SATURATION, MIN_VALUE))
    low, high = bounds.T
    hues = ((int(low[0]) - shift) % 180, (int(high[0]) - shift) % 180) if has_hue else (0, 179)
    return HsvRange(low=(hues[0], int(low[1]), int(low[2])), high=(hues[1], int(high[1]), int(high[2])))


def _qualities(inner: Ints, outer: Ints, bounds: Ints, axis: int, weight: float) -> Floats:
    """Return the quality of the box for all pairs (low, high) of bounds of one axis; 0 for low above high.

    Parameters
    ----------
    inner, outer
        (N, 3) HSV pixels of the object and of the background.
    bounds
        (3, 2) bounds (low, high) of each axis; those of `axis` are not used.
    axis
        0 hue, 1 saturation, 2 value.
    weight
        number of background pixels that each pixel of `outer` represents.
    """
    counts = []
    for pixels in (inner, outer):
        inside = np.ones(len(pixels), dtype=bool)
        for other in range(3):
            if other != axis:
                inside &= (pixels[:, other] >= bounds[other, 0]) & (pixels[:, other] <= bounds[other, 1])
        counts.append(np.concatenate(([0], np.cumsum(np.bincount(pixels[inside, axis], minlength=180 if axis == 0 else 256)))))
    hits, false_hits = (count[None, 1:] - count[:-1, None] for count in counts)
    width = np.subtract.outer(-np.arange(len(hits)), -np.arange(len(hits)))
    cost = (HUE_COST if axis == 0 else LEVEL_COST) * width
    return np.asarray(np.triu(hits / (len(inner) + weight * np.maximum(false_hits, 0)) - cost, 0))


def _widened(quality: Floats, best: Ints, max_steps: int) -> tuple[int, int]:
    """Return bounds moved outwards by at most `max_steps` while the quality stays within MAX_QUALITY_LOSS of the best."""
    low, high = int(best[0]), int(best[1])
    min_quality = float(quality[low, high]) - MAX_QUALITY_LOSS
    start, end = max(0, low - max_steps), min(len(quality) - 1, high + max_steps)
    while low > start and quality[low - 1, high] >= min_quality:
        low -= 1
    while high < end and quality[low, high + 1] >= min_quality:
        high += 1
    return low, high


def completed_mask(color: Array, thin: ThinObject) -> Bools:
    """Return the mask of a thin object, (H, W) bool, completed after the object was found by its color.

    Highlights and border pixels, whose color differs slightly from the object's, are added, and specks are removed.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    thin
        the object, as found by its color.

    Notes
    -----
    A pixel in a gap of the mask, or next to its border, is added if its color is nearer to the mean color of the object around it
    than to the mean color of the background around it.
    """
    diameter = max(3, 2 * round(thin.half_width) + 1)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (diameter, diameter))
    solid = FrameFacts(thin.mask, min_pixels=max(2, round(4 * thin.half_width**2))).mask
    reach = 2 * max(1, round(thin.half_width / 3)) + 1
    closed = cv2.morphologyEx(solid.view(np.uint8), cv2.MORPH_CLOSE, disc)
    near = cv2.dilate(closed, np.ones((reach, reach), np.uint8)) > 0
    lab = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2LAB).astype(np.float32)
    lab[:, :, 0] *= 0.5  # lightness varies with light and shadow, so it counts half
    around = (cv2.dilate(near.view(np.uint8), disc) > 0) & ~near
    window = 4 * diameter + 1
    inner, outer = (_local_mean(lab, mask, window) for mask in (solid, around))
    resembles = np.linalg.norm(lab - inner, axis=2) < np.linalg.norm(lab - outer, axis=2)
    return np.asarray(solid | (near & resembles))


def _local_mean(values: Array, mask: Bools, window: int) -> Array:
    """Return the mean (H, W, 3) of the masked pixels' values in a square window of `window` px; 0 if there are none."""
    count = cv2.boxFilter(mask.astype(np.float32), -1, (window, window), normalize=False)
    total = cv2.boxFilter(values * mask[:, :, None], -1, (window, window), normalize=False)
    return np.asarray(total / np.maximum(count, 1e-6)[:, :, None])
