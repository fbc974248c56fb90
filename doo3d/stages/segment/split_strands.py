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
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...geometry.mask import bounding_box
from ...kernels import medial_axis, thin_pixels
from ...types import Array, Bools, Floats, Ints

MIN_RADIUS_PX = 0.9
"""px; thinner strands do not show a valley between them."""

MIN_AXIS_SHARE = 0.12
"""Share of the medial axis that a half-width needs, within about 12 %, to count as that of a strand."""

LOG_BIN = 0.05
"""Bin of the logarithm of the half-widths."""

MIN_GAP_PX = 6
"""px; shorter holes in a mask are pin-holes, longer ones may be gaps between strands."""

COARSE_RADIUS_PX = 3.0
"""px; radius of a strand on the coarser grid on which most frames are found to have nothing wide."""

GAP_RADII = 1.2
"""Radii; a gap of the mask narrower than this lies inside a bundle. Voxels of half a radius would bridge it."""

MIN_CLOSING_PX = 2
"""px; half of the gap that is closed at least: voxels of thin strands are coarse."""

WIDE_RADII = 1.6
"""Radii; a half-width above this is more than one strand."""

WIDE_LENGTH_RADII = 6.0
"""Radii; shorter wide stretches are crossings, knots and plugs."""

VALLEY_RADII, MIN_VALLEY_PX = 0.38, 1.0
"""Width of the valleys looked for: standard deviation in radii, and the least one in px."""

VALLEY_LENGTH_RADII = 1.6
"""Standard deviation in radii along a valley, over which the image is averaged."""

ORIENTATIONS = 8
"""Orientations of the valleys looked for, a multiple of 8; one every 22.5 degrees."""

FILTER_RADIUS_PX = 4.0
"""px; an image whose strands are thicker is scaled down to this radius before it is filtered."""

CLIP = 2.0
"""Units of the contrast at which brightness is clipped: highlights. The background counts as so dark."""

MIN_CONTRAST = 4.0
"""Grey levels; fainter contrast within a mask is noise, and the mask alone decides: strands of equal width."""

WEDGE_RADII = 1.3
"""Radii; half of the width up to which a wedge between parting strands is filled to measure their common width."""

EQUAL_RADII = 1.06
"""Radii of a strand that is as wide as its neighbors: the medial axis of a thin strand is a little too near to its edge."""

MIN_NEARNESS, AROUND_RADII = 1e-4, 3.0
"""m, the same of depth; and radii around a pixel over whose depth its nearness is measured."""

MAX_VALUES = 2000
"""Pixels at most from which the contrast within a mask is estimated."""

MIN_VALLEY, SURE_VALLEY = 0.12, 0.3
"""Depth of a valley in units of the contrast: at each of its pixels, and at its deeper half."""

MIN_VALLEY_RADII = 4.0
"""Radii; shorter valleys are texture."""

MIN_SPACING_RADII = 1.1
"""Radii; a valley nearer than this to the edge or to a deeper valley leaves no room for a strand."""

INNER_RADII = 0.5
"""Radii from the edge within which a valley is not looked for: the side of a strand is darker."""

REACH_RADII = 1.5
"""Radii; a valley is carried on straight so far beyond its ends, to where the strands part."""

MIN_VALLEY_WIDTHS = 3.0
"""Widths of the mask there; shorter lines that continue each other are the flanks of a strand that crosses a wide one."""

FINE_RADIUS_PX, PARTED_SHARE = 4.5, 0.9
"""px, and share of a line that runs along a gap of the mask; strands at least so thick and so well parted need no help: voxels of
half their radius keep them apart."""

LINK_RADII = 3.0
"""Radii; lines whose ends are nearer than this continue each other."""

MIN_END_LENGTH = 0.25
"""Windows of two radii; a line whose middle near its end is nearer to the end than this has no direction there."""

