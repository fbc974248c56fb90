"""Remove wide regions, such as a gripper, from a mask."""

from __future__ import annotations

import cv2
import numpy as np

from ..config import SegmentConfig
from ..geometry.mask import ridge_radius
from ..scene.frame_facts import FrameFacts

WIDE_REGION_MARGIN = 1.5
"""Distance from the core of a wide region within which pixels belong to the region, in maximum half-widths of a strand."""


def remove_wide_regions(facts: FrameFacts, config: SegmentConfig, focal: float = 1.0) -> FrameFacts:
    """Return the facts of a mask without regions that are wide in every direction, such as a gripper.

    A region is wide if its width exceeds `config.max_width`, or `config.max_width_ratio` times the median width of the mask.

    Parameters
    ----------
    facts
        the mask, with the depth; without depth, widths are in px.
    config
        section `segment` of the settings.
    focal
        focal length in px.

    Returns
    -------
    The facts of the remaining mask; `facts` itself if no region is wide.
    """
    if not facts.count:
        return facts
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
