"""Keep the valleys that part two strands, as lines one pixel wide, up to where the strands part."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ..geometry.disjoint_set import joined_groups
from ..geometry.polyline import unit
from ..kernels import mask_parts, thin_pixels
from ..types import Array, Bools, Floats, Ints
from .wide_stretches import Bundles, close_gaps

MIN_VALLEY, SURE_VALLEY = 0.12, 0.3
"""Depth of a valley in units of the contrast: at each of its pixels, and at its deeper half."""

MIN_VALLEY_RADII = 4.0
"""Radii; shorter valleys are texture."""

REACH_RADII = 1.5
"""Radii; a valley is carried on straight so far beyond its ends, to where the strands part. Lines whose ends are
nearer than twice this continue each other, and one that runs so far along gaps of the mask, or into the wedge between parting
strands, is open."""

MIN_VALLEY_WIDTHS = 3.0
"""Widths of the mask there; shorter lines that continue each other are the flanks of a strand that crosses a wide one."""

SIDE_RADII = 3.5
"""Radii to either side of the background a radius beyond the end of a valley, within which there is a strand."""

MAX_VALLEYS = 200
"""Valleys at most that are tested, the longest first."""


def find_valley_lines(valley: Array, bottom: Bools, bundles: Bundles) -> Bools:
    """Return the middle lines (h, w) of the valleys that part strands."""
    radius, distance = bundles.radius, bundles.distance
    inner = bundles.inner & (valley > MIN_VALLEY)
    skeleton = _thinned(close_gaps(bottom & inner, 1) & inner)
    pixels, starts, _, _ = mask_parts(skeleton, skeleton.size, np.zeros(0, dtype=np.int64))
    size = np.diff(starts)
    longest = np.argsort(-size, kind="stable")[:MAX_VALLEYS]
    longest = longest[size[longest] >= MIN_VALLEY_RADII * radius]
    inside, depth = (
        np.array([np.median(image.ravel()[pixels[starts[k] : starts[k + 1]]].astype(float)) for k in longest])
        for image in (distance, valley)
    )
    deep = np.sort(longest[(depth >= SURE_VALLEY) & (inside >= radius)])  # and room for a strand
    own = [pixels[starts[k] : starts[k + 1]] for k in deep]
    return _opening_lines(np.concatenate((pixels[:0], *own)), np.concatenate(([0], np.cumsum(size[deep]))), bundles)


def _opening_lines(pixels: Ints, starts: Ints, bundles: Bundles) -> Bools:
    """Return the lines (h, w) that run out between two strands, or are continued by one that does, each up to its opening.

    `pixels` are row-major indices, line by line, and `starts` where each begins. A line that runs along a gap of the mask counts
    as open. A stripe along a single strand opens nowhere.
    """
    result = np.zeros_like(bundles.part)
    size = len(starts) - 1
    if not size:
        return result
    own = np.repeat(np.arange(size), np.diff(starts))
    label = np.full(result.shape, -1, dtype=np.int32)
    label.ravel()[pixels] = own
    ends = find_line_ends(pixels, starts, label, math.ceil(2 * bundles.radius))
    ahead, is_ahead, opening = _carry_on(ends, label, bundles)
    near = cKDTree(ends.position).query_pairs(2 * REACH_RADII * bundles.radius, output_type="ndarray")
    group = joined_groups(ends.line[near], size)
    opens = np.zeros(size, dtype=bool)
    opens[group[ends.line[opening]]] = True
    in_gap = np.bincount(own[~bundles.part.ravel()[pixels]], minlength=size)
    opens[group[in_gap >= REACH_RADII * bundles.radius]] = True
    length = np.bincount(group, weights=np.bincount(own, minlength=size), minlength=size)
    width = np.zeros(size)
    np.maximum.at(width, group[own], 2 * bundles.distance.ravel()[pixels])
    kept = (opens & (length >= MIN_VALLEY_WIDTHS * width))[group]
    result.ravel()[pixels[kept[own]]] = True
    result[tuple(ahead[is_ahead & kept[ends.line][:, None]].T)] = True
    return result & bundles.closed


class LineEnds(NamedTuple):
    """The ends of lines: the lines' numbers (E,), the ends' (row, column) (E, 2), and unit directions (E, 2) out of the lines."""

    line: Ints
    position: Ints
    direction: Floats


def find_line_ends(pixels: Ints, starts: Ints, label: Array, window: int) -> LineEnds:
    """Return the ends of lines one pixel wide: pixels with one other among the eight around them, in row-major order.

    Parameters
    ----------
    pixels, starts
        (N,) row-major indices of the pixels, line by line, and (L + 1,) where each line begins.
    label
        (h, w) int, the number of the line at each pixel, -1 elsewhere.
    window
        px, distance in rows and columns up to which pixels of the line give its direction. An end in their middle has none, and
        is left out.
    """
    around = cv2.boxFilter((label >= 0).astype(np.uint8), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    tips = np.flatnonzero(around.ravel()[pixels] == 2)
    tips = tips[np.argsort(pixels[tips])]
    line, places = label.ravel()[pixels[tips]], np.column_stack(np.divmod(pixels, label.shape[1]))
    direction = np.zeros((len(tips), 2))
    for k, tip in enumerate(tips):
        offset = places[starts[line[k]] : starts[line[k] + 1]] - places[tip]
        direction[k] = -unit(offset[(np.abs(offset) <= window).all(axis=1)].mean(axis=0))
    is_known = direction.any(axis=1)
    return LineEnds(line[is_known], places[tips[is_known]], direction[is_known])


def _carry_on(ends: LineEnds, label: Ints, bundles: Bundles) -> tuple[Ints, Bools, Bools]:
    """Carry lines on, straight from their ends, to the background or to another line.

    Returns
    -------
    ahead : (E, A, 2) int64 (row, column), pixels ahead of each end.
    is_ahead : (E, A) bool, the pixels up to there; none if neither is near.
    opening : (E,) bool, whether the line meets the background, and has a strand on either side there.
    """
    part, direction = bundles.part, ends.direction
    ahead, seen = _rays(ends.position, direction, np.arange(0, math.ceil(REACH_RADII * bundles.radius), 0.5), part.shape)
    free = seen & ~part[ahead[:, :, 0], ahead[:, :, 1]]
    other = label[ahead[:, :, 0], ahead[:, :, 1]]
    is_met = free | (seen & (other >= 0) & (other != ends.line[:, None]))
    met, end = is_met.argmax(axis=1), np.arange(len(ahead))
    is_ahead = is_met.any(axis=1)[:, None] & (np.arange(ahead.shape[1]) <= met[:, None])
    beyond = ahead[end, met] + bundles.radius * direction
    opening = free[end, met]
    across = np.column_stack((-direction[:, 1], direction[:, 0]))
    for way in (across, -across):
        side, seen = _rays(beyond, way, np.arange(0, SIDE_RADII * bundles.radius, 0.5), part.shape)
        in_part = seen & part[side[:, :, 0], side[:, :, 1]]
        opening &= seen[:, 0] & ~in_part[:, 0] & in_part.any(axis=1)
    return ahead, is_ahead, opening


def _rays(start: Array, direction: Floats, distances: Floats, shape: tuple[int, ...]) -> tuple[Ints, Bools]:
    """Return the pixels (E, A, 2) (row, column) at A distances in px from each start, and which are within an image (h, w)."""
    pixels = np.rint(start[:, None] + direction[:, None] * distances[:, None]).astype(np.int64)
    inside = ((pixels >= 0) & (pixels < shape)).all(axis=2)
    return np.clip(pixels, 0, np.array(shape) - 1), np.logical_and.accumulate(inside, axis=1)


def _thinned(mask: Bools) -> Bools:
    """Return the skeleton (h, w) of a mask whose border is False."""
    pixels: Ints = np.argwhere(mask)
    skeleton = np.zeros_like(mask)
    if len(pixels):
        kept = pixels[thin_pixels(pixels)]
        skeleton[kept[:, 0], kept[:, 1]] = True
    return skeleton
