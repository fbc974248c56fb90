"""Strands of a frame told from the surface around them by color, beside what is raised from the plane.

Depth loses strands of 2 to 3 px, since the windows of a stereo camera are wider; far away its noise is as high as a strand. Color
shows both. Depth in turn shows strands of the table's color, and which of the bands in an image are raised.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from ...geometry.noise import MAD_TO_DEVIATION, SAMPLES
from ...kernels import color_bands, mask_parts
from ...types import Array, Bools, Floats, Frame, Ints
from .methods.selected import Selected

MEDIAN_PX = 15
"""Window of the median that gives the surface's color in the image scaled down by 8: 120 px, more than twice as wide as any
strand."""

BLUR = (0.02192, 0.22851, 0.49915, 0.22851, 0.02192)
"""Weights of the blur that removes the camera's noise of color: a Gaussian of 0.8 px."""

MIN_DEVIATION = 1.0
"""Deviation of an 8-bit color of the surface at least: rounding alone has 0.3."""

SEED_DEVIATIONS, GROW_DEVIATIONS = 7.0, 3.5
"""Deviations of the surface's own color: the two thresholds of the hysteresis. In the image scaled down by 4 a band is looked for
from the lower one on: a strand of 2 px leaves a quarter of its contrast there at worst; it is followed from one place."""

MIN_SEED_SHARE = 0.2
"""Share of a band's pixels that are above the higher threshold at least."""

EDGE_SHARE = 0.5
"""Share of the contrast within 2 px that a pixel at the edge of a band has at least: half a pixel of a strand is one."""

MIN_SHADOW_LIGHT = 0.3
"""Share of the lightness that a shadow leaves at least."""

MIN_LENGTH_PX, MIN_LENGTH_WIDTHS, MIN_PIXELS = 40.0, 12.0, 60
"""Length of a strand at least, in px and in widths, and its pixels."""

MAX_WIDTH_RATIO, WIDTH_SLACK_PX = 1.6, 1.0
"""Ratio of the half-widths at the 85th percentile and in the median at most, besides what pixels add: a strand has one width."""

RAISED_SHARE, MIN_RAISED_SHARE = 0.3, 0.1
"""Share of a band that is raised from which on depth sees strands at all; then one with less than the second is flat."""

MAX_RAISED_SHARE = 0.75
"""Share of a band that is raised from which on depth shows it well, and color would only fill the gaps between turns."""

SAME_HUE = 20.0
"""Distance of the color axes of 8-bit CIELAB below which a short raised part is taken for a piece of a strand, as beside an
occluder, in whatever shade."""

FLANK_PX = 10
"""px from a strand told by color within which raised pixels of the surface's color are errors of depth at its edge."""


