"""Find the part of a photograph without cables: the largest rectangle without a labelled pixel."""

import cv2
import numpy as np

from ...geometry.curves import runs
from ...types import Bools

CELL_PX = 4
"""Edge in px of the cells that the rectangle consists of."""


def free_rectangle(mask: Bools, min_size: tuple[int, int] = (320, 240), margin: int = 15) -> tuple[slice, slice] | None:
    """Return the largest rectangle of an image that has no pixel of the mask in it or near it.

    Parameters
    ----------
    mask
        (H, W) bool, the pixels of all cables.
    min_size
        least (width, height) of the rectangle, px.
    margin
        distance in px between the rectangle and the mask.

    Returns
    -------
    Rows and columns of the rectangle, for indexing; None if none is large enough.
    """
    size = 2 * margin + 1
    near = cv2.dilate(np.asarray(mask).astype(np.uint8), np.ones((size, size), np.uint8))
    rows, columns = near.shape[0] // CELL_PX, near.shape[1] // CELL_PX
    cells = near[: rows * CELL_PX, : columns * CELL_PX].reshape(rows, CELL_PX, columns, CELL_PX)
    free = ~cells.any(axis=(1, 3))
    best: tuple[int, tuple[slice, slice]] | None = None
    height = np.zeros(columns, dtype=int)
    for row in range(rows):
        height = np.where(free[row], height + 1, 0)
        for tall in np.unique(height[height * CELL_PX >= min_size[1]]):
            for left, right in runs(height >= tall):
                area = int(tall) * (right - left)
                if (right - left) * CELL_PX >= min_size[0] and (best is None or area > best[0]):
                    last = (row + 1) * CELL_PX
                    best = area, (slice(last - int(tall) * CELL_PX, last), slice(left * CELL_PX, right * CELL_PX))
    return None if best is None else best[1]
