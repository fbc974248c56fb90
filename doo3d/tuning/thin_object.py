"""The thin, long thing in an image, before anything is known about it but perhaps a place on it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ..config import HsvRange
from ..geometry.mask import median_half_width
from ..kernels.medial_axis import medial_axis
from ..stages.segment.methods.hsv import in_ranges
from ..types import Array, Bools

LONG = 5.0
"""Widths that a thin thing is long, at least."""

BROAD = 0.09
"""Of the image's shorter side, the width of what is too broad to be the thing."""

SHARE = 0.6
"""Of what has the colour, the least share that has to be thin and long: else the colour is not the thing's own."""

SNAP = 3
"""px round a pick of which the colour is taken."""

NEUTRAL = 60
"""Saturation up to which the hue says nothing."""

DARK = 45
"""Value up to which the saturation says nothing either."""


@dataclass(frozen=True)
class Thin:
    """What of a mask is thin and long.

    mask : (H, W) bool, those pieces alone. share : 0 to 1, of the mask's pixels. length : px, of all of them together.
    half : px, half of the usual width.
    """

    mask: Bools
    share: float
    length: float
    half: float


def thin_part(mask: Bools) -> Thin:
    """The pieces (8-connected) of a mask (H, W) that are longer than LONG times their width and not broad."""
    none = Thin(np.zeros_like(mask), 0.0, 0.0, 0.0)
    if not mask.any():
        return none
    count, label, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8))
    rows, columns, inside = medial_axis(mask.copy())
    owner, half = label[rows, columns], np.maximum(inside - 0.5, 0.5)
    total = np.bincount(owner, half, count)
    usual = np.bincount(owner, half * half, count) / np.maximum(total, 1e-9)
    widest = np.zeros(count)
    np.maximum.at(widest, owner, half)
    area = stats[:, cv2.CC_STAT_AREA]
    length = area / np.maximum(2 * usual, 1)
    limit = BROAD * min(mask.shape) / 2
    good = (length > LONG * 2 * usual) & (usual < limit) & (widest < 2 * limit) & (widest < 5 * usual + 2) & (area >= 30)
    good[0] = False
    if not good.any():
        return none
    half_width = median_half_width(half[good[owner]])
    good &= (usual > 0.4 * half_width) & (usual < 2.5 * half_width)
    return Thin(good[label], float(area[good].sum() / area[1:].sum()), float(length[good].sum()), half_width)


def hsv_of(color: Array) -> Array:
    """(H, W, 3) uint8 RGB -> OpenCV's 8-bit HSV."""
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2HSV))


def at_pick(color: Array, pick: tuple[int, int]) -> Thin | None:
    """The thin thing that lies at a place (x, y) px, by its colour there; None where what has it is nothing thin."""
    x, y = pick
    near = (slice(max(y - SNAP, 0), y + SNAP + 1), slice(max(x - SNAP, 0), x + SNAP + 1))
    closer = (slice(max(y - 1, 0), y + 2), slice(max(x - 1, 0), x + 2))
    here = np.zeros(color.shape[:2], dtype=bool)
    here[near] = True
    hsv = hsv_of(color)
    found = [_own(color, hsv[place].reshape(-1, 3), here) for place in (closer, near)]
    return max((each for each in found if each is not None), key=_worth, default=None)


def _own(color: Array, pixels: Array, here: Bools) -> Thin | None:
    """The thin thing of the colour of a few HSV pixels (N, 3), their duller half left out, that passes through `here`."""
    sharp = pixels[np.argsort(pixels[:, 1], kind="stable")][len(pixels) // 2 :].astype(int)
    found = [thin_part(in_ranges(color, (box,))) for box in _about(sharp)]
    good = [each for each in found if each.share >= SHARE and (each.mask & here).any()]
    return max(good, key=_worth, default=None)


def by_itself(color: Array, within: tuple[int, int, int, int] | None = None) -> Thin | None:
    """The longest thin thing whose colour is its own, of the image or of a box (x, y, w, h) px of it; None where there is none.

    What has a colour goes before what is only darker or brighter: shadows are that too.
    """
    height, width = color.shape[:2]
    x, y, w, h = within or (0, 0, width, height)
    part = color[y : y + h, x : x + w]
    least = 0.15 * np.hypot(*part.shape[:2])
    for boxes in (_coloured(part), _neutral()):
        found = [thin_part(in_ranges(part, (box,))) for box in boxes]
        found = [each for each in found if each.share >= SHARE and each.length >= least]
        if found:
            best = max(found, key=_worth)
            closer = _own(part, hsv_of(part)[best.mask], best.mask)
            best = closer if closer is not None and closer.length > 0.7 * best.length else best
            mask = np.zeros((height, width), dtype=bool)
            mask[y : y + h, x : x + w] = best.mask
            return Thin(mask, best.share, best.length, best.half)
    return None


def _worth(found: Thin) -> float:
    return float(found.length * found.half**0.5 * found.share**3)


def _about(pixels: Array) -> Iterator[HsvRange]:
    """Boxes about the colours of a few pixels (N, 3), from wide to narrow."""
    saturation, value = (int(np.median(pixels[:, i])) for i in (1, 2))
    if saturation > NEUTRAL and value > DARK:
        hue = _middle_hue(pixels[:, 0])
        for half in (12, 8, 5):
            for share in (0.45, 0.6, 0.75):
                low = (round(hue - half) % 180, int(share * saturation), int(0.25 * value))
                yield HsvRange(low=low, high=(round(hue + half) % 180, 255, 255))
    if saturation <= 2 * NEUTRAL or value <= 2 * DARK:
        top = 255 if value <= 2 * DARK else min(255, saturation + 40)
        for half in (50, 30, 18):
            low_value = 0 if value < 110 else value - half
            yield HsvRange(low=(0, 0, low_value), high=(179, top, 255 if value > 200 else min(255, value + half)))


def _middle_hue(hues: Sequence[int] | Array) -> float:
    turn = np.exp(2j * np.pi * np.asarray(hues, dtype=float) / 180).mean()
    return float(np.angle(turn) * 90 / np.pi) % 180


def _coloured(color: Array) -> Iterator[HsvRange]:
    """Boxes of one hue each, of those hues that the image has."""
    hsv = hsv_of(color).reshape(-1, 3)
    for least in (60, 90, 130, 180):
        counts = np.bincount(hsv[(hsv[:, 1] >= least) & (hsv[:, 2] > 30), 0], minlength=180)
        for hue in range(0, 180, 6):
            share = counts[np.arange(hue - 9, hue + 10) % 180].sum() / len(hsv)
            if 5e-4 < share < 0.3:
                yield HsvRange(low=((hue - 9) % 180, least, 30), high=((hue + 9) % 180, 255, 255))


def _neutral() -> Iterator[HsvRange]:
    """Boxes of what is dark, and of what is bright, whatever its hue."""
    for value in (40, 60, 85):
        yield HsvRange(low=(0, 0, 0), high=(179, 255, value))
    for value in (180, 205, 230):
        yield HsvRange(low=(0, 0, value), high=(179, 50, 255))
