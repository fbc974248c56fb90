"""Find the stretches of a mask that are wider than one strand and long: strands that run side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from ..geometry.mask import dilate
from ..kernels import medial_axis
from ..scene.frame_facts import FrameFacts
from ..types import Array, Bools, Floats

MIN_RADIUS_PX = 0.9
"""Minimum half-width of a strand in px; between thinner strands no valley is visible."""

MIN_AXIS_SHARE = 0.12
"""Minimum fraction of the medial axis that has the half-width of a strand, within about 12 %."""

LOG_BIN, REACH_BINS = 0.05, 2
"""Width of the bins of the logarithm of half-widths, and number of bins on either side of a half-width that are equal to it."""

COARSE_RADIUS_PX = 4.0
"""Radius in px to which an image with thicker strands is scaled down, to check for wide stretches and to detect valleys."""

GAP_RADII = 1.2
"""Maximum width in radii of a gap of the mask inside a bundle; voxels of half a radius would bridge it."""

MIN_CLOSING_PX = 2
"""Minimum half-width in px of the gaps that are closed: voxels of thin strands are coarse."""

WIDE_RADII = 1.6
"""Minimum half-width, in radii, of more than one strand."""

WIDE_LENGTH_RADII = 6.0
"""Minimum length of a wide stretch, in radii; shorter ones are crossings, knots and plugs."""

MAX_BUNDLE_RADII, MAX_BUNDLE_PX = 12.0, 64.0
"""Maximum half-width of a bundle, in radii of a strand and at least in px: 12 strands side by side. A wider region of the mask is
no bundle, and would take seconds to measure."""


@dataclass(frozen=True)
class Bundles:
    """The wide stretches of a mask, in which strands may run side by side.

    Attributes
    ----------
    radius
        px, usual half-width of one strand.
    part
        (h, w) bool, the mask.
    closed
        (h, w) bool, the mask with the gaps between strands closed.
    wide
        (h, w) bool, its wide stretches; all False if these are rows of separate strands, wider than any bundle.
    widest
        px, the largest half-width of the wide stretches.
    """

    radius: float
    part: Bools
    closed: Bools
    wide: Bools
    widest: float

    @cached_property
    def distance(self) -> Array:
        """The distance (h, w) float32 px of each pixel of the closed mask from the edge."""
        return np.asarray(cv2.distanceTransform(np.pad(self.closed, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1])

    @cached_property
    def inner(self) -> Bools:
        """The wide stretches (h, w) bool without the pixels at the edge, where no valley separates two strands."""
        return self.wide & (self.distance > 1.5)

    def within(self, box: tuple[slice, slice]) -> Bundles:
        """Return the wide stretches within a box, slices of rows and columns."""
        part, closed, wide = (image[box].copy() for image in (self.part, self.closed, self.wide))
        return Bundles(self.radius, part, closed, wide, self.widest)


def find_bundles(part: Bools, facts: FrameFacts, radius: float) -> Bundles | None:
    """Return the stretches of a mask (h, w) bool much wider than one strand over several radii; None if there are none.

    facts : facts of the mask, whose position in them may differ. radius : px, usual half-width of one strand, 0 if unknown.

    The images of the result, (h + 2, w + 2), have a margin of one pixel.
    """
    if not radius:
        return None
    part = np.pad(part, 1)
    if radius >= 2 * COARSE_RADIUS_PX and not _may_be_wide(part, radius):
        return None
    closed = close_gaps(part, max(MIN_CLOSING_PX, round(GAP_RADII * radius / 2)))
    # the inscribed disc at each pixel of a wide medial axis contains this square
    square = np.ones((2 * int((WIDE_RADII * radius + 0.5) * math.sqrt(0.5)) + 1,) * 2, np.uint8)
    if np.count_nonzero(cv2.erode(closed.view(np.uint8), square)) < WIDE_LENGTH_RADII * radius:
        return None
    rows, columns, inside = medial_axis(closed)
    at_wide = inside - 0.5 > WIDE_RADII * radius
    if np.count_nonzero(at_wide) < WIDE_LENGTH_RADII * radius:
        return None
    rows, columns, inside = rows[at_wide], columns[at_wide], inside[at_wide]
    ridge = np.zeros(part.shape, dtype=np.uint8)
    ridge[rows, columns] = 1
    side = 2 * math.ceil(radius) + 1
    _, label, stats, _ = cv2.connectedComponentsWithStats(cv2.dilate(ridge, np.ones((side, side), np.uint8)), connectivity=8)
    at = label[rows, columns]
    size = np.bincount(at, minlength=len(stats))
    length = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) - side
    is_long = (np.minimum(size, length) > WIDE_LENGTH_RADII * radius) & (np.arange(len(stats)) > 0)
    kept = is_long[at]
    if not kept.any():
        return None
    widest = float(inside[kept].max())
    if widest > MAX_BUNDLE_RADII * radius and not (facts.axis[2] > WIDE_RADII * radius).any():
        return Bundles(radius, part, closed, np.zeros_like(closed), widest)
    return Bundles(radius, part, closed, closed & dilate(is_long[label], widest + radius), widest)


def strand_radius(half_width: Floats) -> float:
    """Return the smallest half-width in px that a substantial part of a medial axis has; 0 if there is none.

    half_width : (K,) px, half-widths at the K pixels of the medial axis.
    """
    logs = np.log(half_width[half_width >= MIN_RADIUS_PX].astype(float))
    if not len(logs):
        return 0.0
    bins = ((logs - math.log(MIN_RADIUS_PX)) / LOG_BIN).astype(int)
    near = np.convolve(np.bincount(bins), np.ones(2 * REACH_BINS + 1))[REACH_BINS:-REACH_BINS]
    is_mode = near >= cv2.dilate(near[None], np.ones((1, 4 * REACH_BINS + 1), np.uint8))[0]
    modes = np.flatnonzero(is_mode & (near >= MIN_AXIS_SHARE * len(logs)))
    if not len(modes):
        return 0.0
    usual = bins[np.abs(bins - modes[0]) <= REACH_BINS]
    return float(MIN_RADIUS_PX * np.exp(LOG_BIN * (usual.mean() + 0.5)))


def _may_be_wide(part: Bools, radius: float) -> bool:
    """Return whether a mask (h, w) bool, subsampled to a coarser grid, may have long wide stretches."""
    step = int(radius / COARSE_RADIUS_PX)
    side = 2 * math.ceil(GAP_RADII * radius / 2 / step) + 1
    closed = cv2.morphologyEx(part[::step, ::step].astype(np.uint8), cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    inside = medial_axis(closed > 0)[2]
    return bool(np.count_nonzero(inside * step > WIDE_RADII * radius) * step >= WIDE_LENGTH_RADII * radius / 2)


def close_gaps(mask: Bools, px: int) -> Bools:
    """Return a mask with gaps up to 2 `px` wide closed; no pixel is added at the border of the image."""
    ellipse = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * px + 1, 2 * px + 1))
    closed = cv2.morphologyEx(np.pad(mask, px).view(np.uint8), cv2.MORPH_CLOSE, ellipse)
    return np.ascontiguousarray(closed[px:-px, px:-px]).view(bool)
