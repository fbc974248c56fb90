"""Learn the color of the surface around strands without a mask; pixels of another color may be strands."""

import cv2
import numpy as np

from ..geometry.noise import MAD_TO_DEVIATION, SAMPLES
from ..types import Array, Bools, Floats, Ints

MEDIAN_PX = 15
"""Width in px of the median filter for the surface's color, in the image scaled down by 8: 120 px of the image, more than twice
the width of any strand."""

BLUR_PX = 0.8
"""Standard deviation in px of the Gaussian that removes the camera's noise from colors, and from the log-odds of pixels by
color."""

MIN_DEVIATION = 1.0
"""Minimum standard deviation of a channel of the surface's 8-bit color: rounding alone has 0.3."""


def learn_surround(color: Array, raised: Bools, deviations: float) -> tuple[Array, Floats, Bools]:
    """Learn the color of the surface around strands, and find the places of another color.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB, of at least 5 x 5 px.
    raised
        (H, W) bool, pixels that do not belong to the surface.
    deviations
        minimum distance of another color, in standard deviations of the surface's color.

    Returns
    -------
    around : (h, w, 3) float32 8-bit CIELAB, color of the surface in the image scaled down by 8; it varies with the light.
    deviation : (3,) standard deviation of each channel: noise and texture of the surface.
    differs : (H / 4, W / 4) bool, pixels of another color in the image scaled down by 4.
    """
    lab = to_lab(_halved(_halved(color)))
    around = cv2.medianBlur(_without_raised(_halved(lab), raised), MEDIAN_PX).astype(np.float32)
    surface = cv2.resize(around, lab.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    deviation = np.maximum(MAD_TO_DEVIATION * np.median(_differences(color, surface), axis=0), MIN_DEVIATION).astype(float)
    contrast = cv2.transform(np.square(lab - surface), 1 / np.square(deviation[None]))
    return around, deviation, contrast > deviations**2


def _halved(image: Array) -> Array:
    """Return an image (H, W, C) scaled down by 2."""
    height, width = image.shape[:2]
    return np.asarray(cv2.resize(image, (max(width // 2, 1), max(height // 2, 1)), interpolation=cv2.INTER_AREA))


def _without_raised(small: Array, raised: Bools) -> Array:
    """Return a reduced image in which raised pixels, and those within 2 px, have the mean color of the others around them.

    small : (h, w, 3) uint8. raised : (H, W) bool. A pixel without other pixels in a window of MEDIAN_PX keeps its color.
    """
    wide = cv2.dilate(raised.view(np.uint8), np.ones((5, 5), np.uint8))
    bare = (cv2.resize(wide, small.shape[1::-1], interpolation=cv2.INTER_AREA) == 0).view(np.uint8)
    others = cv2.bitwise_and(small, small, mask=bare)
    total, count = (cv2.boxFilter(image, cv2.CV_32F, (MEDIAN_PX, MEDIAN_PX), normalize=False) for image in (others, bare))
    covered = (bare == 0) & (count > 0)
    filled = small.copy()
    filled[covered] = np.rint(total[covered] / count[covered][:, None])
    return filled


def _differences(color: Array, surface: Array) -> Array:
    """Return the absolute differences (N, 3) of about 2,000 pixels of a blurred image (H, W, 3) from the surface (h, w, 3)."""
    height, width = color.shape[:2]
    step = max(1, round((height * width / SAMPLES) ** 0.5 / 2))
    v, u = np.arange(2, height - 2, 4 * step)[:, None], np.arange(2, width - 2, step)
    kernel = cv2.getGaussianKernel(5, BLUR_PX)
    down, right = np.indices((5, 5)).reshape(2, -1, 1, 1) - 2
    lab = to_lab(color[v + down, u + right].reshape(1, -1, 3)).reshape(25, -1).astype(np.float32)
    blurred = (kernel @ kernel.T).astype(np.float32).ravel() @ lab
    expected = surface[v * surface.shape[0] // height, u * surface.shape[1] // width]
    return np.asarray(np.abs(blurred.reshape(-1, 3) - expected.reshape(-1, 3)))


def to_lab(color: Array) -> Array:
    """Return the colors (H, W, 3) uint8 RGB in 8-bit CIELAB: lightness 0 to 255, and color axes around 128."""
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
