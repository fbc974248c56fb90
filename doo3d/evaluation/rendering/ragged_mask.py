"""Spoil a true mask as segmentation does: wavy borders, lost pieces, false blobs, closed gaps."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.random import Generator
from scipy.ndimage import distance_transform_edt, gaussian_filter

from ...types import Array, Bools, Floats

OFFSET_PX = (1.0, 3.0)
"""px; least and greatest amplitude of the border's offset, drawn for each frame."""

WAVE_PX = 9.0
"""px, sigma of the blurred noise whose values displace the border: waves of some 40 px."""

MAX_INWARD = 0.55
"""Half widths of the cable by which its border is moved inwards at most: lost pieces are blobs of their own."""

CLOSED_GAP_PX = (2.0, 6.0)
"""px; least and greatest width of gaps between strands that are closed."""

LOST, FALSE = (1, 4), (2, 6)
"""Least and greatest numbers of pieces that are lost, and of blobs that are no cable."""

LOST_SIZE, FALSE_SIZE = (0.6, 2.5), (0.8, 3.0)
"""Least and greatest length of these over the cable's width."""

BESIDE = 0.5
"""Chance of a false blob to touch the cable's border; the others lie anywhere in the image."""


def ragged_mask(mask: Bools, rng: Generator) -> Bools:
    """Return a mask as a segmentation gives it, (H, W) bool.

    The border is displaced by a wavy offset of 1 to 3 px, narrow gaps between strands are closed, short pieces of the cable are
    lost, and blobs that are no cable are added. An empty mask stays empty.

    Parameters
    ----------
    mask
        (H, W) bool, the true pixels of the cables.
    rng
        the random number generator; the same state gives the same mask.
    """
    mask = np.asarray(mask, dtype=bool)
    if not mask.any():
        return mask
    inside = distance_transform_edt(mask)
    half_width = _half_width(mask, inside)
    outside = distance_transform_edt(~mask)
    noise = gaussian_filter(rng.normal(size=mask.shape), WAVE_PX)
    offset = np.clip(noise / noise.std() * rng.uniform(*OFFSET_PX) / 1.5, -OFFSET_PX[1], OFFSET_PX[1])
    offset = np.maximum(offset, -MAX_INWARD * half_width)
    result = np.where(mask, inside, 1 - outside) > 0.5 - offset
    size = 2 * round(rng.uniform(*CLOSED_GAP_PX) / 2) + 1
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    result = cv2.morphologyEx(result.astype(np.uint8), cv2.MORPH_CLOSE, disk)
    for _ in range(rng.integers(LOST[0], LOST[1] + 1)):
        _draw_blob(result, _any_pixel(mask, rng), 2 * half_width * rng.uniform(*LOST_SIZE), 2.5 * half_width, 0, rng)
    border = mask & (inside <= 1)
    for _ in range(rng.integers(FALSE[0], FALSE[1] + 1)):
        where = border if rng.random() < BESIDE else np.ones_like(mask)
        length = 2 * half_width * rng.uniform(*FALSE_SIZE)
        _draw_blob(result, _any_pixel(where, rng), length, length * rng.uniform(0.5, 1.0), 1, rng)
    return np.asarray(result > 0)


def _half_width(mask: Bools, inside: Floats) -> float:
    """Return half of the typical width of the cables in px: the mean of a cross-section's distances is a quarter of its width."""
    return max(1.0, 2 * float(inside[mask].mean()) - 0.5)


def _any_pixel(where: Bools, rng: Generator) -> tuple[float, float]:
    """Return (x, y) of a random pixel of those that are true."""
    v, u = np.nonzero(where)
    k = int(rng.integers(len(u)))
    return float(u[k]), float(v[k])


def _draw_blob(image: Array, center: tuple[float, float], length: float, width: float, value: int, rng: Generator) -> None:
    """Draw an ellipse of a length and a width in px, in any direction."""
    axes = (max(1, round(length / 2)), max(1, round(width / 2)))
    middle = (round(center[0]), round(center[1]))
    cv2.ellipse(image, middle, axes, float(rng.uniform(0, 180)), 0, 360, value, -1)
