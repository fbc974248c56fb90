"""Split a mask along the creases between strands that run side by side, so that each strand becomes a thin part of its own.

Two strands that touch are one region of the mask, as wide as both. In the image they remain distinct: between two round strands
lies a valley of brightness (of nearness in a depth image), parallel to them. The steps are:

1. Estimate the usual half-width of one strand: the smallest one that a substantial part of the medial axis has.
2. Close the gaps between strands, and find long stretches much wider than one strand. Most frames have none.
3. There, filter the image with line detectors of several orientations, and keep the valleys that are long and far enough from the
   edge to have a strand on either side.
4. Keep the valleys that end in the background between two strands, or that are continued by such a valley. A stripe along a cable
   does not.
5. Remove the valleys from the mask.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np

from ..geometry.mask import bounding_box, dilate
from ..scene.frame_facts import FrameFacts
from ..scene.masked import NO_NUMBERS, NO_PIXELS
from .color_layers import color_layers
from ..types import Array, Bools
from .mask_parts import Parts, drawn
from .valley_lines import find_valley_lines
from .valleys import VALLEY_LENGTH_RADII, find_valleys, shade_strands
from .wide_stretches import WIDE_LENGTH_RADII, find_bundles, strand_radius

CROSSING_RADII = math.sqrt(2)
"""Half-width of the mask in radii at a crossing of two strands at a right angle. If it is larger over some length, strands
touch."""

MIN_GAP_PX = 6
"""Minimum diagonal in px of a filled hole of the mask that may be a gap between strands; smaller ones are pinholes."""


class SplitMask(NamedTuple):
    """A mask whose strands are split.

    Attributes
    ----------
    mask
        (H, W) bool, without the pixels of the valleys.
    removed
        number of pixels removed.
    side_by_side
        (H, W) bool, the pixels of strands that run side by side and of the gaps between them; (0, 0) if there are none.
    colors
        (H, W) uint8, number of the color of the strand at each pixel, from 1, and 0 outside; (0, 0) unless strands of
        different colors run side by side.
    """

    mask: Bools
    removed: int
    side_by_side: Bools = NO_PIXELS
    colors: Array = NO_NUMBERS
    layers: tuple[FrameFacts, ...] = ()


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
        (H, W) bool, the mask before small holes were filled: the holes may be gaps between strands. None if none was filled.
    color
        (H, W, 3) uint8 RGB, in which valleys are darker than the strands beside them; None uses the depth.
    depth
        (H, W) m, 0 = unknown, used without color: valleys are farther away. Without either, or without contrast, a wide stretch
        is split into strands of equal width.
    equal_widths
        False leaves such a wide stretch whole: it may be one thicker strand.
    by_hue
        True splits strands of different colors along their borders, and searches valleys only if there are none.

    Returns
    -------
    The split mask; the mask of the facts itself, without `side_by_side`, if no stretch is much wider than one strand.
    """
    mask = facts.mask
    whole = SplitMask(mask, 0)
    if not facts.count:
        return whole
    radius = strand_radius(facts.axis[2])
    if by_hue and color is not None and (split := _split_colors(facts, color, radius, depth, equal_widths)):
        return split
    box = facts.slices
    part = mask[box]
    if selected is not None and (gaps := _long_parts(part & ~selected[box], MIN_GAP_PX)).any():
        part = part & ~gaps
        facts = FrameFacts(part)
        radius = strand_radius(facts.axis[2])
    bundles = find_bundles(part, facts, radius)
    if not bundles:
        return whole
    if not bundles.wide.any():
        beside = np.zeros_like(mask)
        beside[box] = dilate(bundles.closed & ~bundles.part, 3 * bundles.radius)[1:-1, 1:-1]
        return SplitMask(mask, 0, beside)
    shade = shade_strands(bundles, box, color, depth, equal_widths)
    inner = _grown(bounding_box(bundles.wide), math.ceil(VALLEY_LENGTH_RADII * bundles.radius), shade.shape)
    inside = bundles.within(inner)
    found = find_valley_lines(*find_valleys(shade[inner].copy(), bundles.radius, inside.inner), inside)
    if not found.any():
        return whole
    lines, cut = np.zeros_like(bundles.part), np.zeros_like(bundles.part)
    lines[inner] = found
    cut[inner] = _without_corners(found) | (inside.closed & ~inside.part & dilate(found, 1.0))
    near = dilate(lines, max(3 * bundles.radius, bundles.widest))
    return _split(mask, box, cut[1:-1, 1:-1], near[1:-1, 1:-1])


def _split(mask: Bools, box: tuple[slice, slice], cut: Bools, near: Bools) -> SplitMask:
    """Remove the pixels of `cut` from a mask (H, W); near : the pixels side by side. Both are (h, w) bool, within a box."""
    result, beside = mask.copy(), np.zeros_like(mask)
    result[box] &= ~cut
    beside[box] = near
    return SplitMask(result, int(np.count_nonzero(mask)) - int(np.count_nonzero(result)), beside)


def _split_colors(facts: FrameFacts, color: Array, radius: float, depth, equal_widths) -> SplitMask | None:
    """Remove the borders between strands of different colors that run side by side; None if there are none."""
    if not radius:
        return None
    numbers = color_layers(facts, color, radius)
    if not numbers.size:
        return None
    box = facts.slices
    labels = numbers[box]
    cut = (labels > 0) & (cv2.dilate(labels, np.ones((3, 3), np.uint8)) > labels)
    masks = [numbers == k for k in np.unique(labels[labels > 0])]
    colors = np.zeros_like(numbers)
    for k, mask in enumerate(masks):
        colors[mask] = k + 1
    parts = []
    from ..scene.frame_facts import NO_DEPTH
    d = NO_DEPTH if depth is None else depth
    for mask in masks:
        own = FrameFacts(mask, d)
        split = split_strands(own, None, color, depth, equal_widths)
        parts.append(own if split.mask is own.mask else FrameFacts(split.mask, d))
    return _split(facts.mask, box, cut, dilate(cut, 3 * radius))._replace(colors=colors, layers=tuple(parts))


def _long_parts(mask: Bools, length: float) -> Bools:
    """Return the 8-connected parts of a mask (h, w) bool whose bounding boxes have a diagonal of at least `length` px."""
    parts = Parts.of(mask)
    if not len(parts.pixels):
        return np.zeros_like(mask)
    places = np.column_stack(np.divmod(parts.pixels, mask.shape[1]))
    extent = 1 + np.maximum.reduceat(places, parts.starts[:-1]) - np.minimum.reduceat(places, parts.starts[:-1])
    return drawn(parts.pixels_of(np.flatnonzero(np.hypot(*extent.T) >= length)), mask.shape)


def _without_corners(lines: Bools) -> Bools:
    """Return lines (h, w) with a pixel added at each diagonal step, so that no 8-connected path leads across them."""
    result = lines.copy()
    result[:-1, 1:] |= lines[:-1, :-1] & lines[1:, 1:] & ~lines[1:, :-1]
    result[:-1, :-1] |= lines[:-1, 1:] & lines[1:, :-1] & ~lines[1:, 1:]
    return result


def _grown(box: tuple[slice, slice], px: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return a box grown by `px` on all sides, within an image (h, w)."""
    rows, columns = (slice(max(0, side.start - px), min(size, side.stop + px)) for side, size in zip(box, shape, strict=True))
    return rows, columns
