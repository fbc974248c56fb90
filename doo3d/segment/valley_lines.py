"""Select the valleys that separate two strands, as lines one pixel wide, and extend them to where the strands diverge."""

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
"""Minimum depth of a valley in units of the contrast: at each of its pixels, and in the median."""

MIN_VALLEY_RADII = 4.0
"""Minimum length of a valley in radii; shorter ones are texture."""

REACH_RADII = 1.5
"""Maximum length in radii by which a valley is extended straight beyond its ends, to where the strands diverge. Lines whose ends
are nearer than twice this length continue each other. A line that lies over this length in gaps of the mask, or in the wedge
between diverging strands, is open."""

MIN_VALLEY_WIDTHS = 3.0
"""Minimum total length of lines that continue each other, in widths of the mask there; shorter ones are the flanks of a strand
that crosses a wide one."""

SIDE_RADII = 3.5
"""Distance in radii within which there is a strand on either side of the background, one radius beyond the end of a valley."""

MAX_VALLEYS = 200
"""Maximum number of valleys that are tested, the longest first."""


def find_valley_lines(valley: Array, bottom: Bools, bundles: Bundles) -> Bools:
    """Return the center lines (h, w) bool of the valleys that separate strands; valley, bottom : as of `find_valleys`."""
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
    deep = np.sort(longest[(depth >= SURE_VALLEY) & (inside >= radius)])  # with room for a strand
    own = [pixels[starts[k] : starts[k + 1]] for k in deep]
    return _opening_lines(np.concatenate((pixels[:0], *own)), np.concatenate(([0], np.cumsum(size[deep]))), bundles)


def _opening_lines(pixels: Ints, starts: Ints, bundles: Bundles) -> Bools:
    """Return the lines (h, w) bool that end in the background between two strands, or are continued by one that does, extended.

    `pixels` are row-major indices, line by line, and `starts` the index at which each line begins. A line along a gap of the mask
    is open, too. A stripe along a single strand is not.
    """
    result = np.zeros_like(bundles.part)
    size = len(starts) - 1
    if not size:
        return result
    own = np.repeat(np.arange(size), np.diff(starts))
    label = np.full(result.shape, -1, dtype=np.int32)
    label.ravel()[pixels] = own
    ends = find_line_ends(pixels, starts, label, math.ceil(2 * bundles.radius))
    ahead, is_ahead, opening = _extended(ends, label, bundles)
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
    """The ends of lines: (E,) number of the line, (E, 2) row and column, and (E, 2) unit direction out of the line."""

    line: Ints
    position: Ints
    direction: Floats


def find_line_ends(pixels: Ints, starts: Ints, label: Array, window: int) -> LineEnds:
    """Return the ends of lines one pixel wide, in row-major order: pixels with a single one among their eight neighbors.

    Parameters
    ----------
    pixels, starts
        (N,) row-major indices of the pixels, line by line, and (L + 1,) index at which each line begins.
    label
        (h, w) int, the number of the line at each pixel, -1 elsewhere.
    window
        px, half-width of the square window whose pixels of the line give the direction of an end. An end at their mean has no
        direction, and is left out.
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


def _extended(ends: LineEnds, label: Ints, bundles: Bundles) -> tuple[Ints, Bools, Bools]:
    """Extend lines straight from their ends to the background or to another line.

    Returns
    -------
    ahead : (E, A, 2) int64 (row, column), pixels ahead of each end.
    is_ahead : (E, A) bool, the pixels of the extension; all False if neither is near.
    opening : (E,) bool, whether the line meets the background with a strand on either side.
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
    for sideways in (across, -across):
        side, seen = _rays(beyond, sideways, np.arange(0, SIDE_RADII * bundles.radius, 0.5), part.shape)
        in_part = seen & part[side[:, :, 0], side[:, :, 1]]
        opening &= seen[:, 0] & ~in_part[:, 0] & in_part.any(axis=1)
    return ahead, is_ahead, opening


def _rays(start: Array, direction: Floats, distances: Floats, shape: tuple[int, ...]) -> tuple[Ints, Bools]:
    """Return the pixels (E, A, 2) (row, column) at A distances in px from each start, and (E, A) bool up to the image border."""
    pixels = np.rint(start[:, None] + direction[:, None] * distances[:, None]).astype(np.int64)
    inside = ((pixels >= 0) & (pixels < shape)).all(axis=2)
    return np.clip(pixels, 0, np.array(shape) - 1), np.logical_and.accumulate(inside, axis=1)


def _thinned(mask: Bools) -> Bools:
    """Return the skeleton (h, w) bool of a mask whose border is False (thinning of `kernels.thin_pixels`)."""
    pixels: Ints = np.argwhere(mask)
    skeleton = np.zeros_like(mask)
    if len(pixels):
        kept = pixels[thin_pixels(pixels)]
        skeleton[kept[:, 0], kept[:, 1]] = True
    return skeleton
