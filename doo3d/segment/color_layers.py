"""Sort the pixels of a mask into layers by color, one for each color of strand.

Keipour et al. (RA-L 2022, section III-A) segment cables of different colors apart.
"""

from __future__ import annotations

import math
from itertools import pairwise

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from ..geometry.mask import dilate
from ..scene.frame_facts import FrameFacts
from ..types import Array, Bools, Floats, Ints

HUE_BINS, HUE_SMOOTHING = 72, 1.5
MIN_SATURATION = 0.12
MAX_SADDLE = 0.4
MIN_LUMA = 16.0
CELLS = 40
MAX_CHROMA = 1.25
RIM_RADII = 0.3
UNKNOWN_RADII = 3.0
LEAST = 6.0


def color_layers(facts: FrameFacts, color: Array, radius: float, wide: float) -> Array:
    box = _grown(facts.slices, math.ceil(4 * radius), facts.mask.shape)
    mask = facts.mask[box]
    chroma = _chroma(color[box])
    hue = _hue_bin(chroma)
    saturation = np.hypot(*np.moveaxis(chroma, 2, 0))
    is_colored = saturation > MIN_SATURATION
    color_of = hue_modes(np.bincount(hue[mask & is_colored], saturation[mask & is_colored], HUE_BINS))
    if color_of.max() < 2:
        return np.zeros((0, 0), np.uint8)
    distance = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    ring = dilate(mask, 3 * radius) & ~dilate(mask, radius / 2 + 1)
    cell = _cell(chroma)
    own, around = (_density(cell[part]) for part in (mask, ring))
    known = mask & is_colored & (own > around)[cell]
    core = known & (distance > RIM_RADII * radius)
    color_of = hue_modes(np.bincount(hue[core], saturation[core], HUE_BINS))
    seen = np.where(known, color_of[hue], 0).astype(np.uint8)
    count = int(color_of.max())
    side = 2 * max(1, round(0.2 * radius)) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    rows, columns, half_width = facts.axis
    axis = rows - box[0].start, columns - box[1].start
    around_ = np.ones((2 * round(radius) + 1,) * 2, np.uint8)
    opened = [cv2.morphologyEx((seen == k).view(np.uint8), cv2.MORPH_OPEN, disc) for k in range(1, count + 1)]
    beside = [cv2.dilate(o, around_)[axis] for o in opened]
    labels = np.zeros(mask.shape, np.uint8)
    is_wide = half_width > wide * radius
    n = 0
    for k, o in enumerate(opened):
        others = np.max([*(beside[:k] + beside[k + 1 :]), 0 * beside[k]], axis=0)
        if np.count_nonzero((beside[k] > 0) & is_wide | (o[axis] > others)) >= LEAST * radius:
            n += 1
            labels[o > 0] = n
    if n < 2:
        return np.zeros((0, 0), np.uint8)
    away, nearest = cv2.distanceTransformWithLabels((labels == 0).view(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    of_pixel = np.zeros(int(nearest.max()) + 1, np.uint8)
    of_pixel[nearest[labels > 0]] = labels[labels > 0]
    out = np.zeros(facts.mask.shape, np.uint8)
    out[box] = np.where(mask, np.where(away <= UNKNOWN_RADII * radius, of_pixel[nearest], n + 1), 0)
    return out


def _chroma(color):
    y, cr, cb = np.moveaxis(cv2.cvtColor(cv2.GaussianBlur(np.ascontiguousarray(color), (5, 5), 1.0), cv2.COLOR_RGB2YCrCb).astype(np.float32), 2, 0)
    y = np.maximum(y, MIN_LUMA)
    return np.stack(((cr - 128) / y, (cb - 128) / y), axis=2)


def _hue_bin(chroma):
    return (np.arctan2(chroma[..., 0], chroma[..., 1]) / (2 * np.pi) % 1 * HUE_BINS).astype(np.int64) % HUE_BINS


def _cell(chroma):
    at = np.clip((chroma + MAX_CHROMA) / (2 * MAX_CHROMA) * CELLS, 0, CELLS - 1).astype(np.int64)
    return at[..., 0] * CELLS + at[..., 1]


def _density(cell):
    counts = np.bincount(cell.ravel(), minlength=CELLS**2).reshape(CELLS, CELLS).astype(float)
    return gaussian_filter(counts, 1.0).ravel() / max(len(cell), 1)


def hue_modes(counts: Array) -> Ints:
    """Return the number of the mode, from 1, of each bin of a histogram of hues (HUE_BINS,); 0 for an empty histogram.

    Modes are merged across the highest saddle until all saddles are low.
    """
    height = gaussian_filter1d(counts, HUE_SMOOTHING, mode="wrap")
    if not height.any():
        return np.zeros(HUE_BINS, dtype=int)
    cuts = np.flatnonzero((height < np.roll(height, 1)) & (height <= np.roll(height, -1)))
    while len(cuts) > 1:
        peak = np.maximum.reduceat(np.roll(height, -cuts[0]), cuts - cuts[0])
        saddle = height[cuts] / np.minimum(peak, np.roll(peak, 1))
        if saddle.max() <= MAX_SADDLE:
            break
        cuts = np.delete(cuts, saddle.argmax())
    number = np.searchsorted(cuts, np.arange(HUE_BINS), side="right")
    return np.where(number == 0, max(len(cuts), 1), number)


def _grown(box: tuple[slice, slice], px: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return a box grown by `px` on all sides, within an image (h, w)."""
    rows, columns = (slice(max(0, side.start - px), min(size, side.stop + px)) for side, size in zip(box, shape, strict=True))
    return rows, columns
