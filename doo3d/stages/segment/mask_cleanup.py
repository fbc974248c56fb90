"""Remove small components, small holes and wide regions from a mask."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from ...config import SegmentConfig
from ...geometry.mask import bounding_box, ridge_radius
from ...kernels import without_small_regions
from ...types import Array, Bools

WIDE_REGION_MARGIN = 1.5
"""Multiple of the largest half-width; pixels nearer than this to the core of a wide region belong to the region."""


class CleanedMask(NamedTuple):
    """A cleaned mask, and the number of pixels that each step changed.

    Attributes
    ----------
    mask
        (H, W) bool, after all steps.
    selected
        number of pixels in the mask before the first step.
    removed_small
        pixels removed as small connected components.
    closed_holes
        pixels added as small holes.
    removed_wide
        pixels removed as wide regions.
    """

    mask: Bools
    selected: int
    removed_small: int
    closed_holes: int
    removed_wide: int


def clean_mask(
    mask: Bools, config: SegmentConfig, may_have_wide: bool, depth: Array | None = None, focal: float = 1.0
) -> CleanedMask:
    """Remove small components and wide regions from a mask, and close its small holes.

    Parameters
    ----------
    mask
        (H, W) bool.
    config
        section `segment` of the settings: `min_component`, `max_width`, `max_width_ratio`.
    may_have_wide
        whether to remove wide regions; a mask that the caller gives has none.
    depth
        (H, W) m, 0 = unknown; None measures widths in pixels.
    focal
        focal length in px.

    Returns
    -------
    The cleaned mask, and the number of pixels that each step changed.
    """
    solid, selected, removed, filled = without_small_regions(mask, config.min_component)
    left = selected - removed + filled
    kept = remove_wide_regions(solid, config, depth, focal) if may_have_wide and left else solid
    wide = 0 if kept is solid else left - int(np.count_nonzero(kept))
    return CleanedMask(kept, selected, removed, filled, wide)


def remove_wide_regions(mask: Bools, config: SegmentConfig, depth: Array | None = None, focal: float = 1.0) -> Bools:
    """Return the mask without regions that are wide in every direction, such as a gripper.

    A region is wide if its width exceeds `config.max_width`, or `config.max_width_ratio` times the median width of the mask.

    Parameters
    ----------
    mask
        (H, W) bool, not empty.
    config
        section `segment` of the settings.
    depth
        (H, W) m, 0 = unknown; None measures widths in pixels.
    focal
        focal length in px.

    Returns
    -------
    (H, W) bool; `mask` itself if nothing is wide.
    """
    box = bounding_box(mask)
    part = mask[box]
    scale = np.ones(part.shape) if depth is None else depth[box] / focal
    distance = cv2.distanceTransform(np.pad(part, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
    usual = ridge_radius(distance, scale)
    limit = min(config.max_width / 2, config.max_width_ratio * usual) if usual else config.max_width / 2
    core = distance * scale > limit
    if not core.any():
        return mask
    margin = WIDE_REGION_MARGIN * limit / float(np.median(scale[core]))
    result = np.zeros_like(mask)
    result[box] = part & (cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3) > margin)
    return result
