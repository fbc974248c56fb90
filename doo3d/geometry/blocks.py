"""Points in blocks, one after the other as they come, whose bounding boxes tell quickly which of them lie near a place."""

from __future__ import annotations

import numpy as np

from ..types import Floats, Ints

BLOCK = 64
"""Points of a block: those of a row of pixels, or along a path, lie close together; the boxes are then 1/64 of the work."""


class Blocks:
    """Points in blocks of BLOCK.

    Attributes
    ----------
    points
        (N, D), N >= 1.
    """

    def __init__(self, points: Floats) -> None:
        self.points = points
        starts = np.arange(0, len(points), BLOCK)
        self._low, self._high = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)

    def within(self, low: Floats, high: Floats) -> Ints:
        """Return the rows, ascending, of all points in a box from low (D,) to high (D,), and of some outside it."""
        blocks = np.flatnonzero(((self._high >= low) & (self._low <= high)).all(axis=1))
        rows = (BLOCK * blocks[:, None] + np.arange(BLOCK)).ravel()
        return rows[rows < len(self.points)]
