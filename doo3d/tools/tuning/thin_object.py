"""Find the thin, long object in an image, by its color alone or by a pixel on it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ...config import HsvRange
from ...geometry.mask import median_half_width
from ...kernels import medial_axis
from ...segment.methods.hsv import in_ranges
from ...types import Array, Bools

MIN_ASPECT = 5.0
"""Least length of a thin object, in its widths."""

MAX_WIDTH_SHARE = 0.09
"""Greatest width of a thin object, as a fraction of the image's shorter side."""

MIN_THIN_SHARE = 0.6
"""Least fraction of a color's pixels in thin, long parts; below it, other things have this color, too."""

PICK_RADIUS_PX = 3
"""Half the side of the window around a pick from which the color is sampled."""

MIN_HUE_SATURATION = 60
"""Saturation, 0 to 255, up to which the hue is unreliable."""

MIN_HUE_VALUE = 45
"""Value, 0 to 255, up to which hue and saturation are unreliable."""

MIN_AREA_PX = 30
"""Least number of pixels of a thin component."""

MIN_DIAGONAL_SHARE = 0.15
"""Least length of an object found without a pick, as a fraction of the searched region's diagonal."""


@dataclass(frozen=True)
class ThinObject:
    """The thin, long parts of a mask, such as a cable's pixels among all pixels of its color.

    Attributes
    ----------
    mask
        (H, W) bool, the pixels of the thin, long parts only.
    share
        fraction, 0 to 1, of the original mask's pixels that belong to these parts.
    length
        total length of these parts, px.
    half_width
        typical half width of these parts, px.
    """

    mask: Bools
    share: float
    length: float
    half_width: float


def thin_components(mask: Bools) -> ThinObject:
    """Return the thin, long parts of a mask (H, W) bool; if there are none, the result has an empty mask and zeros.

    A part is an 8-connected component. It is kept if it is more than 5 times as long as wide, has 30 pixels or more, is narrower
    than 9 % of the shorter side of the image, and is about as wide as the other parts that are kept.
    """
    none = ThinObject(np.zeros_like(mask), 0.0, 0.0, 0.0)
    if not mask.any():
        return none
    count, label, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8))
    rows, columns, inside = medial_axis(mask.copy())
    component, half = label[rows, columns], np.maximum(inside - 0.5, 0.5)
    total = np.bincount(component, half, count)
    typical = np.bincount(component, half * half, count) / np.maximum(total, 1e-9)
    widest = np.zeros(count)
    np.maximum.at(widest, component, half)
    area = stats[:, cv2.CC_STAT_AREA]
    length = area / np.maximum(2 * typical, 1)
    limit = MAX_WIDTH_SHARE * min(mask.shape) / 2
    is_narrow = (typical < limit) & (widest < 2 * limit) & (widest < 5 * typical + 2)
    chosen = (length > MIN_ASPECT * 2 * typical) & is_narrow & (area >= MIN_AREA_PX)
    chosen[0] = False
    if not chosen.any():
        return none
    half_width = median_half_width(half[chosen[component]])
    chosen &= (typical > 0.4 * half_width) & (typical < 2.5 * half_width)
    return ThinObject(chosen[label], float(area[chosen].sum() / area[1:].sum()), float(length[chosen].sum()), half_width)


def hsv_of(color: Array) -> Array:
    """Return an image (H, W, 3) uint8 RGB in OpenCV's 8-bit HSV, (H, W, 3): hue 0 to 179, saturation and value 0 to 255."""
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2HSV))


def object_at(color: Array, pick: tuple[int, int]) -> ThinObject | None:
    """Return the thin, long object at a pixel, found by its color there.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    pick
        (x, y) px, in the image. The color is sampled in small windows around this pixel; the object must pass within 3 px of it.

    Returns
    -------
    ThinObject or None
        None if no thin, long object passes there, or if less than 60 % of the pixels of its color belong to thin, long objects.
    """
    x, y = pick
    wide = (slice(max(y - PICK_RADIUS_PX, 0), y + PICK_RADIUS_PX + 1), slice(max(x - PICK_RADIUS_PX, 0), x + PICK_RADIUS_PX + 1))
    narrow = (slice(max(y - 1, 0), y + 2), slice(max(x - 1, 0), x + 2))
    region = np.zeros(color.shape[:2], dtype=bool)
    region[wide] = True
    hsv = hsv_of(color)
    candidates = [_object_of_color(color, hsv[window].reshape(-1, 3), region) for window in (narrow, wide)]
    return max((each for each in candidates if each is not None), key=_rating, default=None)