def select_in_frame(raised: Bools, frame: Frame) -> Selected:
    """Add the strands told by color to the raised pixels, and remove the raised pixels beside them that look like the surface.

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
    found = _told_by_color(color, raised)
    if found is None:
        return Selected(raised)
    band, differs = found
    parts = _parts(band)
    strands = np.flatnonzero(parts.long)
    if not len(strands):
        return Selected(raised)
    share = np.add.reduceat(raised.ravel()[parts.pixels], parts.starts[:-1], dtype=int)[strands] / parts.sizes[strands]
    flat = (share < MIN_RAISED_SHARE) if (share > RAISED_SHARE).any() else np.zeros(len(strands), dtype=bool)
    told = parts.drawn(strands[~flat], raised.shape)
    surface = raised & ~differs
    selected = raised & ~(_near(told) & surface) if surface.any() else raised.copy()
    selected.ravel()[parts.pixels_of(strands[~flat & (share < MAX_RAISED_SHARE)])] = True
    if len(strands) > flat.sum():
        selected.ravel()[_other_things(selected, told, parts, strands[~flat], color)] = False
    note = ""
    if flat.any():
        bands = "1 band that is" if flat.sum() == 1 else f"{flat.sum()} bands that are"
        note = f"segment (strands): left out {bands} flat on the surface, as marks and shadows are; give a mask if wrong"
    return Selected(selected, note)


class _Parts(NamedTuple):
    """The K connected parts of a mask.

    Attributes
    ----------
    pixels
        (N,) row-major indices of the mask's pixels, part by part.
    starts
        (K + 1,) where each part begins in `pixels`.
    long
        (K,) bool, the parts that are long and of one width.
    """

    pixels: Ints
    starts: Ints
    long: Bools

    @property
    def sizes(self) -> Ints:
        return np.diff(self.starts)

    def pixels_of(self, wanted: Ints) -> Ints:
        """Return the row-major indices of the pixels of some parts, given by number."""
        chosen = [self.pixels[self.starts[part] : self.starts[part + 1]] for part in wanted]
        return np.concatenate(chosen) if chosen else np.zeros(0, dtype=int)

    def drawn(self, wanted: Ints, shape: tuple[int, ...]) -> Bools:
        """Return the mask (H, W) of some parts, given by number."""
        mask = np.zeros(shape, dtype=bool)
        mask.ravel()[self.pixels_of(wanted)] = True
        return mask


def _parts(mask: Bools) -> _Parts:
    """Return the connected parts of a mask, and which of them are long and of one width."""
    pixels, starts, widths = mask_parts(mask, MIN_PIXELS)
    half, most = np.maximum(widths[:, 0], 0.5), widths[:, 1]
    sizes = np.diff(starts)
    long = sizes / (2 * half) > np.maximum(MIN_LENGTH_PX, MIN_LENGTH_WIDTHS * 2 * half)
    return _Parts(pixels, starts, (sizes >= MIN_PIXELS) & long & (most < MAX_WIDTH_RATIO * half + WIDTH_SLACK_PX))


def _near(mask: Bools) -> Bools:
    """Return the pixels (H, W) within FLANK_PX of a mask, in an octagon: 4 px in a square, the rest in a cross."""
    square, cross = 4, FLANK_PX - 4
    wide = cv2.dilate(mask.view(np.uint8), np.ones((2 * square + 1,) * 2, np.uint8))
    return np.asarray(cv2.dilate(wide, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)), iterations=cross) > 0)


def _other_things(selected: Bools, told: Bools, bands: _Parts, strands: Ints, color: Array) -> Ints:
    """Return the row-major indices of the selected parts that are too short for a strand and have the color of none.

    Such parts are boxes and specks.
    """
    own = _parts(selected)
    if not len(own.pixels):
        return own.pixels
    with_strand = np.logical_or.reduceat(told.ravel()[own.pixels], own.starts[:-1])
    other = ~with_strand & ~own.long
    candidates = np.flatnonzero(other & (own.sizes >= MIN_PIXELS))
    if len(candidates):
        color_of = np.array([_hue(color, bands.pixels_of(strands[i : i + 1])) for i in range(len(strands))])
        for part in candidates:
            hue = _hue(color, own.pixels_of(np.array([part])))
            other[part] = np.linalg.norm(color_of - hue, axis=1).min() >= SAME_HUE
    return own.pixels[np.repeat(other, own.sizes)]


def _hue(color: Array, pixels: Ints) -> Floats:
    """Return the median (2,) of the color axes of 8-bit CIELAB at pixels, given by row-major indices."""
    some = color.reshape(-1, 3)[pixels[:: max(1, len(pixels) // SAMPLES)]]
    return np.asarray(np.median(cv2.cvtColor(some[None], cv2.COLOR_RGB2LAB)[0, :, 1:], axis=0))


def _told_by_color(color: Array, raised: Bools) -> tuple[Bools, Bools] | None:
    """Return the pixels (H, W) of bands that differ from the surface around them and are no shadow, and all that differ.

    The image itself is looked at only round the places where a coarser one shows a band; None if it shows none.
    """
    if min(color.shape[:2]) < len(BLUR):
        return None
    coarse = _halved(_halved(color))
    lab = cv2.cvtColor(coarse, cv2.COLOR_RGB2LAB)
    small, size = _halved(lab), lab.shape[1::-1]
    around = cv2.medianBlur(_without(small, raised), MEDIAN_PX).astype(np.float32)
    wide = cv2.resize(around, size, interpolation=cv2.INTER_LINEAR)
    deviation = _deviation(color, wide)
    contrast = cv2.transform(cv2.pow(lab - wide, 2), (1 / deviation[None] ** 2))
    seeds = contrast > GROW_DEVIATIONS**2
    if not seeds.any():
        return None
    limits = np.array((GROW_DEVIATIONS, SEED_DEVIATIONS, MIN_SEED_SHARE, MIN_SHADOW_LIGHT, EDGE_SHARE))
    return color_bands(color, around, deviation, seeds, raised, limits)


def _halved(image: Array) -> Array:
    size = max(1, image.shape[1] // 2), max(1, image.shape[0] // 2)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def _deviation(color: Array, around: Array) -> Floats:
    """Return the robust standard deviation (3,) of the blurred image from the surface's color, given on a smaller image."""
    height, width = color.shape[:2]
    step = max(1, round((height * width / SAMPLES) ** 0.5 / 2))
    v, u = np.arange(2, height - 2, 4 * step), np.arange(2, width - 2, step)
    rows = cv2.cvtColor(color[(v[:, None] + np.arange(-2, 3)).ravel()], cv2.COLOR_RGB2LAB).reshape(len(v), 5, width, 3)
    along = np.tensordot(np.array(BLUR, np.float32), rows, (0, 1))
    lab = sum((np.float32(share) * along[:, u + i - 2] for i, share in enumerate(BLUR)), np.float32(0))
    surface = around[(v * around.shape[0] // height)[:, None], u * around.shape[1] // width]
    deviation = MAD_TO_DEVIATION * np.median(np.abs(lab - surface).reshape(-1, 3), axis=0)
    return np.asarray(np.maximum(deviation.astype(float), MIN_DEVIATION))


def _without(small: Array, raised: Bools) -> Array:
    """Return the scaled image (h, w, 3) with the surface's color in place of pixels mostly raised, so that a coil is none."""
    wide = cv2.dilate(raised.view(np.uint8), np.ones((5, 5), np.uint8)) * np.uint8(255)
    covered = cv2.resize(_halved(_halved(wide)), small.shape[1::-1], interpolation=cv2.INTER_AREA)
    bare = (covered < 128).astype(np.float32)
    share = cv2.blur(bare, (MEDIAN_PX, MEDIAN_PX))
    mean = cv2.blur(small * bare[..., None], (MEDIAN_PX, MEDIAN_PX)) / np.maximum(share, 1e-3)[..., None]
    known = (bare > 0) | (share * MEDIAN_PX**2 < 1)
    return np.where(known[..., None], small, np.rint(mean)).astype(np.uint8)
