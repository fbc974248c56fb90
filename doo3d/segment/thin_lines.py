"""Lines of a photograph that differ in color from a plain surface on both sides, at the photograph's own scale.

The network sees a small image, in which thin lines are gone; before a surface without any texture it finds thick ones in part.
"""

from __future__ import annotations

import cv2
import numpy as np

from ..types import Array, Bools, Ints
from .color_strands import MIN_SEED_SHARE, find_bands
from .mask_parts import Parts, drawn
from .methods.selected import ColorBands
from .methods.strands import IMAGE_PIXELS

MAX_PIXELS = 9 * IMAGE_PIXELS
"""Pixels (1920 x 1080) that a photograph is scaled down to before lines are looked for: a line of 8 of 4000 px is 3 px wide then,
and one of 60 is 26 px, narrow for the window from which the surface is learned."""

MIN_THIN_SHARE, MIN_PART_SHARE = 0.5, 1.0
"""Length of a line over the shorter side of the photograph at least, of one too thin for the network, and of one found in part:
scratches, letters and joints are shorter."""

SIDE_WIDTHS, MIN_FREE_SHARE = 2.0, 1.1
"""Widths beside a line in which the surface is seen, at that share of the pixels that a straight line along an axis has there.
Drawn curves and the wires of seven photographs have 1.15 and more, textures and cables with their shadows less."""

MAX_WIDTH_RATIO = 1.2
"""Ratio of the widths at the 85th percentile and in the median of a line found in part, at most: one with shadows has more."""

MIN_BOW = 0.05
"""Spread of a line across its main direction over that along it, about the sag over the length: joints of boards and tiles are
straighter."""

ROUNDED_PX = 0.5
"""px by which the width of a line of 1 to 3 px is measured too low: its pixels are whole."""

ALL_LIGHT = 1e9
"""Share of the lightness that no shadow leaves: a line counts, however dark it is."""


def find_lines(color: Array, found: Bools, thin_px: float) -> Bools:
    """Return the pixels (H, W) bool of lines that a network for thin objects misses in a photograph.

    A line is a long, bent band of one width with plain surface on both sides. It is missed if it is too thin for the network, or
    if the network finds it in part only.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    found
        (H, W) bool, the pixels that the network takes for an object.
    thin_px
        px, width below which the network sees no line.
    """
    shape = color.shape[:2]
    scale = min(1.0, (MAX_PIXELS / found.size) ** 0.5)
    if scale < 1:
        color = cv2.resize(color, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        found = cv2.resize(found.view(np.uint8), color.shape[1::-1], interpolation=cv2.INTER_NEAREST).view(bool)
    nothing = np.zeros(found.shape, dtype=bool)
    bands = find_bands(np.ascontiguousarray(color), nothing, nothing, ALL_LIGHT)
    if bands is None:
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
    """Return the parts of bands (H, W); those of many widths are cut where they are wider than `width`, px, as at a hand."""
    parts = bands.parts
    uneven = drawn(parts.pixels_of(np.flatnonzero(~parts.strands)), shape).view(np.uint8)
    side = 2 * int(width / 2) + 3
    uneven -= cv2.morphologyEx(uneven, cv2.MORPH_OPEN, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
    mask = uneven.view(bool)
    mask.ravel()[parts.pixels_of(np.flatnonzero(parts.strands))] = True
    return Parts.of(mask, np.zeros(0, dtype=int))


def _bow(line: Ints, columns: int) -> float:
    """Return the spread of a line (N,) of an image of so many columns across its main direction over that along it, 0 to 1."""
    across, along = np.linalg.eigvalsh(np.cov(np.divmod(line, columns)))
    return float(np.sqrt(max(across, 0.0) / along))


def _free_share(line: Ints, bands: ColorBands, shape: tuple[int, ...], width: float) -> float:
    """Return how much of the surface that a single line (N,) of a width in px has beside it is no part of a band, 0 to 1."""
    reach = max(1, round(SIDE_WIDTHS * width))
    near = cv2.dilate(drawn(line, shape).view(np.uint8), np.ones((2 * reach + 1,) * 2, np.uint8))
    return float(np.count_nonzero(near.view(bool) & ~drawn(bands.parts.pixels, shape)) / (2 * reach * len(line) / width))
