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
RIM_RADII = 0.5
UNKNOWN_RADII = 3.0
LEAST = 3.0
SMOOTH = 1.0
LEAST_DENSITY = 1e-5
LEAST_SHARE = 0.02
MIN_VALLEY = 8.0
LONG = 12.0


def color_layers(facts: FrameFacts, color: Array, radius: float) -> Array:
    box = _grown(facts.slices, math.ceil(4 * radius), facts.mask.shape)
    mask = facts.mask[box]
    chroma = _chroma(color[box])
    hue, saturation, cell = _hue_bin(chroma), np.hypot(*np.moveaxis(chroma, 2, 0)), _cell(chroma)
    colored = mask & (saturation > MIN_SATURATION)
    gray = np.count_nonzero(mask & ~colored) > 0.05 * np.count_nonzero(mask)
    if hue_modes(np.bincount(hue[colored], saturation[colored], HUE_BINS)).max() + gray < 2:
        return np.zeros((0, 0), np.uint8)
    distance = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    ring = dilate(mask, 3 * radius) & ~dilate(mask, radius / 2 + 1)
    known = mask & ((distance > RIM_RADII * radius) | (_density(cell[mask]) > _density(cell[ring]))[cell])
    core = known & colored
    mode_of = hue_modes(np.bincount(hue[core], saturation[core], HUE_BINS))
    count = int(mode_of.max()) + 1
    seen = np.where(known, np.where(colored, mode_of[hue], count), 0).astype(np.uint8)
    side = 2 * max(1, round(0.2 * radius)) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    labels = np.zeros(mask.shape, np.uint8)
    for k in range(1, count + 1):
        opened = cv2.morphologyEx((seen == k).view(np.uint8), cv2.MORPH_OPEN, disc)
        labels[_long_parts(opened > 0, LEAST * radius)] = k
    labels = _merged(_spread(labels, mask), count, color[box], radius)
    used = np.unique(labels[labels > 0])
    if len(used) < 2:
        return np.zeros((0, 0), np.uint8)
    out = np.zeros(facts.mask.shape, np.uint8)
    out[box] = np.where(labels > 0, np.searchsorted(used, labels) + 1, 0)
    return out


def _spread(labels: Array, mask: Bools) -> Array:
    """Return labels (h, w) uint8 of all pixels of a mask: each that of the nearest labelled pixel."""
    if not labels.any():
        return labels
    _, nearest = cv2.distanceTransformWithLabels((labels == 0).view(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    of_pixel = np.zeros(int(nearest.max()) + 1, np.uint8)
    of_pixel[nearest[labels > 0]] = labels[labels > 0]
    return np.where(mask, of_pixel[nearest], 0).astype(np.uint8)


def _merged(labels: Array, count: int, color: Array, radius: float) -> Array:
    """Return labels of which parts are united where no valley lies between them: each takes the label of the largest."""
    luma = cv2.cvtColor(cv2.GaussianBlur(np.ascontiguousarray(color), (5, 5), 1.0), cv2.COLOR_RGB2GRAY)
    side = 2 * max(1, round(0.7 * radius)) + 1
    valley = cv2.morphologyEx(luma, cv2.MORPH_BLACKHAT, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
    part, sizes, label_of = np.zeros(labels.shape, np.int64), [0], [0]
    for k in range(1, count + 1):
        n, own, stats, _ = cv2.connectedComponentsWithStats((labels == k).view(np.uint8), connectivity=8)
        part[own > 0] = own[own > 0] + len(sizes) - 1
        sizes += stats[1:, cv2.CC_STAT_AREA].tolist()
        label_of += [k] * (n - 1)
    pairs = []
    for a, b in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        meet = (part[a] != part[b]) & (part[a] > 0) & (part[b] > 0)
        lows, highs = np.minimum(part[a], part[b])[meet], np.maximum(part[a], part[b])[meet]
        pairs.append(np.column_stack((lows, highs, np.maximum(valley[a], valley[b])[meet], *np.nonzero(meet))))
    pairs = np.concatenate(pairs)
    new = np.array(label_of, np.uint8)
    bundled = False
    keys = pairs[:, 0] * len(sizes) + pairs[:, 1]
    for key in np.unique(keys).tolist():
        rows = pairs[keys == key]
        if len(rows) < LONG * radius:
            continue
        at = rows[:, 3:] - rows[:, 3:].min(axis=0)
        border = np.zeros(at.max(axis=0) + 1, bool)
        border[tuple(at.T)] = True
        rows = rows[_long_parts(border, LONG * radius)[tuple(at.T)]]
        if not len(rows):
            continue
        if np.median(rows[:, 2]) >= MIN_VALLEY:
            bundled = True
            continue
        low, high = divmod(key, len(sizes))
        big, small = (low, high) if sizes[low] >= sizes[high] else (high, low)
        pass
    return new[part] if bundled else np.zeros_like(labels)


def _long_parts(mask: Bools, length: float) -> Bools:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    extent = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    kept = extent >= length
    kept[0] = False
    return kept[labels]


def _chroma(color):
    y, cr, cb = np.moveaxis(cv2.cvtColor(cv2.GaussianBlur(np.ascontiguousarray(color), (5, 5), 1.0), cv2.COLOR_RGB2YCrCb).astype(np.float32), 2, 0)
    y = np.maximum(y, MIN_LUMA)
    return np.stack(((cr - 128) / y, (cb - 128) / y), axis=2)


def _cell(chroma):
    at = np.clip((chroma + MAX_CHROMA) / (2 * MAX_CHROMA) * CELLS, 0, CELLS - 1).astype(np.int64)
    return at[..., 0] * CELLS + at[..., 1]


def _density(cell):
    counts = np.bincount(cell.ravel(), minlength=CELLS**2).reshape(CELLS, CELLS).astype(float)
    return gaussian_filter(counts, SMOOTH, mode="constant").ravel() / max(len(cell), 1)


def _hue_bin(chroma):
    return (np.arctan2(chroma[..., 0], chroma[..., 1]) / (2 * np.pi) % 1 * HUE_BINS).astype(np.int64) % HUE_BINS


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