OPENING_RADII, SIDE_RADII = 1.0, 3.5
"""Radii; so far beyond the end of a valley there is background, and within so many to either side a strand."""

MAX_VALLEYS = 200
"""Valleys at most that are tested, the longest first."""


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
    """

    mask: Bools
    removed: int
    side_by_side: Bools | None


@dataclass(frozen=True)
class _Bundles:
    """The wide stretches of a mask: usual half-width in px, (h, w) bool mask, closed mask and its wide stretches,
    and the largest half-width of these in px."""

    radius: float
    part: Bools
    closed: Bools
    wide: Bools
    widest: float

    @cached_property
    def distance(self) -> Array:
        """The distance (h, w) float32 px of each pixel of the closed mask from the edge."""
        return np.asarray(cv2.distanceTransform(np.pad(self.closed, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1])


def split_strands(mask: Bools, selected: Bools, color: Array | None, depth: Array | None) -> SplitMask:
    """Remove the valleys between strands that run side by side from a mask.

    Parameters
    ----------
    mask
        (H, W) bool, the cleaned mask.
    selected
        (H, W) bool, the mask before small holes were closed: they are gaps between strands.
    color
        (H, W, 3) uint8 RGB, in which a valley is darker than the strands beside it; None uses the depth.
    depth
        (H, W) m, 0 = unknown, used without color: a valley is farther away. Without either, or where they are flat, a wide
        stretch is split into equal widths.

    Returns
    -------
    The mask, split; `mask` itself with `side_by_side` None if nowhere a stretch is much wider than one strand.
    """
    whole = SplitMask(mask, 0, None)
    if not mask.any():
        return whole
    box = bounding_box(mask)
    part = np.pad(mask[box] & ~_long_holes(mask[box] & ~selected[box]), 1)
    bundles = _find_bundles(part)
    if bundles is None:
        return whole
    inner = _grown(bounding_box(bundles.wide), math.ceil(VALLEY_LENGTH_RADII * bundles.radius), part.shape)
    shade = _shade(part, box, bundles.radius, bundles.widest, color, depth)[inner]
    bundles = _Bundles(
        bundles.radius, bundles.part[inner].copy(), bundles.closed[inner].copy(), bundles.wide[inner].copy(), bundles.widest
    )
    found = _find_lines(*_find_valleys(shade, bundles.radius), bundles)
    if not found.any():
        return whole
    lines, cut = np.zeros_like(part), np.zeros_like(part)
    lines[inner] = found
    cut[inner] = _without_corners(found) | (bundles.closed & ~bundles.part & _dilated(found, 1.0))
    result = mask.copy()
    result[box] &= ~cut[1:-1, 1:-1]
    beside = np.zeros_like(mask)
    beside[box] = _dilated(lines, max(3 * bundles.radius, bundles.widest))[1:-1, 1:-1]
    return SplitMask(result, int(np.count_nonzero(mask)) - int(np.count_nonzero(result)), beside)


def strand_radius(half_width: Floats) -> float:
    """Return the least half-width that a good part of a medial axis has, in px; 0 if there is none.

    half_width : (K,) px, half-widths at the K pixels of the medial axis.
    """
    half_width = half_width[half_width >= MIN_RADIUS_PX]
    if not len(half_width):
        return 0.0
    logs = np.log(half_width)
    edges = np.arange(math.log(MIN_RADIUS_PX), float(logs.max()) + 4 * LOG_BIN, LOG_BIN)
    count = np.histogram(logs, edges)[0].astype(float)
    near = np.convolve(count, np.ones(5), "same")
    middle = (edges[1:] + edges[:-1]) / 2
    for k in np.flatnonzero(near >= MIN_AXIS_SHARE * len(half_width)):
        if near[k] >= near[max(0, k - 4) : k + 5].max():
            around = slice(max(0, k - 2), k + 3)
            return float(np.exp(np.average(middle[around], weights=count[around])))
    return 0.0


def _find_bundles(part: Bools) -> _Bundles | None:
    """Return the stretches of a mask (h, w) bool that are much wider than one strand over several radii; None without any."""
    radius = strand_radius(medial_axis(part)[2] - 0.5)
    if not radius:
        return None
    if radius >= 2 * COARSE_RADIUS_PX and not _may_be_wide(part, radius):
        return None
    closed = _closed(part, max(MIN_CLOSING_PX, round(GAP_RADII * radius / 2)))
    rows, columns, inside = medial_axis(closed)
    at_wide = inside - 0.5 > WIDE_RADII * radius
    if np.count_nonzero(at_wide) < WIDE_LENGTH_RADII * radius:
        return None
    ridge = np.zeros(part.shape, dtype=np.uint8)
    ridge[rows[at_wide], columns[at_wide]] = 1
    side = 2 * math.ceil(radius) + 1
    _, label, stats, _ = cv2.connectedComponentsWithStats(cv2.dilate(ridge, np.ones((side, side), np.uint8)), connectivity=8)
    size = np.bincount(label[rows[at_wide], columns[at_wide]], minlength=len(stats))
    length = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) - side
    kept = (np.minimum(size, length) > WIDE_LENGTH_RADII * radius) & (np.arange(len(stats)) > 0)
    if not kept.any():
        return None
    wide = kept[label]
    widest = float(inside[at_wide][kept[label[rows[at_wide], columns[at_wide]]]].max())
    return _Bundles(radius, part, closed, closed & _dilated(wide, widest + radius), widest)


def _long_holes(holes: Bools) -> Bools:
    """Return the holes (h, w) that are long enough for a gap between strands."""
    if not holes.any():
        return holes
    _, label, stats, _ = cv2.connectedComponentsWithStats(holes.astype(np.uint8), connectivity=8)
    long = stats[:, cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1].max(axis=1) >= MIN_GAP_PX
    long[0] = False
    return np.asarray(long[label])


def _may_be_wide(part: Bools, radius: float) -> bool:
    """Tell from a mask (h, w) bool on a coarser grid whether it may have wide stretches that are long enough; err on the safe side."""
    step = int(radius / COARSE_RADIUS_PX)
    side = 2 * math.ceil(GAP_RADII * radius / 2 / step) + 1
    coarse = np.ascontiguousarray(part[::step, ::step]).astype(np.uint8)
    closed = cv2.morphologyEx(coarse, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    inside = medial_axis(closed > 0)[2]
    return bool(np.count_nonzero(inside * step > WIDE_RADII * radius) * step >= WIDE_LENGTH_RADII * radius / 2)


def _shade(
    part: Bools, box: tuple[slice, slice], radius: float, widest: float, color: Array | None, depth: Array | None
) -> Array:
    """Return the image (h, w) float32 in which strands are ridges, in units of the contrast within the mask."""
    shade = np.zeros(part.shape, dtype=np.float32)
    if color is not None:
        shade[1:-1, 1:-1] = cv2.transform(color[box], np.full((1, 3), 1 / 3))
    elif depth is not None:
        shade[1:-1, 1:-1] = _nearness(depth[box], part[1:-1, 1:-1], radius)
    values = shade[part]
    low, middle, high = np.percentile(values[:: max(1, len(values) // MAX_VALUES)], (10, 50, 90))
    contrast = (high - low) / 2
    if contrast < (MIN_CONTRAST if color is not None else MIN_NEARNESS):
        return _equal_widths(part, radius, widest)
    return np.where(part, np.clip((shade - middle) / contrast, -CLIP, CLIP), -CLIP).astype(np.float32)


def _equal_widths(part: Bools, radius: float, widest: float) -> Array:
    """Return the image (h, w) float32 in which strands of equal width fill a mask: as many as fit its width there.

    The width is that of the mask with the wedges between parting strands filled, so that the strands run on straight into these.
    """
    outline = _closed(part, math.ceil(WEDGE_RADII * radius))
    distance = cv2.distanceTransform(np.pad(outline, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    half = math.ceil(widest)
    half_width = cv2.dilate(distance, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * half + 1, 2 * half + 1)))
    strand = half_width / np.maximum(1, np.rint((half_width - 0.5) / (EQUAL_RADII * radius)))
    return np.where(part, -np.cos(np.pi * distance / np.maximum(strand, 1)), -CLIP).astype(np.float32)


def _nearness(depth: Array, part: Bools, radius: float) -> Array:
    """Return by how many m each pixel (h, w) is nearer than the mask around it on average; 0 without a reading."""
    known = (part & (depth > 0)).astype(np.float32)
    side = 2 * math.ceil(AROUND_RADII * radius) + 1
    count, total = (cv2.boxFilter(image, -1, (side, side), normalize=False) for image in (known, known * depth))
    return np.asarray(np.where(known > 0, total / np.maximum(count, 1) - depth, 0.0))


def _find_valleys(shade: Array, radius: float) -> tuple[Array, Bools]:
    """Return the depth (h, w) of the valleys in an image, and which pixels are their bottoms.

    The depth is the largest of all orientations. A crest through the same pixel counts against it: along a strand's highlight the
    image is a shallow valley.
    """
    scale = min(1.0, FILTER_RADIUS_PX / radius)
    small = cv2.resize(shade, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else shade
    depths = np.stack(
        [cv2.filter2D(small, -1, kernel, borderType=cv2.BORDER_REPLICATE) for kernel in _line_detectors(radius * scale)]
    )
    orientation = depths.argmax(axis=0)
    depth = depths.max(axis=0) + np.minimum(0, depths.min(axis=0))
    if scale < 1:
        depth = cv2.resize(depth, shade.shape[::-1], interpolation=cv2.INTER_LINEAR)
        orientation = cv2.resize(orientation.astype(np.uint8), shade.shape[::-1], interpolation=cv2.INTER_NEAREST)
    padded = np.pad(depth, 1, constant_values=-np.inf)
    bottom = np.zeros(depth.shape, dtype=bool)
    height, width = depth.shape
    sector = ((orientation + ORIENTATIONS // 8) // (ORIENTATIONS // 4)) % 4
    for k, (dy, dx) in enumerate(((1, 0), (1, -1), (0, 1), (1, 1))):
        ahead = padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width]
        behind = padded[1 - dy : 1 - dy + height, 1 - dx : 1 - dx + width]
        bottom |= (sector == k) & (depth >= ahead) & (depth >= behind)
    return depth, bottom


def _line_detectors(radius: float) -> list[Array]:
    """Return the second derivative of a Gaussian across a line, averaged along it, for each orientation."""
    across, along = max(MIN_VALLEY_PX, VALLEY_RADII * radius), VALLEY_LENGTH_RADII * radius
    half = math.ceil(2 * max(across, along))
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(float)
    kernels = []
    for angle in np.arange(ORIENTATIONS) * np.pi / ORIENTATIONS:
        axial, lateral = x * np.cos(angle) + y * np.sin(angle), -x * np.sin(angle) + y * np.cos(angle)
        kernel = ((lateral / across) ** 2 - 1) * np.exp(-((lateral / across) ** 2) / 2 - (axial / along) ** 2 / 2)
        kernel -= kernel.mean()
        kernels.append((2 * kernel / np.abs(kernel).sum()).astype(np.float32))
    return kernels


def _find_lines(valley: Array, bottom: Bools, bundles: _Bundles) -> Bools:
    """Return the middle lines (h, w) of the valleys that part strands."""
    radius = bundles.radius
    distance = bundles.distance
    inner = bundles.wide & (distance > max(1.5, INNER_RADII * radius)) & (valley > MIN_VALLEY)
    skeleton = _thinned(_closed(bottom & inner, 1) & inner)
    _, label, stats, _ = cv2.connectedComponentsWithStats(skeleton.astype(np.uint8), connectivity=8)
    size = stats[:, cv2.CC_STAT_AREA]
    deep = np.zeros(len(size), dtype=bool)
    for k in np.argsort(-size, kind="stable")[: MAX_VALLEYS + 1]:
        if k and size[k] >= MIN_VALLEY_RADII * radius:
            own = label == k
            deep[k] = np.median(valley[own]) >= SURE_VALLEY and np.median(distance[own]) >= MIN_SPACING_RADII * radius
    return _opening_lines(np.where(deep[label], label, 0), bundles)


def _opening_lines(label: Ints, bundles: _Bundles) -> Bools:
    """Return the lines (h, w) that run out between two strands, or are continued by one that does, each up to its opening.

    `label` (h, w) is the number of the line through each pixel, 0 for none. A line that runs along a gap of the mask counts as
    open. A stripe along a single strand opens nowhere.
    """
    result = label > 0
    ends = _line_ends(label, bundles.radius)
    carried = [_carry_on(end, label, bundles) for end in ends]
    position = np.array([end.position for end in ends]).reshape(-1, 2)
    number = np.array([end.line for end in ends], dtype=np.int64)
    near = np.argwhere(np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1)) <= LINK_RADII * bundles.radius)
    size = int(label.max()) + 1
    graph = coo_array((np.ones(len(near)), (number[near[:, 0]], number[near[:, 1]])), shape=(size, size))
    group = connected_components(graph, directed=False)[1]
    opens = np.zeros(size, dtype=bool)
    opens[group[number[np.array([opening for _, opening in carried], dtype=bool)]]] = True
    in_gap = np.bincount(label[~bundles.part], minlength=size)
    opens[group[in_gap >= MIN_VALLEY_RADII * bundles.radius]] = True
    in_gap = np.bincount(group, weights=in_gap, minlength=size)
    length = np.bincount(group, weights=np.bincount(label[label > 0], minlength=size), minlength=size)
    width = np.zeros(size)
    np.maximum.at(width, group[label[label > 0]], 2 * bundles.distance[label > 0])
    kept = opens & (length >= MIN_VALLEY_WIDTHS * width)
    if bundles.radius >= FINE_RADIUS_PX:
        kept &= in_gap < PARTED_SHARE * length
    kept = kept[group]
    kept[0] = False
    result &= kept[label]
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
        if length >= MIN_END_LENGTH * window:
            ends.append(_LineEnd(int(label[row, column]), np.array((row, column)), -back / length))
    return ends


def _carry_on(end: _LineEnd, label: Ints, bundles: _Bundles) -> tuple[Ints, bool]:
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


def _without_corners(lines: Bools) -> Bools:
    """Return lines (h, w) with a pixel added at each diagonal step, so that no two pixels of other strands touch across it."""
    result = lines.copy()
    result[:-1, 1:] |= lines[:-1, :-1] & lines[1:, 1:] & ~lines[1:, :-1]
    result[:-1, :-1] |= lines[:-1, 1:] & lines[1:, :-1] & ~lines[1:, 1:]
    return result


def _closed(mask: Bools, px: int) -> Bools:
    """Return a mask with gaps up to 2 `px` wide closed; nothing is added at its border."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * px + 1, 2 * px + 1))
    padded = cv2.morphologyEx(np.pad(mask, px).astype(np.uint8), cv2.MORPH_CLOSE, kernel) > 0
    return np.ascontiguousarray(padded[px:-px, px:-px])


def _grown(box: tuple[slice, slice], px: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Return a box grown by `px` on all sides, within an image (h, w)."""
    rows, columns = (slice(max(0, side.start - px), min(size, side.stop + px)) for side, size in zip(box, shape, strict=True))
    return rows, columns


def _dilated(mask: Bools, px: float) -> Bools:
    """Return the pixels within `px` of a mask that has at least one."""
    return np.asarray(cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5) <= px)
