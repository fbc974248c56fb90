"""Tell whether the end of a strand is a tip of its object, or is hidden."""

from __future__ import annotations

import numpy as np

from ..geometry.polyline import unit
from ..geometry.radii import OWN_RADII, STEP_RADII
from ..scene.visibility import OCCLUDER_MARGIN_RADII
from ..types import Floats, Foreground

MIN_STRAND_RADII = 6.0
"""Length of the shortest strand, in radii: a shorter one fits anywhere along its object."""

LOOKAHEAD_RADII = OWN_RADII + STEP_RADII * np.arange(4)
"""Distances beyond an end, 1.5 to 3 radii, at which the mask and the depth are read to tell whether the object ends there."""

MIN_OCCLUDER_MARGIN = 0.005
"""Smallest distance in depth, m, of an occluder in front of a continuation: above the noise of depth on the table."""

TIP, UNKNOWN, CUT_OFF = 1.0, 0.18, 0.0
"""How much it counts if an end of a strand is not at a tip of its object: the end is in plain view; depth is missing around it;
the end is hidden, or the mask continues. The second is -2 ln(0.1) of MISSING_COST: 17 of 228 were no tips."""


def tip_confidence(line: Floats, foreground: Foreground, radius: float) -> float:
    """Return how surely a line (K, 3) m of joints ends at a tip of the object: TIP, UNKNOWN or CUT_OFF.

    foreground : the mask, the depth and the camera of the frame. radius : of the object, m.
    """
    end = line[-2:]
    direction = unit(end[-1] - line[max(0, len(line) - 4)])
    ahead = end[-1] + radius * LOOKAHEAD_RADII[:, None] * direction
    to_side = unit(direction[[1, 2, 0]] * end[-1, [2, 0, 1]] - direction[[2, 0, 1]] * end[-1, [1, 2, 0]])  # across the ray
    aside = MIN_STRAND_RADII * radius * to_side
    return _in_view(ahead, np.concatenate((end - aside, end + aside)), foreground, radius)


def _in_view(ahead: Floats, beside: Floats, foreground: Foreground, radius: float) -> float:
    """Return how surely positions (K, 3) m beyond an end are empty, given some (N, 3) m beside it, MIN_STRAND_RADII away.

    What is nearer than the end hides the object. The depth of a thin end may be wrong by as much as the background is behind
    it: so what stands out before that as the end does may hide it, too.
    """
    if foreground.camera is None or foreground.depth is None or foreground.mask is None:
        return UNKNOWN
    count, (height, width) = len(ahead), foreground.mask.shape
    pixels = np.rint(foreground.camera.project(np.concatenate((ahead, beside)))).astype(np.int64)
    inside = np.asarray(((pixels >= 0) & (pixels < (width, height))).all(axis=1))
    if not inside[:count].all():
        return CUT_OFF
    u, v = pixels[inside].T
    reading, masked = foreground.depth[v, u], foreground.mask[v, u]
    is_known = (reading > 0) & ~masked  # the object's own surface hides nothing
    around = reading[count:][is_known[count:]]
    behind = float(np.sort(around)[(len(around) - 1) // 2]) if len(around) else 0.0
    before_end, before_background = ahead[:, 2] - occluder_margin(radius), behind - MIN_STRAND_RADII * radius
    nearest = np.maximum(before_end, np.minimum(before_background, (ahead[:, 2] + behind) / 2))
    if (is_known[:count] & (reading[:count] < nearest)).any() or masked[1:count].all():
        return CUT_OFF
    return TIP if is_known[:count].any() else UNKNOWN


def occluder_margin(radius: float) -> float:
    """Return how much nearer to the camera than a part of an object, m, something must be to hide it.

    radius : of the object, m; NaN if unknown.
    """
    return float(np.fmax(OCCLUDER_MARGIN_RADII * radius, MIN_OCCLUDER_MARGIN))
