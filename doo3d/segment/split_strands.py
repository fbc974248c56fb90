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

from ..geometry.mask import bounding_box, dilate, grown_box
from ..scene.frame_facts import FrameFacts
from ..scene.masked import NO_NUMBERS, NO_PIXELS
from ..types import Array, Bools
from .color_layers import color_layers
from .mask_parts import long_parts
from .valley_lines import find_valley_lines
from .valleys import VALLEY_LENGTH_RADII, find_valleys, shade_strands
from .wide_stretches import find_bundles, strand_radius

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
        (H, W) uint8, number of the layer of each pixel by its color, from 1, and 0 outside; (0, 0) unless cables of several
        colors run side by side.
    layers
        what follows from the mask of each layer.
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
    by_color: bool = True,
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
    by_color
        False takes cables of different colors for one layer.

    Returns
    -------
    The split mask; the mask of the facts itself, without `side_by_side`, if no stretch is much wider than one strand.
    """
    if not facts.count:
        return SplitMask(facts.mask, 0)
    numbers = NO_NUMBERS if color is None or not by_color else color_layers(facts, color, strand_radius(facts.axis[2]))
    if not numbers.size:
        return _split_valleys(facts, selected, color, depth, equal_widths)
    layers, beside = [], np.zeros_like(facts.mask)
    for number in range(1, int(numbers.max()) + 1):
        own = FrameFacts(numbers == number, facts.depth)
        split = _split_valleys(own, None, color, depth, equal_widths)
        layers.append(own if split.mask is own.mask else FrameFacts(split.mask, facts.depth))
        beside |= split.side_by_side if split.side_by_side.size else False
    cut = (numbers > 0) & (cv2.dilate(numbers, np.ones((3, 3), np.uint8)) > numbers)
    return SplitMask(facts.mask & ~cut, int(np.count_nonzero(cut)), beside, numbers, tuple(layers))


def _split_valleys(
    facts: FrameFacts, selected: Bools | None, color: Array | None, depth: Array | None, equal_widths: bool
) -> SplitMask:
    """Remove the valleys between strands of one color from a mask; parameters : as for `split_strands`."""
    mask = facts.mask
    whole = SplitMask(mask, 0)
    radius = strand_radius(facts.axis[2])
    box = facts.slices
    part = mask[box]
    if selected is not None and (gaps := long_parts(part & ~selected[box], MIN_GAP_PX)).any():
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
    inner = grown_box(bounding_box(bundles.wide), math.ceil(VALLEY_LENGTH_RADII * bundles.radius), shade.shape)
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


def _without_corners(lines: Bools) -> Bools:
    """Return lines (h, w) with a pixel added at each diagonal step, so that no 8-connected path leads across them."""
    result = lines.copy()
    result[:-1, 1:] |= lines[:-1, :-1] & lines[1:, 1:] & ~lines[1:, :-1]
    result[:-1, :-1] |= lines[:-1, 1:] & lines[1:, :-1] & ~lines[1:, 1:]
    return result
