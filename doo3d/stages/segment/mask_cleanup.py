"""Remove small components, small holes and wide regions from a mask."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from ...config import SegmentConfig
from ...facts.frame_facts import FrameFacts
from ...geometry.mask import ridge_radius
from ...types import Array, Bools

WIDE_REGION_MARGIN = 1.5
"""Multiple of the largest half-width; pixels nearer than this to the core of a wide region belong to the region."""


class CleanedMask(NamedTuple):
    """The facts of a cleaned mask, and the number of pixels that each step changed.

    Attributes
    ----------
    facts
        the mask after all steps, and what follows from it.
    selected
        number of pixels in the mask before the first step.
    removed_small
        pixels removed as small connected components.
    closed_holes
        pixels added as small holes.
    removed_wide
        pixels removed as wide regions.
    """

    facts: FrameFacts
    selected: int
    removed_small: int
    closed_holes: int
    removed_wide: int


def clean_mask(
    mask: Bools,
    config: SegmentConfig,
    may_have_wide: bool,
    depth: Array | None = None,
    focal: float = 1.0,
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
    The facts of the cleaned mask, and the number of pixels that each step changed.
    """
    solid = FrameFacts(mask, depth, config.min_component)
    kept = remove_wide_regions(solid, config, focal) if may_have_wide and solid.count else solid
    return CleanedMask(kept, solid.selected, solid.removed, solid.filled, solid.count - kept.count)


def remove_wide_regions(facts: FrameFacts, config: SegmentConfig, focal: float = 1.0) -> FrameFacts:
    """Return the facts of a mask without regions that are wide in every direction, such as a gripper.

    A region is wide if its width exceeds `config.max_width`, or `config.max_width_ratio` times the median width of the mask.

    Parameters
    ----------
    facts
        the mask, not empty, with the depth; without depth widths are measured in pixels.
    config
        section `segment` of the settings.
    focal
        focal length in px.

    Returns
    -------
    The facts of the mask that is left; `facts` itself if nothing is wide.
    """
    box = facts.slices
    part = facts.mask[box]
    scale = np.ones(part.shape) if facts.depth is None else facts.depth[box] / focal
    distance = cv2.distanceTransform(np.pad(part, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
    usual = ridge_radius(distance, scale)
    limit = min(config.max_width / 2, config.max_width_ratio * usual) if usual else config.max_width / 2
    core = distance * scale > limit
    if not core.any():
        return facts
    pixel = float(np.median(scale[core]))
    margin = WIDE_REGION_MARGIN * limit / pixel
    result = np.zeros_like(facts.mask)
    result[box] = part & (cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3) > margin)
    return FrameFacts(result, facts.depth)
