"""Split a mask along the creases between strands that run side by side, so that each strand is a thin piece of its own.

Two strands that touch are one region in the mask, as wide as both. The image still shows them apart: between two round strands
lies a valley of brightness (of nearness in a depth image), parallel to them. The steps are:

1. Take the usual half-width of one strand from the thinnest stretches that make up a good part of the medial axis.
2. Close gaps between strands, and look for stretches much wider than one strand and long. Most frames end here.
3. There, filter the image with line detectors of several orientations, and keep the valleys that are long and far enough from the
   edge to have a strand on either side.
4. Keep those that run out between two strands, or are continued by one that does: a stripe along a cable opens nowhere.
5. Remove the valleys from the mask.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from ..geometry.mask import bounding_box, dilate
from ..scene.frame_facts import FrameFacts
from ..scene.strand_hues import StrandHues
from ..types import Array, Bools
from .mask_parts import Parts
from .valley_lines import find_valley_lines
from .valleys import VALLEY_LENGTH_RADII, find_valleys, shade_strands
from .wide_stretches import WIDE_LENGTH_RADII, Bundles, find_bundles, strand_radius

CROSSING_RADII = math.sqrt(2)
"""Radii; half-width of the mask where two strands cross at a right angle. Where it is larger over some length, they touch."""

MIN_GAP_PX = 6
"""px; shorter holes in a mask are pin-holes, longer ones may be gaps between strands."""


class SplitMask(NamedTuple):
    """A mask whose strands are split apart.

    Attributes
    ----------
    mask
        (H, W) bool, without the pixels of the valleys.
    removed
        number of pixels removed.
    side_by_side
        (H, W) bool, the pixels of strands that run side by side and of the gaps between them; None if nothing was found.
    colors
        (H, W) uint8, the number of the color of the strand at each pixel, from 1, 0 outside; None unless strands of different
        colors run side by side.
    """

    mask: Bools
    removed: int
    side_by_side: Bools | None
    colors: Array | None = None


def split_strands(
    facts: FrameFacts,
    selected: Bools | None,
    color: Array | None,
    depth: Array | None,
    equal_widths: bool = True,
    by_hue: bool = False,
) -> SplitMask:
    """Remove the valleys between strands that run side by side from a mask.

    Parameters
    ----------
    facts
        the cleaned mask.
    selected
        (H, W) bool, the mask before small holes were closed: they are gaps between strands. None if there were none.
    color
        (H, W, 3) uint8 RGB, in which a valley is darker than the strands beside it; None uses the depth.
    depth
        (H, W) m, 0 = unknown, used without color: a valley is farther away. Without either, or where they are flat, a wide
        stretch is split into equal widths.
    equal_widths
        False leaves such a wide stretch without valleys whole: it may be one thicker strand.
    by_hue
        True splits strands of different colors along their borders; then no valleys are looked for.

    Returns
    -------
    The mask, split; the mask of the facts itself with `side_by_side` None if nowhere a stretch is much wider than one strand.
    """
    mask = facts.mask
    whole = SplitMask(mask, 0, None)
    if not facts.count:
        return whole
    radius = strand_radius(facts.axis[2])
    if by_hue and color is not None and (split := _split_colors(facts, color, radius)) is not None:
        return split
    box = facts.slices
    part = mask[box]
    if selected is not None and (gaps := _long_parts(part & ~selected[box], MIN_GAP_PX)).any():
        part = part & ~gaps
        facts = FrameFacts(part)
        radius = strand_radius(facts.axis[2])
    bundles = find_bundles(part, facts, radius)
    if bundles is None:
        return whole
    part = bundles.part
    beside = np.zeros_like(mask)
    if bundles.wide is None:
        beside[box] = dilate(bundles.closed & ~part, 3 * bundles.radius)[1:-1, 1:-1]
        return SplitMask(mask, 0, beside)
    inner = _grown(bounding_box(bundles.wide), math.ceil(VALLEY_LENGTH_RADII * bundles.radius), part.shape)
    shade = shade_strands(part, box, bundles.radius, bundles.widest, color, depth, equal_widths)
    if shade is None:
        return whole
    bundles = Bundles(
        bundles.radius, bundles.part[inner].copy(), bundles.closed[inner].copy(), bundles.wide[inner].copy(), bundles.widest
    )
    found = find_valley_lines(*find_valleys(shade[inner].copy(), bundles.radius, bundles.inner), bundles)
    if not found.any():
        return whole
    lines, cut = np.zeros_like(part), np.zeros_like(part)
    lines[inner] = found
    cut[inner] = _without_corners(found) | (bundles.closed & ~bundles.part & dilate(found, 1.0))
    result = mask.copy()
    result[box] &= ~cut[1:-1, 1:-1]
    beside[box] = dilate(lines, max(3 * bundles.radius, bundles.widest))[1:-1, 1:-1]
    return SplitMask(result, int(np.count_nonzero(mask)) - int(np.count_nonzero(result)), beside)


def _split_colors(facts: FrameFacts, color: Array, radius: float) -> SplitMask | None:
    """Remove the borders between strands of different colors that run side by side; None where there are none."""
    colors = StrandHues.learn(color, facts.pixels)
    if colors.count < 2:
        return None
    mask, box, (rows, columns, half_width) = facts.mask, facts.slices, facts.axis
    if not radius or np.count_nonzero(half_width > CROSSING_RADII * radius) < WIDE_LENGTH_RADII * radius:
        return None
    least = WIDE_LENGTH_RADII * radius
    labels = colors.label(
        np.ascontiguousarray(color[box]), mask[box], (rows - box[0].start, columns - box[1].start), radius, least
    )
    cut = (labels > 0) & (cv2.dilate(labels, np.ones((3, 3), np.uint8)) > labels)
    if not (cut := _long_parts(cut, least)).any():
        return None
    result, beside = mask.copy(), np.zeros_like(mask)
    result[box] &= ~cut
    beside[box] = dilate(cut, 3 * radius)
    numbers = np.zeros(mask.shape, np.uint8)
    numbers[box] = labels
    return SplitMask(result, int(np.count_nonzero(cut)), beside, numbers)


def _long_parts(mask: Bools, length: float) -> Bools:
    """Return the 8-connected parts of a mask (h, w) bool whose boxes have a diagonal of at least `length` px."""
    parts = Parts.of(mask, np.zeros(0, dtype=int))
    long = np.zeros_like(mask)
    if len(parts.pixels):
        places = np.column_stack(np.divmod(parts.pixels, mask.shape[1]))
        extent = 1 + np.maximum.reduceat(places, parts.starts[:-1]) - np.minimum.reduceat(places, parts.starts[:-1])
        long.ravel()[parts.pixels_of(np.flatnonzero(np.hypot(*extent.T) >= length))] = True
    return long


def _without_corners(lines: Bools) -> Bools:
    """Return lines (h, w) with a pixel added at each diagonal step, so that no two pixels of other strands touch across it."""
    result = lines.copy()
    result[:-1, 1:] |= lines[:-1, :-1] & lines[1:, 1:] & ~lines[1:, :-1]
    result[:-1, :-1] |= lines[:-1, 1:] & lines[1:, :-1] & ~lines[1:, 1:]
    return result


def _grown(box: tuple[slice, slice], px: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return a box grown by `px` on all sides, within an image (h, w)."""
    rows, columns = (slice(max(0, side.start - px), min(size, side.stop + px)) for side, size in zip(box, shape, strict=True))
    return rows, columns
