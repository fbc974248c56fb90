"""Strands of a frame told from the surface around them by color, beside what is raised from the plane.

Depth loses strands of 2 to 3 px, since the windows of a stereo camera are wider; far away its noise is as high as a strand. Color
shows both. Depth in turn shows strands of the table's color, and which of the bands in an image are raised.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...types import Array, Bools, Frame, Ints
from .methods.selected import Selected

SHRINK, MEDIAN_PX = 4, 31
"""Factor by which the image is scaled down for the color of the surface, and the window of its median there: 124 px, more than
twice as wide as any strand."""

MIN_BARE_SHARE = 0.05
"""Share of the median's window that is bare surface at least, where raised pixels are replaced by its mean color."""

BLUR_PX = 0.8
"""px; standard deviation of the blur that removes the camera's noise of color."""

MIN_DEVIATION = 1.0
"""Deviation of an 8-bit color of the surface at least: rounding alone has 0.3."""

SEED_DEVIATIONS, GROW_DEVIATIONS = 7.0, 3.5
"""Deviations of the surface's own color: the two thresholds of the hysteresis."""

MIN_SEED_SHARE = 0.2
"""Share of a band's pixels that are above the higher threshold at least."""

EDGE_SHARE, EDGE_PX = 0.5, 2
"""Share of the contrast within so many px that a pixel at the edge of a band has at least: half a pixel of a strand is one."""

MIN_SHADOW_LIGHT = 0.3
"""Share of the lightness that a shadow leaves at least."""

MIN_LENGTH_PX, MIN_LENGTH_WIDTHS, MIN_PIXELS = 40.0, 12.0, 60
"""Length of a strand at least, in px and in widths, and its pixels."""

MAX_WIDTH_RATIO, WIDTH_SLACK_PX = 1.6, 1.0
"""Ratio of the half-widths at the 85th percentile and in the median at most, besides what pixels add: a strand has one width."""

RAISED_SHARE, MIN_RAISED_SHARE = 0.3, 0.1
"""Share of a band that is raised from which on depth sees strands at all; then one with less than the second is flat."""

MAX_RAISED_SHARE = 0.75
"""Share of a band that is raised from which on depth shows it well, and color would only fill the gaps between turns."""

SAME_HUE = 20.0
"""Distance of the color axes of 8-bit CIELAB below which a short raised part is taken for a piece of a strand, as beside an
occluder, in whatever shade."""

FLANK_PX = 10
"""px from a strand told by color within which raised pixels of the surface's color are errors of depth at its edge."""


def select_in_frame(raised: Bools, frame: Frame) -> Selected:
    """Add the strands told by color to the raised pixels, and remove the raised pixels beside them that look like the surface.

    Parameters
    ----------
    raised
        (H, W) bool, the pixels raised from the plane.
    frame
        the frame; without color the raised pixels are returned as they are.
    """
    if frame.color is None:
        return Selected(raised)
    band, surface = _told_by_color(np.ascontiguousarray(frame.color), raised)
    labels, strands = _strands(band)
    if not len(strands):
        return Selected(raised)
    size = np.bincount(labels.ravel())[strands]
    share = np.bincount(labels[raised], minlength=labels.max() + 1)[strands] / size
    flat = (share < MIN_RAISED_SHARE) if (share > RAISED_SHARE).any() else np.zeros(len(strands), dtype=bool)
    told = _of(labels, strands[~flat])
    near = cv2.dilate(told.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * FLANK_PX + 1,) * 2)) > 0
    added = _of(labels, strands[~flat & (share < MAX_RAISED_SHARE)])
    selected = added | (raised & ~(near & surface))
    if len(strands) > flat.sum():
        selected &= ~_other_things(selected, labels, strands[~flat], frame.color)
    note = ""
    if flat.any():
        bands = "1 band that is" if flat.sum() == 1 else f"{flat.sum()} bands that are"
        note = f"segment (strands): left out {bands} flat on the surface, as marks and shadows are; give a mask if wrong"
    return Selected(selected, note)


def _other_things(selected: Bools, labels: Ints, strands: Ints, color: Array) -> Bools:
    """Return the selected parts (H, W) that are too short for a strand and have the color of none, such as boxes and specks."""
    own, parts = _strands(selected)
    hue = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2LAB)[..., 1:]
    color_of = np.array([np.median(hue[labels == strand], axis=0) for strand in strands])
    with_strand = np.zeros(own.max() + 1, dtype=bool)
    with_strand[own[_of(labels, strands) & selected]] = True
    other = ~with_strand
    other[parts] = other[0] = False
    for part in np.flatnonzero(other):
        pixels = hue[own == part]
        alike = np.linalg.norm(color_of - np.median(pixels, axis=0), axis=1).min() < SAME_HUE
        other[part] = len(pixels) < MIN_PIXELS or not alike
    return np.asarray(other[own])


