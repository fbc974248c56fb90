"""The connected parts of a mask, and which of them are long and of one width, as strands are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels import mask_parts
from ..scene.surround import median_hues
from ..types import Array, Bools, Floats, Ints

MIN_LENGTH_PX, MIN_LENGTH_WIDTHS, MIN_PIXELS = 40.0, 12.0, 60
"""Length of a strand at least, in px and in widths, and its pixels."""

MAX_WIDTH_RATIO, WIDTH_SLACK_PX = 1.6, 1.0
"""Ratio of the half-widths at the 85th percentile and in the median at most, besides what pixels add: a strand has one width."""


def drawn(pixels: Ints, shape: tuple[int, ...]) -> Bools:
    """Return an image (H, W) bool of the given shape that is True at some pixels (N,), row-major indices."""
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
        (K + 1,) where each part begins in `pixels`.
    widths
        (K, 2) px, the half-widths in the median and at the 85th percentile of parts of at least MIN_PIXELS.
    holds
        (K,) bool, the parts with pixels that were asked for, whose widths are 0.
    """

    pixels: Ints
    starts: Ints
    widths: Floats
    holds: Bools

    @staticmethod
    def of(mask: Bools, asked: Ints) -> Parts:
        """Return the 8-connected parts of a mask (H, W) bool; asked : row-major indices of the pixels that are asked for."""
        return Parts(*mask_parts(mask, MIN_PIXELS, asked))

    @property
    def long(self) -> Bools:
        """The parts, (K,) bool, that are long for their usual width."""
        width = 2 * np.maximum(self.widths[:, 0], 0.5)
        long = self.sizes / width > np.maximum(MIN_LENGTH_PX, MIN_LENGTH_WIDTHS * width)
        return np.asarray((self.sizes >= MIN_PIXELS) & long)

    @property
    def strands(self) -> Bools:
        """The parts, (K,) bool, that are long and of one width."""
        half, most = np.maximum(self.widths[:, 0], 0.5), self.widths[:, 1]
        return np.asarray(self.long & (most < MAX_WIDTH_RATIO * half + WIDTH_SLACK_PX))

    @property
    def sizes(self) -> Ints:
        """The number of pixels of each part, (K,)."""
        return np.diff(self.starts)

    def shares(self, mask: Bools) -> Floats:
        """Return the share of each part's pixels, (K,), at which another mask (H, W) bool is True."""
        counts = np.add.reduceat(mask.ravel()[self.pixels], self.starts[:-1], dtype=int) if len(self.pixels) else 0
        return np.asarray(counts / self.sizes)

    def pixels_of(self, wanted: Ints) -> Ints:
        """Return the row-major indices of the pixels of some parts, given by number."""
        chosen = [self.pixels[self.starts[part] : self.starts[part + 1]] for part in wanted]
        return np.concatenate(chosen) if chosen else np.zeros(0, dtype=int)

    def hues(self, wanted: Ints, color: Array) -> Floats:
        """Return the median color axes (N, 2) of 8-bit CIELAB, in an image (H, W, 3) uint8 RGB, of some parts given by number."""
        return median_hues(color, self.pixels_of(wanted), self.sizes[wanted])
