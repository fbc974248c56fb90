"""Move the edge of a ragged mask to the edge of the object in the color image."""

import cv2
import numpy as np

from ..geometry.noise import SURFACE_SAMPLES
from ..geometry.polyline import unit
from ..kernels import MaskEdge
from ..scene.appearance import BAND_PX, RING_PX, Appearance
from ..scene.surround import BLUR_PX
from ..types import Array, Bools

ITERATIONS = 3
"""Number of times that the colors are learned: first from the given mask, then from the repaired one."""

MIN_CONTRAST = 2.5
"""Minimum median log-odds of the colors in the mask; below it, the object has the colors of its surroundings."""

MIN_THICKNESS_PX, MIN_ELONGATION = 3.5, 16.0
"""Minimum half-width in px, and minimum area in squares of the half-width, of a part that is kept although it has the colors of
the background: a cable."""

MIN_RAGGEDNESS = 0.25
"""Minimum number of pixels more than one px off, per pixel of the edge, in a ragged mask: true masks have 0.03, ragged ones
0.4."""

MAX_OFF_SHARE = 0.12
"""Maximum fraction of the edge's pixels whose largest color step within BAND_PX is not at the edge, in a mask that is certainly
not ragged."""


def repair_mask(mask: Bools, color: Array, is_by_depth: bool = False) -> Bools:
    """Move the edge of a ragged mask to the edge between colors in the image, and remove the parts with the background's colors.

    The colors in the mask and in a ring around it are compared. A pixel of the mask, or up to 4 px outside of it, belongs to the
    object if its color and those of its neighbors are more frequent in the mask than around it. The colors are then learned again
    from the result. Darker shades of the background belong to the background, since cables cast shadows.

    Parameters
    ----------
    mask
        (H, W) bool.
    color
        (H, W, 3) uint8 RGB.
    is_by_depth
        True for a mask that was made from depth, which is missing at the edges of an object: it is repaired even if it is not
        ragged, unless it is too thin for its colors to be smoothed.

    Returns
    -------
    (H, W) bool; `mask` itself if its edge is already right, or the object has the colors of the background.
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
    """Return the fraction of a mask's edge at which the largest color step across it is at least 2 px off, 0 to 1.

    Every (2 BAND_PX + 1)-th pixel of the edge is examined, except within 2 BAND_PX of the border of the image. The colors are
    sampled along a line of BAND_PX to both sides, in the direction away from the mask's pixels in a window of BAND_PX.

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
    """Return the mean width of the strands of a mask in px: twice its area over the number of its edge pixels."""
    inner = cv2.erode(mask.view(np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
    area, within = int(np.count_nonzero(mask)), int(np.count_nonzero(inner))
    return 2 * area / max(area - within, 1)