def _object_of_color(color: Array, pixels: Array, region: Bools) -> ThinObject | None:
    """Return the best thin object that passes through a region (H, W) and has the color of HSV pixels (N, 3).

    Only the more saturated half of the pixels is used. None if there is no such object.
    """
    saturated = pixels[np.argsort(pixels[:, 1], kind="stable")][len(pixels) // 2 :].astype(int)
    candidates = [thin_components(in_ranges(color, (box,))) for box in _boxes_around(saturated)]
    suitable = [each for each in candidates if each.share >= MIN_THIN_SHARE and (each.mask & region).any()]
    return max(suitable, key=_rating, default=None)


def find_thin_object(color: Array, region: tuple[int, int, int, int] | None = None) -> ThinObject | None:
    """Return the most prominent thin, long object with a color (almost) of its own; None if there is none.

    Longer and wider objects are preferred, and above all objects whose color occurs hardly anywhere else. Dark or bright objects
    without a hue are considered only if there is no colorful object, since shadows look like them.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    region
        (x, y, w, h) px, upper left corner, width and height of the region to search in; None for the whole image.
    """
    height, width = color.shape[:2]
    x, y, w, h = region or (0, 0, width, height)
    part = color[y : y + h, x : x + w]
    min_length = MIN_DIAGONAL_SHARE * np.hypot(*part.shape[:2])
    for boxes in (_hue_boxes(part), _neutral_boxes()):
        candidates = [thin_components(in_ranges(part, (box,))) for box in boxes]
        candidates = [each for each in candidates if each.share >= MIN_THIN_SHARE and each.length >= min_length]
        if candidates:
            best = max(candidates, key=_rating)
            refined = _object_of_color(part, hsv_of(part)[best.mask], best.mask)
            best = refined if refined is not None and refined.length > 0.7 * best.length else best
            mask = np.zeros((height, width), dtype=bool)
            mask[y : y + h, x : x + w] = best.mask
            return ThinObject(mask, best.share, best.length, best.half_width)
    return None


def _rating(candidate: ThinObject) -> float:
    """Return the rating of a candidate: higher for long ones, and for those whose color is theirs alone."""
    return float(candidate.length * candidate.half_width**0.5 * candidate.share**3)


def _boxes_around(pixels: Array) -> Iterator[HsvRange]:
    """Yield boxes around the colors of a few HSV pixels (N, 3), from wide to narrow."""
    saturation, value = (int(np.median(pixels[:, i])) for i in (1, 2))
    if saturation > MIN_HUE_SATURATION and value > MIN_HUE_VALUE:
        hue = mean_hue(pixels[:, 0])
        for half in (12, 8, 5):
            for share in (0.45, 0.6, 0.75):
                low = (round(hue - half) % 180, int(share * saturation), int(0.25 * value))
                yield HsvRange(low=low, high=(round(hue + half) % 180, 255, 255))
    if saturation <= 2 * MIN_HUE_SATURATION or value <= 2 * MIN_HUE_VALUE:
        max_saturation = 255 if value <= 2 * MIN_HUE_VALUE else min(255, saturation + 40)
        for half in (50, 30, 18):
            low_value = 0 if value < 110 else value - half
            yield HsvRange(low=(0, 0, low_value), high=(179, max_saturation, 255 if value > 200 else min(255, value + half)))


def mean_hue(hues: Sequence[int] | Array) -> float:
    """Return the circular mean of hues, 0 to 180."""
    mean = np.exp(2j * np.pi * np.asarray(hues, dtype=float) / 180).mean()
    return float(np.angle(mean) * 90 / np.pi) % 180


def _hue_boxes(color: Array) -> Iterator[HsvRange]:
    """Yield an HSV box around each hue that occurs in the image."""
    hsv = hsv_of(color).reshape(-1, 3)
    for min_saturation in (60, 90, 130, 180):
        counts = np.bincount(hsv[(hsv[:, 1] >= min_saturation) & (hsv[:, 2] > 30), 0], minlength=180)
        for hue in range(0, 180, 6):
            share = counts[np.arange(hue - 9, hue + 10) % 180].sum() / len(hsv)
            if 5e-4 < share < 0.3:
                yield HsvRange(low=((hue - 9) % 180, min_saturation, 30), high=((hue + 9) % 180, 255, 255))


def _neutral_boxes() -> Iterator[HsvRange]:
    """Yield HSV boxes of any hue: of dark pixels, and of bright ones."""
    for value in (40, 60, 85):
        yield HsvRange(low=(0, 0, 0), high=(179, 255, value))
    for value in (180, 205, 230):
        yield HsvRange(low=(0, 0, value), high=(179, 50, 255))
