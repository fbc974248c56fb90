"""Keep the valleys that part two strands, as lines one pixel wide, up to where the strands part."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...kernels import thin_pixels
from ...types import Array, Bools, Floats, Ints
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

OPENING_RADII, SIDE_RADII = 1.0, 3.5
"""Radii; so far beyond the end of a valley there is background, and within so many to either side a strand."""

MAX_VALLEYS = 200
"""Valleys at most that are tested, the longest first."""


def find_valley_lines(valley: Array, bottom: Bools, bundles: Bundles) -> Bools:
    """Return the middle lines (h, w) of the valleys that part strands."""
    radius = bundles.radius
    distance = bundles.distance
    inner = bundles.wide & (distance > 1.5) & (valley > MIN_VALLEY)
    skeleton = _thinned(close_gaps(bottom & inner, 1) & inner)
    _, label, stats, _ = cv2.connectedComponentsWithStats(skeleton.astype(np.uint8), connectivity=8)
    size = stats[:, cv2.CC_STAT_AREA]
    deep = np.zeros(len(size), dtype=bool)
    for k in np.argsort(-size, kind="stable")[: MAX_VALLEYS + 1]:
        if k and size[k] >= MIN_VALLEY_RADII * radius:
            left, top, width, height = stats[k, : cv2.CC_STAT_HEIGHT + 1]
            box = slice(top, top + height), slice(left, left + width)
            own = label[box] == k
            is_inside = np.median(distance[box][own]) >= radius  # room for a strand
            deep[k] = np.median(valley[box][own]) >= SURE_VALLEY and is_inside
    return _opening_lines(np.where(deep[label], label, 0), bundles)


def _opening_lines(label: Ints, bundles: Bundles) -> Bools:
    """Return the lines (h, w) that run out between two strands, or are continued by one that does, each up to its opening.

    `label` (h, w) is the number of the line through each pixel, 0 for none. A line that runs along a gap of the mask counts as
    open. A stripe along a single strand opens nowhere.
    """
    pixels = np.flatnonzero(label)
    own = label.ravel()[pixels]
    ends = _line_ends(label, bundles.radius)
    ahead, is_ahead, opening = _carry_on(ends, label, bundles)
    near = cKDTree(ends.position).query_pairs(2 * REACH_RADII * bundles.radius, output_type="ndarray")
    size = int(label.max()) + 1
    graph = coo_array((np.ones(len(near)), (ends.line[near[:, 0]], ends.line[near[:, 1]])), shape=(size, size))
    group = connected_components(graph, directed=False)[1]
    opens = np.zeros(size, dtype=bool)
    opens[group[ends.line[opening]]] = True
    in_gap = np.bincount(own[~bundles.part.ravel()[pixels]], minlength=size)
    opens[group[in_gap >= REACH_RADII * bundles.radius]] = True
    length = np.bincount(group, weights=np.bincount(own, minlength=size), minlength=size)
    width = np.zeros(size)
    np.maximum.at(width, group[own], 2 * bundles.distance.ravel()[pixels])
    kept = (opens & (length >= MIN_VALLEY_WIDTHS * width))[group]
    result = np.zeros_like(bundles.part)
    result.ravel()[pixels[kept[own]]] = True
    result[tuple(ahead[is_ahead & kept[ends.line][:, None]].T)] = True
    return result & bundles.closed


class _LineEnds(NamedTuple):
    """The ends of lines: the lines' numbers (E,), the ends' (row, column) (E, 2), and unit directions (E, 2) out of the lines."""

    line: Ints
    position: Ints
    direction: Floats


def _line_ends(label: Ints, radius: float) -> _LineEnds:
    """Return the ends of labelled lines (h, w); lines shorter than their window have none."""
    lines = label > 0
    neighbors = cv2.filter2D(lines.astype(np.uint8), -1, np.ones((3, 3)), borderType=cv2.BORDER_CONSTANT)
    window = math.ceil(2 * radius)
    ends: Ints = np.argwhere(lines & (neighbors == 2))
    line = label[ends[:, 0], ends[:, 1]]
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(label, window), (2 * window + 1, 2 * window + 1))
    near = windows[ends[:, 0], ends[:, 1]] == line[:, None, None]
    by_row, by_column = near.sum(axis=2), near.sum(axis=1)
    total = np.column_stack([count @ np.arange(2 * window + 1) for count in (by_row, by_column)])
    back = total / by_row.sum(axis=1)[:, None] - window
    length = np.hypot(*back.T)
    kept = length > 0
    return _LineEnds(line[kept], ends[kept], -back[kept] / length[kept, None])


def _carry_on(ends: _LineEnds, label: Ints, bundles: Bundles) -> tuple[Ints, Bools, Bools]:
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
    is_met = free | (seen & (other > 0) & (other != ends.line[:, None]))
    met, end = is_met.argmax(axis=1), np.arange(len(ahead))
    is_ahead = is_met.any(axis=1)[:, None] & (np.arange(ahead.shape[1]) <= met[:, None])
    beyond = ahead[end, met] + OPENING_RADII * bundles.radius * direction
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
