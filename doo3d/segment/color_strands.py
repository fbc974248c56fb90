"""Strands of a frame told from the surface around them by color, beside what is raised from the plane.

Depth loses strands of 2 to 3 px, since the windows of a stereo camera are wider; far away its noise is as high as a strand. Color
shows both. Depth in turn shows strands of the table's color, and which of the bands in an image are raised.
"""

from __future__ import annotations

import cv2
import numpy as np

from ..kernels import color_bands
from ..scene.surround import learn_surround
from ..types import Array, Bools, Frame, Ints
from .mask_parts import MIN_PIXELS, Parts, drawn
from .methods.selected import ColorBands, Selected, left_out_note

MIN_SIDE_PX = 5
"""px; in a narrower image no color is looked at: the blur that removes the camera's noise is as wide."""

GROW_DEVIATIONS = 3.5
"""Deviations of the surface's own color: the lower threshold of the hysteresis; the upper is twice as high. In the image scaled
down by 4 a band is looked for from the lower one on: a strand of 2 px leaves a quarter of its contrast there at worst; it is
followed from one place."""

MIN_SEED_SHARE = 0.2
"""Share of a band's pixels that are above the higher threshold at least."""

EDGE_SHARE = 0.5
"""Share of the contrast within 2 px that a pixel at the edge of a band has at least: half a pixel of a strand is one."""

MIN_SHADOW_LIGHT = 0.3
"""Share of the lightness that a shadow leaves at least."""

RAISED_SHARE, MIN_RAISED_SHARE = 0.3, 0.1
"""Share of a band that is raised from which on depth sees strands at all; then one with less than the second is flat."""

MAX_RAISED_SHARE = 0.75
"""Share of a band that is raised from which on depth shows it well, and color would only fill the gaps between turns."""

SAME_HUE = 20.0
"""Distance of the color axes of 8-bit CIELAB below which a short raised part is taken for a piece of a strand, as beside an
occluder, in whatever shade."""

FLANK_SQUARE_PX, FLANK_DIAMOND_PX = 4, 6
"""px from a strand told by color within which raised pixels of the surface's color are errors of depth at its edge: 10 along the
axes, in an octagon that is a square of the first widened by a diamond of the second."""


def select_in_frame(raised: Bools, frame: Frame) -> Selected:
    """Add the strands told by color to the raised pixels, and remove the raised pixels beside them that look like the surface.

    Where that explains not every part of what is raised, the surface is learned again from what is neither raised nor a band:
    in a coil that depth does not show, most of what is around a pixel is the coil, and the surface within it looked like a band.

    Parameters
    ----------
    raised
        (H, W) bool, the pixels raised from the plane.
    frame
        the frame; without color the raised pixels are returned as they are.
    """
    if frame.color is None:
        return Selected(raised)
    color = np.ascontiguousarray(frame.color)
    bands = find_bands(color, raised, raised)
    if bands is None:
        return Selected(raised)
    selected = select_bands(bands, color)
    again = None if selected.is_certain else _told_again(color, bands)
    return selected if again is None else select_bands(again, color)


def select_bands(bands: ColorBands, color: Array) -> Selected:
    """Return what is selected in a frame with bands that color tells from the surface.

    Parameters
    ----------
    bands
        what differs in color from the surface.
    color
        (H, W, 3) uint8 RGB.
    """
    parts, surface, raised = bands
    strands = np.flatnonzero(parts.strands)
    if not len(strands):
        return Selected(raised, bands=bands)
    share = parts.shares(raised)[strands]
    flat = (share < MIN_RAISED_SHARE) if (share > RAISED_SHARE).any() else np.zeros(len(strands), dtype=bool)
    told = parts.pixels_of(strands[~flat])
    selected = raised.copy()
    selected.ravel()[surface[_around(told, raised.shape).ravel()[surface]]] = False
    selected.ravel()[parts.pixels_of(strands[~flat & (share < MAX_RAISED_SHARE)])] = True
    is_certain = False
    if len(told):
        own = Parts.of(selected, told)
        other = _other_things(own, parts, strands[~flat], color)
        selected.ravel()[own.pixels[np.repeat(other, own.sizes)]] = False
        is_certain = bool((own.holds | (other & ~own.long) | (own.sizes < MIN_PIXELS)).all())
    left_out = tuple(parts.pixels_of(strands[k : k + 1]) for k in np.flatnonzero(flat).tolist())
    note = left_out_note("strands", len(left_out), "flat on the surface, as marks and shadows are")
    return Selected(selected, note, None, left_out, told, is_certain, bands)


def _around(pixels: Ints, shape: tuple[int, ...]) -> Bools:
    """Return which pixels of an image (H, W), bool, lie in the octagon around one of some pixels (N,), row-major indices."""
    near = cv2.dilate(drawn(pixels, shape).view(np.uint8), np.ones((2 * FLANK_SQUARE_PX + 1,) * 2, np.uint8))
    near = cv2.dilate(near, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)), iterations=FLANK_DIAMOND_PX)
    return np.asarray(near.view(bool))


def _other_things(own: Parts, bands: Parts, strands: Ints, color: Array) -> Bools:
    """Return which of the selected parts, (K,) bool, are too short for a strand and have the color of none: boxes and specks."""
    other = ~own.holds & ~own.strands
    candidates = np.flatnonzero(other & (own.sizes >= MIN_PIXELS))
    if len(candidates):
        hues = bands.hues(strands, color)
        other[candidates] = np.linalg.norm(own.hues(candidates, color)[:, None] - hues, axis=2).min(axis=1) >= SAME_HUE
    return np.asarray(other)


def find_bands(color: Array, raised: Bools, covered: Bools, shadow_light: float = MIN_SHADOW_LIGHT) -> ColorBands | None:
    """Return the bands that differ in color from the surface, and the raised pixels beside them that do not.

    The image itself is looked at only round the places where a coarser one shows a band; None if it shows none. covered : (H, W)
    bool, the pixels from which the surface is not learned. shadow_light : share of the lightness above which what is darker,
    without another color, is a shadow and no band.
    """
    if min(color.shape[:2]) < MIN_SIDE_PX:
        return None
    around, deviation, seeds = learn_surround(color, covered, GROW_DEVIATIONS)
    if not seeds.any():
        return None
    limits = np.array((GROW_DEVIATIONS, 2 * GROW_DEVIATIONS, MIN_SEED_SHARE, shadow_light, EDGE_SHARE))
    reach = FLANK_SQUARE_PX + FLANK_DIAMOND_PX
    pixels, starts, widths, holds, surface = color_bands(color, around, deviation, seeds, raised, reach, MIN_PIXELS, limits)
    return ColorBands(Parts(pixels, starts, widths, holds), surface, raised)


def _told_again(color: Array, bands: ColorBands) -> ColorBands | None:
    """Return the bands that differ from the surface as it is outside of the first ones; None without any."""
    covered = bands.raised.copy()
    covered.ravel()[bands.parts.pixels] = True
    return find_bands(color, bands.raised, covered)
