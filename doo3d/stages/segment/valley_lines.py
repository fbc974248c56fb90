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
    carried = [_carry_on(end, label, bundles) for end in ends]
    position = np.array([end.position for end in ends]).reshape(-1, 2)
    number = np.array([end.line for end in ends], dtype=np.int64)
    near = cKDTree(position).query_pairs(2 * REACH_RADII * bundles.radius, output_type="ndarray")
    size = int(label.max()) + 1
    graph = coo_array((np.ones(len(near)), (number[near[:, 0]], number[near[:, 1]])), shape=(size, size))
    group = connected_components(graph, directed=False)[1]
    opens = np.zeros(size, dtype=bool)
    opens[group[number[np.array([opening for _, opening in carried], dtype=bool)]]] = True
    in_gap = np.bincount(own[~bundles.part.ravel()[pixels]], minlength=size)
    opens[group[in_gap >= REACH_RADII * bundles.radius]] = True
    length = np.bincount(group, weights=np.bincount(own, minlength=size), minlength=size)
    width = np.zeros(size)
    np.maximum.at(width, group[own], 2 * bundles.distance.ravel()[pixels])
    kept = (opens & (length >= MIN_VALLEY_WIDTHS * width))[group]
    result = np.zeros_like(bundles.part)
    result.ravel()[pixels[kept[own]]] = True
    for end, (ahead, _) in zip(ends, carried, strict=True):
        if kept[end.line]:
            result[ahead[:, 0], ahead[:, 1]] = True
    return result & bundles.closed


class _LineEnd(NamedTuple):
    """An end of a line: the line's number, the end's (row, column), and the unit direction (2,) in which the line leaves it."""

    line: int
    position: Ints
    direction: Floats


def _line_ends(label: Ints, radius: float) -> list[_LineEnd]:
    """Return the ends of labelled lines (h, w); lines shorter than their window have none."""
    lines = label > 0
    neighbors = cv2.filter2D(lines.astype(np.uint8), -1, np.ones((3, 3)), borderType=cv2.BORDER_CONSTANT)
    window = math.ceil(2 * radius)
    padded = np.pad(label, window)
    ends = []
    for row, column in np.argwhere(lines & (neighbors == 2)):
        near = padded[row : row + 2 * window + 1, column : column + 2 * window + 1]
        back = np.argwhere(near == label[row, column]).mean(axis=0) - window
        length = float(np.hypot(*back))
        if length > 0:
            ends.append(_LineEnd(int(label[row, column]), np.array((row, column)), -back / length))
    return ends


def _carry_on(end: _LineEnd, label: Ints, bundles: Bundles) -> tuple[Ints, bool]:
    """Carry a line on, straight from its end, to the background or to another line.

    Returns
    -------
    ahead : (A, 2) int64 (row, column), the pixels up to there; none if neither is near.
    opening : whether it meets the background, and has a strand on either side there.
    """
    nothing = np.zeros((0, 2), dtype=np.int64)
    reach = math.ceil(REACH_RADII * bundles.radius)
    ahead = _ray(end.position, end.direction, np.arange(0, reach, 0.5), label.shape)
    free = ~bundles.part[ahead[:, 0], ahead[:, 1]]
    other = label[ahead[:, 0], ahead[:, 1]]
    met = np.flatnonzero(free | ((other > 0) & (other != end.line)))
    if not len(met):
        return nothing, False
    ahead = ahead[: met[0] + 1]
    if not free[met[0]]:
        return ahead, False
    beyond = ahead[-1] + OPENING_RADII * bundles.radius * end.direction
    if not len(_ray(beyond, end.direction, np.zeros(1), label.shape)):
        return ahead, False
    across = np.array((-end.direction[1], end.direction[0]))
    sides = [_ray(beyond, side, np.arange(0, SIDE_RADII * bundles.radius, 0.5), label.shape) for side in (across, -across)]
    middle_is_free = not bundles.part[sides[0][0, 0], sides[0][0, 1]]
    return ahead, bool(middle_is_free and all(bundles.part[side[:, 0], side[:, 1]].any() for side in sides))


def _ray(start: Array, direction: Floats, distances: Floats, shape: tuple[int, ...]) -> Ints:
    """Return the pixels (A, 2) (row, column) at distances in px from a start, up to the border of an image (h, w)."""
    pixels = np.rint(start + direction * distances[:, None]).astype(np.int64)
    inside = ((pixels >= 0) & (pixels < shape)).all(axis=1)
    return pixels[: len(pixels) if inside.all() else int(inside.argmin())]


def _thinned(mask: Bools) -> Bools:
    """Return the skeleton (h, w) of a mask whose border is False."""
    pixels: Ints = np.argwhere(mask)
    skeleton = np.zeros_like(mask)
    if len(pixels):
        kept = pixels[thin_pixels(pixels)]
        skeleton[kept[:, 0], kept[:, 1]] = True
    return skeleton
