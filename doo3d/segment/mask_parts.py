"""Connected parts of a mask, and which of them are long and of constant width, as strands are."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from ..kernels import mask_parts
from ..scene.masked import NO_NUMBERS
from ..scene.surround import median_hues
from ..types import Array, Bools, Floats, Ints

NO_PIXELS: Ints = np.zeros(0, dtype=int)

MIN_LENGTH_PX, MIN_LENGTH_WIDTHS, MIN_PIXELS = 40.0, 12.0, 60
"""Minimum length of a strand, in px and in widths, and its minimum number of pixels."""

MAX_WIDTH_RATIO, WIDTH_SLACK_PX = 1.6, 1.0
"""Maximum half-width of a strand at the 85th percentile: this multiple of the median half-width, plus px for the rounding of
widths to whole pixels. A strand has one width."""


def drawn(pixels: Ints, shape: tuple[int, ...]) -> Bools:
    """Return an image (H, W) bool of the given shape that is True at the given pixels (N,), row-major indices."""
    image = np.zeros(shape, dtype=bool)
    image.ravel()[pixels] = True
    return image


class Parts(NamedTuple):
    """The K connected parts of a mask.

    Attributes
    ----------
    pixels
        (N,) row-major indices of the mask's pixels, part by part.
    starts
        (K + 1,) index in `pixels` at which each part begins, and N.
    widths
        (K, 2) px, median and 85th percentile of the half-widths of each part; 0 for parts of fewer than MIN_PIXELS pixels.
    holds
        (K,) bool, whether the part contains one of the marked pixels; the widths of these parts are 0.
    """

    pixels: Ints
    starts: Ints
    widths: Floats
    holds: Bools

    @staticmethod
    def of(mask: Bools, marked: Ints = NO_PIXELS) -> Parts:
        """Return the 8-connected parts of a mask (H, W) bool; marked : (N,) row-major indices of pixels, for `holds`."""
        return Parts(*mask_parts(mask, MIN_PIXELS, marked))

    @property
    def long(self) -> Bools:
        """The parts, (K,) bool, that are long for their median width."""
        sizes, width = self.sizes, 2 * np.maximum(self.widths[:, 0], 0.5)
        return np.asarray((sizes >= MIN_PIXELS) & (sizes / width > np.maximum(MIN_LENGTH_PX, MIN_LENGTH_WIDTHS * width)))

    @property
    def strands(self) -> Bools:
        """The parts, (K,) bool, that are long and of constant width."""
        half, most = np.maximum(self.widths[:, 0], 0.5), self.widths[:, 1]
        return np.asarray(self.long & (most < MAX_WIDTH_RATIO * half + WIDTH_SLACK_PX))

    @property
    def sizes(self) -> Ints:
        """The number of pixels of each part, (K,)."""
        return np.diff(self.starts)

    def shares(self, mask: Bools) -> Floats:
        """Return the fraction of each part's pixels, (K,), at which another mask (H, W) bool is True."""
        counts = np.add.reduceat(mask.ravel()[self.pixels], self.starts[:-1], dtype=int) if len(self.pixels) else 0
        return np.asarray(counts / self.sizes)

    def pixels_of(self, wanted: Ints) -> Ints:
        """Return the row-major indices of the pixels of the given parts (indices of parts)."""
        return np.concatenate([NO_PIXELS, *[self.pixels[self.starts[part] : self.starts[part + 1]] for part in wanted]])

    def hues(self, wanted: Ints, color: Array) -> Floats:
        """Return the median color axes (N, 2) of 8-bit CIELAB of the given parts in an image (H, W, 3) uint8 RGB."""
        return median_hues(color, self.pixels_of(wanted), self.sizes[wanted])


def long_parts(mask: Bools, length: float, least: Array = NO_NUMBERS) -> Bools:
    """Return the 8-connected parts of a mask (h, w) bool whose bounding boxes have a diagonal of at least `length` px.

    least : (h, w) px, for each part another least length: the largest value in it. Empty if there is none.
    """
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
    box, result = (slice(top, top + height), slice(left, left + width)), np.zeros_like(mask)
    if width:
        parts = Parts.of(np.ascontiguousarray(mask[box]))
        places, first = np.column_stack(np.divmod(parts.pixels, width)), parts.starts[:-1]
        extent = np.hypot(*(1 + np.maximum.reduceat(places, first) - np.minimum.reduceat(places, first)).T)
        lengths = np.maximum(length, np.maximum.reduceat(least[box].ravel()[parts.pixels], first)) if least.size else length
        result[box] = drawn(parts.pixels_of(np.flatnonzero(extent >= lengths)), (height, width))
    return result
