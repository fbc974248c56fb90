"""The box in HSV that takes most of a thing and least of what is round it."""

from __future__ import annotations

import cv2
import numpy as np

from ..config import HsvRange
from ..stages.segment.mask_cleanup import remove_small_components
from ..types import Array, Bools, Floats, Ints
from .thin_object import DARK, NEUTRAL, Thin, hsv_of

SLACK = 0.004
"""Of the quality of a box, what may be given up for wider bounds: shadows and highlights of other frames."""

SPARE = 6
"""Hues by which either bound goes beyond what the thing has here, at most."""

NARROW, TIE = 2e-4, 1e-7
"""What a step of hue, and one of saturation or value, is to add to the quality of a box, or it is left out."""

DIMMEST, DULLEST = 20, 25
"""The least value and saturation of a coloured thing: what is darker or greyer has no hue that could be told."""

SAMPLE = 400_000
"""Pixels of the background that are looked at, evenly."""


def fit_range(color: Array, thing: Thin, others: Bools | None = None) -> HsvRange:
    """The box with the largest share `taken / (thing + background taken)`, and then as wide as costs nothing.

    Coordinates in turn, each with all pairs of its bounds. Hues are counted from the thing's own, so that red does not wrap.

    color : (H, W, 3) uint8 RGB. others : (H, W) bool, pixels of neither side, such as other things that are looked for too.
    """
    hsv = hsv_of(color)
    beside = ~thing.mask if others is None else ~thing.mask & ~others
    own, rest = hsv[thing.mask].astype(int), hsv[beside].astype(int)
    weight = max(1.0, len(rest) / SAMPLE)
    rest = rest[:: int(weight)]
    coloured = bool(np.median(own[:, 1]) > NEUTRAL and np.median(own[:, 2]) > DARK)
    shift = _shift(own[:, 0])
    own[:, 0], rest[:, 0] = (own[:, 0] + shift) % 180, (rest[:, 0] + shift) % 180
    bounds = np.array([[0, 179], [0, 255], [0, 255]])
    if coloured:
        bounds[0] = np.percentile(own[:, 0], (2, 98)).astype(int)
    axes = (0, 1, 2) if coloured else (2, 1)
    for _ in range(4):
        before = bounds.copy()
        for axis in axes:
            quality = _pairs(own, rest, bounds, axis, float(int(weight)))
            bounds[axis] = np.unravel_index(int(np.argmax(quality)), quality.shape)
        if (bounds == before).all():
            break
    for axis in axes:
        quality = _pairs(own, rest, bounds, axis, float(int(weight)))
        bounds[axis] = _widened(quality, bounds[axis], SPARE if axis == 0 else 256)
    if coloured:
        bounds[1:, 0] = np.maximum(bounds[1:, 0], (DULLEST, DIMMEST))
    low, high = bounds.T
    hues = ((int(low[0]) - shift) % 180, (int(high[0]) - shift) % 180) if coloured else (0, 179)
    return HsvRange(low=(hues[0], int(low[1]), int(low[2])), high=(hues[1], int(high[1]), int(high[2])))


def _shift(hues: Ints) -> int:
    """What to add to hues so that their middle comes to lie at 90, far from where they wrap."""
    turn = np.exp(2j * np.pi * hues / 180).mean()
    return round(90 - float(np.angle(turn)) * 90 / np.pi) % 180


def _pairs(own: Ints, rest: Ints, bounds: Ints, axis: int, weight: float) -> Floats:
    """The quality of the box (low, high) for all pairs of bounds of one axis, the others as they are; 0 of low above high."""
    counts = []
    for pixels in (own, rest):
        inside = np.ones(len(pixels), dtype=bool)
        for other in range(3):
            if other != axis:
                inside &= (pixels[:, other] >= bounds[other, 0]) & (pixels[:, other] <= bounds[other, 1])
        counts.append(np.concatenate(([0], np.cumsum(np.bincount(pixels[inside, axis], minlength=180 if axis == 0 else 256)))))
    taken, wrong = (count[None, 1:] - count[:-1, None] for count in counts)
    width = np.subtract.outer(-np.arange(len(taken)), -np.arange(len(taken)))
    return np.asarray(np.triu(taken / (len(own) + weight * np.maximum(wrong, 0)) - (NARROW if axis == 0 else TIE) * width, 0))


def _widened(quality: Floats, best: Ints, most: int) -> tuple[int, int]:
    """Either bound moved outwards, by `most` at most, as long as the quality stays within SLACK of the best."""
    low, high = int(best[0]), int(best[1])
    enough = float(quality[low, high]) - SLACK
    start, end = max(0, low - most), min(len(quality) - 1, high + most)
    while low > start and quality[low - 1, high] >= enough:
        low -= 1
    while high < end and quality[low, high + 1] >= enough:
        high += 1
    return low, high


def whole(color: Array, thing: Thin) -> Bools:
    """The thing with its highlights, which lie within it, and the pixels at its sides that look more like it than like what
    is round it: (H, W) bool.
    """
    around = max(3, 2 * round(thing.half) + 1)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (around, around))
    solid = remove_small_components(thing.mask, max(2, round(4 * thing.half**2)))
    reach = 2 * max(1, round(thing.half / 3)) + 1
    closed = cv2.morphologyEx(solid.view(np.uint8), cv2.MORPH_CLOSE, disc)
    near = cv2.dilate(closed, np.ones((reach, reach), np.uint8)) > 0
    lab = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2LAB).astype(np.float32)
    lab[:, :, 0] *= 0.5  # light and shadow say less than colour
    beyond = (cv2.dilate(near.view(np.uint8), disc) > 0) & ~near
    side = 4 * around + 1
    own, ground = (_local_mean(lab, where, side) for where in (solid, beyond))
    like = np.linalg.norm(lab - own, axis=2) < np.linalg.norm(lab - ground, axis=2)
    return np.asarray(solid | (near & like))


def _local_mean(values: Array, where: Bools, side: int) -> Array:
    """The mean (H, W, 3) of values over the chosen pixels in the square of `side` px round each; 0 where there are none."""
    count = cv2.boxFilter(where.astype(np.float32), -1, (side, side), normalize=False)
    total = cv2.boxFilter(values * where[:, :, None], -1, (side, side), normalize=False)
    return np.asarray(total / np.maximum(count, 1e-6)[:, :, None])