def _told_by_color(color: Array, raised: Bools) -> tuple[Bools, Bools]:
    """Return the pixels (H, W) that differ from the surface around them and are no shadow, and those that look like it."""
    lab = cv2.cvtColor(color, cv2.COLOR_RGB2LAB)
    small = cv2.resize(lab, None, fx=1 / SHRINK, fy=1 / SHRINK, interpolation=cv2.INTER_AREA)
    around = cv2.resize(cv2.medianBlur(_without(small, raised), MEDIAN_PX), lab.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    difference = cv2.GaussianBlur(lab.astype(np.float32), (0, 0), BLUR_PX) - around
    some = np.abs(difference[::SHRINK, ::SHRINK].reshape(-1, 3))
    difference /= np.maximum(1.4826 * np.median(some, axis=0), MIN_DEVIATION).astype(np.float32)
    hue = difference[..., 1] ** 2 + difference[..., 2] ** 2
    contrast = np.sqrt(hue + difference[..., 0] ** 2)
    shadow = (difference[..., 0] < 0) & (hue < GROW_DEVIATIONS**2) & (lab[..., 0] > MIN_SHADOW_LIGHT * around[..., 0])
    told = (contrast > GROW_DEVIATIONS) & ~shadow
    peak = cv2.dilate(contrast, np.ones((2 * EDGE_PX + 1,) * 2, np.uint8))
    edge = cv2.erode(told.astype(np.uint8), np.ones((2 * EDGE_PX + 1,) * 2, np.uint8)) == 0
    told &= ~edge | (contrast > EDGE_SHARE * peak)
    _, labels = cv2.connectedComponents(told.astype(np.uint8), connectivity=8)
    seeds = np.bincount(labels[contrast > SEED_DEVIATIONS], minlength=labels.max() + 1)
    kept = seeds >= MIN_SEED_SHARE * np.bincount(labels.ravel())
    kept[0] = False
    return kept[labels], (contrast < GROW_DEVIATIONS) | shadow


def _without(small: Array, raised: Bools) -> Array:
    """Return the scaled image (h, w, 3) with the surface's color round them in place of raised pixels, so that a coil is none."""
    size = small.shape[1::-1]
    wide = cv2.dilate(raised.astype(np.uint8), np.ones((5, 5)))
    bare = (cv2.resize(wide, size, interpolation=cv2.INTER_AREA) == 0).astype(np.float32)
    share = cv2.blur(bare, (MEDIAN_PX, MEDIAN_PX))
    mean = cv2.blur(small * bare[..., None], (MEDIAN_PX, MEDIAN_PX)) / np.maximum(share, 1e-3)[..., None]
    known = (bare > 0) | (share < MIN_BARE_SHARE)
    return np.where(known[..., None], small, np.rint(mean)).astype(np.uint8)


def _strands(band: Bools) -> tuple[Ints, Ints]:
    """Return the labels (H, W) of the connected parts of a mask, and the labels of those that are long and of one width."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(band.astype(np.uint8), connectivity=8)
    inside = cv2.distanceTransform(band.astype(np.uint8), cv2.DIST_L2, 3)
    middle = (inside >= cv2.dilate(inside, np.ones((3, 3), np.uint8)) - 1e-3) & (inside > 0)
    strands = list[int]()
    for label in range(1, count):
        left, top, width, height, pixels = stats[label]
        if pixels < MIN_PIXELS:
            continue
        box = np.s_[top : top + height, left : left + width]
        half, most = np.percentile(inside[box][middle[box] & (labels[box] == label)] - 0.5, (50, 85))
        half = max(float(half), 0.5)
        length = pixels / (2 * half)
        if length > max(MIN_LENGTH_PX, MIN_LENGTH_WIDTHS * 2 * half) and most < MAX_WIDTH_RATIO * half + WIDTH_SLACK_PX:
            strands.append(label)
    return np.asarray(labels), np.array(strands, dtype=int)


def _of(labels: Ints, wanted: Ints) -> Bools:
    chosen = np.zeros(labels.max() + 1, dtype=bool)
    chosen[wanted] = True
    return np.asarray(chosen[labels])
