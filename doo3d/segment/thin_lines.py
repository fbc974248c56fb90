"""Detect lines in a photograph that differ in color from a plain surface on both sides, at the scale of the photograph.

The network examines a small image, in which thin lines vanish; in front of a surface without texture it finds thick lines in
part.
"""

import cv2
import numpy as np

from ..types import Array, Bools, Ints
from .color_strands import MIN_SEED_SHARE, find_bands
from .mask_parts import Parts, drawn
from .methods.result import ColorBands
from .methods.strands import IMAGE_PIXELS

MAX_PIXELS = 9 * IMAGE_PIXELS
"""Number of pixels (1920 x 1080) to which a photograph is scaled down before lines are searched. Of a photograph 4000 px wide, a
line of 8 px is 3 px wide then, and one of 60 px is 26 px: narrow for the window from which the surface's color is learned."""

MIN_THIN_SHARE, MIN_PART_SHARE = 0.5, 1.0
"""Minimum length of a line as a fraction of the shorter side of the photograph: of a line too thin for the network, and of one
that the network found in part. Scratches, letters and joints are shorter."""

SIDE_WIDTHS, MIN_FREE_SHARE = 2.0, 1.1
"""Distance on both sides of a line, in widths, within which the surface must be visible, and the minimum number of its pixels as
a fraction of those that a straight horizontal line has there. Drawn curves and the wires of seven photographs have 1.15 and more,
textures and cables with their shadows less."""

MAX_WIDTH_RATIO = 1.2
"""Maximum ratio of the 85th percentile to the median of the widths of a line found in part; a line with shadows has more."""

MIN_BOW = 0.05
"""Minimum ratio of a line's standard deviation across its main direction to that along it, about its sag over its length: joints
of boards and tiles are straighter."""

ROUNDED_PX = 0.5
"""px by which the width of a line of 1 to 3 px is underestimated, since it is measured in whole pixels."""

ALL_LIGHT = 1e9
"""Lightness in a shadow, as a fraction of the surface's, that no shadow reaches: even the darkest line is not taken for one."""


def find_lines(color: Array, found: Bools, thin_px: float) -> Bools:
    """Return the pixels (H, W) bool of lines that a network for thin objects misses in a photograph.

    A line is a long, bent band of constant width with plain surface on both sides. It is missed if it is too thin for the
    network, or if the network finds only a part of it.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    found
        (H, W) bool, the object pixels by the network.
    thin_px
        px, width below which the network may miss a line.
    """
    shape = color.shape[:2]
    scale = min(1.0, (MAX_PIXELS / found.size) ** 0.5)
    if scale < 1:
        color = cv2.resize(color, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        found = cv2.resize(found.view(np.uint8), color.shape[1::-1], interpolation=cv2.INTER_NEAREST).view(bool)
    nothing = np.zeros(found.shape, dtype=bool)
    bands = find_bands(np.ascontiguousarray(color), nothing, nothing, ALL_LIGHT)
    if not bands:
        return np.zeros(shape, dtype=bool)
    lines = nothing.copy()
    parts = narrow_parts(bands, found.shape, 2 * scale * thin_px)
    width = 2 * parts.widths[:, 1] + ROUNDED_PX
    share = parts.shares(found)
    is_thin = width < scale * thin_px
    is_even = parts.widths[:, 1] <= MAX_WIDTH_RATIO * parts.widths[:, 0]
    missed = (share < 1 - MIN_SEED_SHARE) & (is_thin | (is_even & (share >= MIN_SEED_SHARE)))
    is_long = parts.sizes / width >= np.where(is_thin, MIN_THIN_SHARE, MIN_PART_SHARE) * min(found.shape)
    for part in np.flatnonzero(parts.strands & missed & is_long).tolist():
        own = parts.pixels_of(np.array([part]))
        if _bow(own, found.shape[1]) >= MIN_BOW and _free_share(own, bands, found.shape, float(width[part])) >= MIN_FREE_SHARE:
            lines.ravel()[own] = True
    if scale == 1:
        return lines
    return np.asarray(cv2.resize(lines.astype(np.float32), shape[::-1], interpolation=cv2.INTER_LINEAR) > 0.5)


def narrow_parts(bands: ColorBands, shape: tuple[int, ...], width: float) -> Parts:
    """Return the parts of bands in an image (H, W); bands of varying width are cut where they are wider than `width` px."""
    parts = bands.parts
    uneven = drawn(parts.pixels_of(np.flatnonzero(~parts.strands)), shape).view(np.uint8)
    side = 2 * int(width / 2) + 3
    uneven -= cv2.morphologyEx(uneven, cv2.MORPH_OPEN, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
    mask = uneven.view(bool)
    mask.ravel()[parts.pixels_of(np.flatnonzero(parts.strands))] = True
    return Parts.of(mask)


def _bow(line: Ints, columns: int) -> float:
    """Return the ratio of the standard deviations of a line (N,) across and along its main direction, 0 to 1."""
    across, along = np.linalg.eigvalsh(np.cov(np.divmod(line, columns)))
    return float(np.sqrt(max(across, 0.0) / along))


def _free_share(line: Ints, bands: ColorBands, shape: tuple[int, ...], width: float) -> float:
    """Return the number of pixels beside a line that belong to no band, as a fraction of those beside a straight line as long.

    line : (N,) row-major indices. width : px.
    """
    reach = max(1, round(SIDE_WIDTHS * width))
    near = cv2.dilate(drawn(line, shape).view(np.uint8), np.ones((2 * reach + 1,) * 2, np.uint8))
    return float(np.count_nonzero(near.view(bool) & ~drawn(bands.parts.pixels, shape)) / (2 * reach * len(line) / width))
