"""Small pieces, small holes and wide regions out of a mask."""

from __future__ import annotations

import cv2
import numpy as np

from ...config import SegmentConfig
from ...geometry.mask import bounding_box, ridge_radius
from ...types import Array, Bools


def drop_wide(mask: Bools, scale: Array, config: SegmentConfig) -> Bools:
    """The mask (H, W) without what is wider on all sides than `max_width`, or than `max_ratio` times the usual width.

    scale : (H, W) m per pixel (1 in 2-D), 0 = unknown. The usual width is the median over the middle lines of the mask.
    """
    box = bounding_box(mask)
    part, scale = mask[box], scale[box]
    inside = cv2.distanceTransform(np.pad(part, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1]
    usual = ridge_radius(inside, scale)
    limit = min(config.max_width / 2, config.max_width_ratio * usual) if usual else config.max_width / 2
    core = inside * scale > limit
    if not core.any():
        return mask
    reach = 1.5 * limit / float(np.median(scale[core]))
    result = np.zeros_like(mask)
    result[box] = part & (cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3) > reach)
    return result


def tidy(mask: Bools, least: int) -> Bools:
    """The mask (H, W) without 8-connected pieces, and without 4-connected holes, of fewer than `least` pixels.

    Their borders tell their size: a polygon through the centres of b pixels with the area a covers a + b / 2 + 1 pixels, and
    leaves a - b / 2 + 1 free inside it (Pick's theorem).
    """
    if least <= 1 or not mask.any():
        return mask
    box = bounding_box(mask)
    borders, tree = cv2.findContours(mask[box].view(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    small = []
    for border, (_, _, _, outer) in zip(borders, tree[0], strict=True):
        if len(border) > 4 * least:
            continue
        free = 1 if outer < 0 else -1
        if cv2.contourArea(border) + free * len(border) / 2 + 1 < least:
            small.append((border, int(outer >= 0)))
    if not small:
        return mask
    result = mask.copy()
    image = result.view(np.uint8)[box]
    for border, value in small:
        cv2.drawContours(image, [border], 0, value, cv2.FILLED)
    return result
