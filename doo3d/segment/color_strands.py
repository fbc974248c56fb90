"""Detect the strands of a frame that differ in color from the surface around them, beside the pixels raised from the plane.

Depth misses strands of 2 to 3 px, since the matching window of a stereo camera is wider, and far from the camera the depth noise
is as large as the height of a strand. Both kinds of strand are visible in color. Depth in turn detects strands of the table's
color, and decides which bands of the color image are raised.
"""

import cv2
import numpy as np

from ..kernels import color_bands
from ..scene.surround import learn_surround
from ..types import Array, Bools, Frame, Ints
from .mask_parts import MIN_PIXELS, Parts, drawn
from .methods.result import ColorBands, MethodResult, rejection_note

MIN_SIDE_PX = 5
"""Minimum width and height in px of an image whose colors are examined: the size of the blur kernel against camera noise."""

GROW_DEVIATIONS = 3.5
"""Low threshold of the hysteresis, in standard deviations of the surface's color; the high threshold is twice as large. In the
image scaled down by 4, bands are searched with the low threshold: there a strand of 2 px keeps a quarter of its contrast in the
worst case, and one place suffices, from which it is followed."""

MIN_SEED_SHARE = 0.2
"""Minimum fraction of a band's pixels above the high threshold."""

EDGE_SHARE = 0.5
"""Minimum contrast of a pixel at the edge of a band, as a fraction of the largest contrast within 2 px: a pixel belongs to the
strand if the strand covers half of it."""

MIN_SHADOW_LIGHT = 0.3
"""Minimum lightness in a shadow, as a fraction of the lightness of the surface."""

RAISED_SHARE, MIN_RAISED_SHARE = 0.3, 0.1
"""Raised fraction of a band: if any band has more than the first, depth detects strands in this frame, and a band with less than
the second is flat."""

MAX_RAISED_SHARE = 0.75
"""Raised fraction of a band from which the raised pixels are used alone: color would only fill the gaps between turns."""

SAME_HUE = 20.0
"""Maximum distance between the color axes (8-bit CIELAB) of a short raised part and a strand, for the part to be a piece of that
strand, as beside an occluder. Lightness is ignored."""

FLANK_SQUARE_PX, FLANK_DIAMOND_PX = 4, 6
"""Distances in px from a strand detected by its color within which raised pixels of the surface's color are errors of the depth
at its edge. The neighborhood is an octagon: a square of the first dilated by a diamond of the second, 10 px along the axes."""


def select_in_frame(raised: Bools, frame: Frame) -> MethodResult:
    """Add the strands detected by their color to the raised pixels, and remove the surface-colored raised pixels beside them.

    If some raised part is no strand of these, the color of the surface is learned again without the raised pixels and the bands:
    in a coil that depth does not detect, most pixels around a pixel belong to the coil, and the surface within it became a band.

    Parameters
    ----------
    raised
        (H, W) bool, the pixels raised from the plane.
    frame
        the frame; without color the raised pixels are returned unchanged.
    """
    if frame.color is None:
        return MethodResult(raised)
    color = np.ascontiguousarray(frame.color)
    bands = find_bands(color, raised, raised)
    if not bands:
        return MethodResult(raised)
    selected = select_bands(bands, color)
    if selected.is_certain or not (again := relearn_background(color, bands)):
        return selected
    return select_bands(again, color)


def select_bands(bands: ColorBands, color: Array) -> MethodResult:
    """Select the strands among the color bands of a frame and the raised pixels.

    Parameters
    ----------
    bands
        the bands that differ in color from the surface.
    color
        (H, W, 3) uint8 RGB.
    """
    parts, surface, raised = bands
    strands = np.flatnonzero(parts.strands)
    if not len(strands):
        return MethodResult(raised, bands=bands)
    share = parts.shares(raised)[strands]
    is_flat = (share < MIN_RAISED_SHARE) & (share > RAISED_SHARE).any()
    by_color = parts.pixels_of(strands[~is_flat])
    selected = raised.copy()
    selected.ravel()[surface[_around(by_color, raised.shape).ravel()[surface]]] = False
    selected.ravel()[parts.pixels_of(strands[~is_flat & (share < MAX_RAISED_SHARE)])] = True
    is_certain = False
    if len(by_color):
        own = Parts.of(selected, by_color)
        other = _other_things(own, parts, strands[~is_flat], color)
        selected.ravel()[own.pixels[np.repeat(other, own.sizes)]] = False
        is_certain = bool((own.holds | (other & ~own.long) | (own.sizes < MIN_PIXELS)).all())
    rejected = tuple(parts.pixels_of(strands[k : k + 1]) for k in np.flatnonzero(is_flat).tolist())
    note = rejection_note("strands", len(rejected), "flat on the surface, as marks and shadows are")
    return MethodResult(selected, note, None, rejected, by_color, is_certain, bands)


def _around(pixels: Ints, shape: tuple[int, ...]) -> Bools:
    """Return the pixels of an image (H, W), bool, in the octagon around any of the given pixels (N,), row-major indices."""
    near = cv2.dilate(drawn(pixels, shape).view(np.uint8), np.ones((2 * FLANK_SQUARE_PX + 1,) * 2, np.uint8))
    near = cv2.dilate(near, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)), iterations=FLANK_DIAMOND_PX)
    return np.asarray(near.view(bool))


def _other_things(own: Parts, bands: Parts, strands: Ints, color: Array) -> Bools:
    """Return the selected parts, (K,) bool, that are too short for a strand and have the hue of no strand: boxes and specks."""
    other = ~own.holds & ~own.strands
    candidates = np.flatnonzero(other & (own.sizes >= MIN_PIXELS))
    if len(candidates):
        hues = bands.hues(strands, color)
        other[candidates] = np.linalg.norm(own.hues(candidates, color)[:, None] - hues, axis=2).min(axis=1) >= SAME_HUE
    return np.asarray(other)


def find_bands(color: Array, raised: Bools, covered: Bools, shadow_light: float = MIN_SHADOW_LIGHT) -> ColorBands | None:
    """Return the bands that differ in color from the surface, and the raised pixels beside them that do not.

    The image is examined only around the places at which a coarser image has a band.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    raised
        (H, W) bool, the pixels raised from the plane.
    covered
        (H, W) bool, the pixels from which the color of the surface is not learned.
    shadow_light
        fraction of the surface's lightness above which a darker band of the same hue is a shadow, and removed.

    Returns
    -------
    The bands; None if the coarser image has none, or the image is smaller than MIN_SIDE_PX.
    """
    if min(color.shape[:2]) < MIN_SIDE_PX:
        return None
    around, deviation, seeds = learn_surround(color, covered, GROW_DEVIATIONS)
    if not seeds.any():
        return None
    limits = np.array((GROW_DEVIATIONS, 2 * GROW_DEVIATIONS, MIN_SEED_SHARE, shadow_light, EDGE_SHARE))
    reach = FLANK_SQUARE_PX + FLANK_DIAMOND_PX
    found = color_bands(color, around, deviation, seeds, raised, reach, MIN_PIXELS, limits)
    return ColorBands(Parts(*found[:4]), found[4], raised)


def relearn_background(color: Array, bands: ColorBands) -> ColorBands | None:
    """Learn the color of the surface from the pixels outside of the given bands, and return the bands that differ from it."""
    covered = drawn(bands.parts.pixels, bands.raised.shape)
    covered |= bands.raised
    return find_bands(color, bands.raised, covered)
