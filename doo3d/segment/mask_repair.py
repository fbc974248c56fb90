"""Move the edge of a ragged mask to where the colors of the image say that it is."""

from __future__ import annotations

import cv2
import numpy as np

from ..geometry.noise import SURFACE_SAMPLES
from ..geometry.polyline import unit
from ..kernels import MaskEdge
from ..scene.appearance import BAND_PX, RING_PX, Appearance
from ..scene.surround import BLUR_PX
from ..types import Array, Bools

ITERATIONS = 3
"""Times the colors are learned: the first time from the mask as given, then from what was found."""

MIN_CONTRAST = 2.5
"""Median log ratio in the mask from which on the colors tell the object from what is around it."""

MIN_THICKNESS_PX, MIN_ELONGATION = 3.5, 16.0
"""Half-width in px, and area in its squares, of a part that is not dropped: a cable in the colors of the background."""

MIN_RAGGEDNESS = 0.25
"""Pixels more than one px off, per pixel of the mask's edge, that make a mask ragged; true masks have 0.03, ragged ones 0.4."""

MAX_OFF_SHARE = 0.12
"""Share of the edge's pixels whose largest step within BAND_PX is not at the edge, up to which a mask surely is not ragged."""


def repair_mask(mask: Bools, color: Array, is_by_depth: bool = False) -> Bools:
    """Move the edge of a ragged mask to where the colors of the image change, and drop the parts that show the background.

    The colors in the mask and in a ring around it are compared. A pixel up to 4 px outside the mask, or in it, belongs to the
    object if its color and those of its neighbors are more frequent in the mask than around it. The colors are then learned again
    from what was found. Darker shades of the background count as background, since cables cast shadows.

    Parameters
    ----------
    mask
        (H, W) bool.
    color
        (H, W, 3) uint8 RGB.
    is_by_depth
        whether the mask was made from depth, which is lost at the edges of an object: it is repaired however little its edge is
        off, unless it is too thin for colors to be smoothed in it.

    Returns
    -------
    (H, W) bool; `mask` itself if its edge already is where the colors change, or the colors do not tell the object from the
    background.
    """
    stays = _width(mask) < 4 * BLUR_PX if is_by_depth else off_edge_share(mask, color) <= MAX_OFF_SHARE
    if stays:
        return mask
    edge = MaskEdge(mask, BAND_PX, RING_PX)
    kernel = cv2.getGaussianKernel(2 * int(4 * BLUR_PX) + 1, BLUR_PX, cv2.CV_32F).ravel()
    for _ in range(ITERATIONS):
        appearance = Appearance(color, edge.inside(), edge.around(SURFACE_SAMPLES))
        if appearance.separation < MIN_CONTRAST:
            return mask
        edge.move(color, appearance.log_odds, kernel)
    edge.restore_parts(MIN_THICKNESS_PX, MIN_ELONGATION)
    return edge.mask() if is_by_depth or edge.raggedness() >= MIN_RAGGEDNESS else mask


def off_edge_share(mask: Bools, color: Array) -> float:
    """Return the share of a mask's edge at which the largest step of color across it is 2 px or more off; 0 to 1.

    Of the edge every (2 BAND_PX + 1)-th pixel is looked at that is 2 BAND_PX from the border of the image: nearer ones have the
    same colors across. The line across leads away from the mask's pixels in a window of BAND_PX, and ends there.

    mask : (H, W) bool. color : (H, W, 3) uint8 RGB.
    """
    reach, size = BAND_PX, np.array(mask.shape)
    inner = cv2.erode(mask.view(np.uint8), np.ones((3, 3), np.uint8)).view(bool)
    edge = np.column_stack(np.divmod(np.flatnonzero(mask & ~inner)[:: 2 * reach + 1], size[1]))
    edge = edge[((edge >= 2 * reach) & (edge < size - 2 * reach)).all(axis=1)]
    along = np.arange(-reach, reach + 1)
    window = mask[edge[:, 0, None, None] + along[:, None], edge[:, 1, None, None] + along]
    outwards = unit(-np.column_stack((window.sum(axis=2) @ along, window.sum(axis=1) @ along)))
    has_side = outwards.any(axis=1)
    across = np.rint(edge[has_side, None] + along[:, None] * outwards[has_side, None]).astype(int)
    steps = np.abs(np.diff(color[across[..., 0], across[..., 1]].astype(int), axis=1)).sum(axis=2)
    return float(np.mean(np.abs(steps.argmax(axis=1) - reach) > 1)) if len(steps) else 0.0


def _width(mask: Bools) -> float:
    """Return how wide the strands of a mask are, px: the area between two edges by the pixels along them."""
    inner = cv2.erode(mask.view(np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
    area, within = int(np.count_nonzero(mask)), int(np.count_nonzero(inner))
    return 2 * area / max(area - within, 1)
