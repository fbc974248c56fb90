"""Add segmentation errors to a true mask: wavy borders, lost pieces, false blobs, closed gaps."""

import cv2
import numpy as np
from numpy.random import Generator
from scipy.ndimage import distance_transform_edt, gaussian_filter

from ...types import Array, Bools, Floats

OFFSET_PX = (1.0, 3.0)
"""Least and greatest amplitude of the border's offset in px; each frame has a random value."""

WAVE_PX = 9.0
"""Sigma in px of the blurred noise that displaces the border, in waves of some 40 px."""

MAX_INWARD = 0.55
"""Greatest inward shift of the border, in half widths of the cable, so that the shift alone does not cut it; pieces are lost by
LOST."""

CLOSED_GAP_PX = (2.0, 6.0)
"""Least and greatest width in px up to which gaps between strands are closed."""

LOST, FALSE = (1, 4), (2, 6)
"""Least and greatest number of lost pieces of cable, and of false blobs."""

LOST_SIZE, FALSE_SIZE = (0.6, 2.5), (0.8, 3.0)
"""Least and greatest length of a lost piece and of a false blob, in widths of the cable."""

BESIDE = 0.5
"""Probability that a false blob touches the cable's border; the others are anywhere in the image."""


def ragged_mask(mask: Bools, rng: Generator) -> Bools:
    """Return a mask with the errors of a segmentation, (H, W) bool.

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
    """Return half of the typical width of the cables in px, from the mean distance to the edge.

    Across a strand, the mean distance to the edge is a quarter of the width.
    """
    return max(1.0, 2 * float(inside[mask].mean()) - 0.5)


def _any_pixel(where: Bools, rng: Generator) -> tuple[float, float]:
    """Return (x, y) of a random true pixel, px."""
    v, u = np.nonzero(where)
    k = int(rng.integers(len(u)))
    return float(u[k]), float(v[k])


def _draw_blob(image: Array, center: tuple[float, float], length: float, width: float, value: int, rng: Generator) -> None:
    """Draw a filled ellipse of a given length and width in px, with random direction."""
    axes = (max(1, round(length / 2)), max(1, round(width / 2)))
    middle = (round(center[0]), round(center[1]))
    cv2.ellipse(image, middle, axes, float(rng.uniform(0, 180)), 0, 360, value, -1)
