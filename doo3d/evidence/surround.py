"""The colors of the surface around strands, learned before there is a mask: what differs from them may be a strand."""

from __future__ import annotations

import cv2
import numpy as np

from ..geometry.noise import MAD_TO_DEVIATION, SAMPLES
from ..kernels import surface_color
from ..types import Array, Bools, Floats, Ints

MEDIAN_PX = 15
"""Window of the median that gives the surface's color in the image scaled down by 8: 120 px, more than twice as wide as any
strand."""

MIN_DEVIATION = 1.0
"""Deviation of an 8-bit color of the surface at least: rounding alone has 0.3."""


def learn_surround(color: Array, raised: Bools, deviations: float) -> tuple[Array, Floats, Bools]:
    """Learn the color of the surface around strands, and find the places with another one.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB, of at least 5 x 5 px.
    raised
        (H, W) bool, pixels that are not of the surface.
    deviations
        standard deviations of the surface's color beyond which a color is another one.

    Returns
    -------
    around : (h, w, 3) float32 8-bit CIELAB, color of the surface in the image scaled down by 8; it varies with the light
    deviation : (3,) standard deviation of each channel: its noise and texture
    differs : (H / 4, W / 4) bool, pixels of the image scaled down by 4 with another color
    """
    step = max(1, round((color.shape[0] * color.shape[1] / SAMPLES) ** 0.5 / 2))
    return surface_color(color, raised, MEDIAN_PX, step, MAD_TO_DEVIATION, MIN_DEVIATION, deviations)


def to_lab(color: Array) -> Array:
    """Return the colors (H, W, 3) uint8 RGB in CIELAB of 8 bits: lightness up to 255, and color axes around 128."""
    return np.asarray(cv2.cvtColor(color, cv2.COLOR_RGB2LAB))


def median_hues(color: Array, pixels: Ints, sizes: Ints) -> Floats:
    """Return the median color axes of 8-bit CIELAB of K groups of pixels of an image, (K, 2).

    color : (H, W, 3) uint8 RGB. pixels : (N,) row-major indices, group by group. sizes : (K,) number of pixels of each group.
    """
    hues = to_lab(color.reshape(-1, 3)[pixels][None])[0, :, 1:]
    group = np.repeat(np.arange(len(sizes)), sizes) << 8
    ranked = np.sort(group[:, None] + hues, axis=0) & 255
    middle = np.cumsum(sizes) - sizes + sizes // 2
    return np.where(sizes[:, None] > 0, np.append(ranked, [[0, 0]], axis=0)[middle], 0).astype(float)
