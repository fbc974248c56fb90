"""Classify the end of a strand: tip of the object, hidden, or unknown."""

import numpy as np

from ..geometry.polyline import unit
from ..geometry.radii import OWN_RADII, STEP_RADII
from ..scene.ends_in_view import OCCLUDER_MARGIN_RADII
from ..scene.frame import FrameScene
from ..scene.scene import Scene
from ..types import Floats

MIN_STRAND_RADII = 6.0
"""Length of the shortest strand, in radii: a shorter one fits anywhere along its object."""

LOOKAHEAD_RADII = OWN_RADII + STEP_RADII * np.arange(4)
"""Distances beyond an end, 1.5 to 3 radii, at which the mask and the depth are read."""

MIN_OCCLUDER_MARGIN = 0.005
"""Smallest distance in depth, m, of an occluder in front of a continuation of the strand: above the noise of depth on a table."""

TIP, UNKNOWN, CUT_OFF = 1.0, 0.18, 0.0
"""Weight of placing an end of a strand away from a tip of its object, for three kinds of ends: the end is in plain view; depth
around it is missing; it is hidden, or the mask continues. The second is -2 ln(0.1) of MISSING_COST: 17 of 228 such ends
were no tips."""


def tip_confidence(line: Floats, scene: Scene, radius: float) -> float:
    """Return the kind of the end of a line (K, 3) m: TIP, UNKNOWN or CUT_OFF.

    scene : what was captured. radius : of the object, m.
    """
    end = line[-2:]
    direction = unit(end[-1] - line[max(0, len(line) - 4)])
    ahead = end[-1] + radius * LOOKAHEAD_RADII[:, None] * direction
    to_side = unit(direction[[1, 2, 0]] * end[-1, [2, 0, 1]] - direction[[2, 0, 1]] * end[-1, [1, 2, 0]])  # across the ray
    aside = MIN_STRAND_RADII * radius * to_side
    return _in_view(ahead, np.concatenate((end - aside, end + aside)), scene, radius)


def _in_view(ahead: Floats, beside: Floats, scene: Scene, radius: float) -> float:
    """Return the kind of an end from the depth at positions beyond it.

    Anything nearer than the end hides the object. The depth of a thin end may be wrong by as much as its distance to the
    background: so an object that stands out from the background like the end may hide it, too.

    Parameters
    ----------
    ahead
        (K, 3) m, positions beyond the end.
    beside
        (N, 3) m, positions next to the end, MIN_STRAND_RADII away, for the depth of the background.
    scene
        what was captured.
    radius
        m, of the object.
    """
    if not isinstance(scene, FrameScene):
        return UNKNOWN
    count, (height, width) = len(ahead), scene.mask.shape
    pixels = np.rint(scene.camera.project(np.concatenate((ahead, beside)))).astype(np.int64)
    inside = np.asarray(((pixels >= 0) & (pixels < (width, height))).all(axis=1))
    if not inside[:count].all():
        return CUT_OFF
    u, v = pixels[inside].T
    reading, masked = scene.depth[v, u], scene.mask[v, u]
    is_known = (reading > 0) & ~masked  # the object does not hide itself
    around = reading[count:][is_known[count:]]
    behind = float(np.sort(around)[(len(around) - 1) // 2]) if len(around) else 0.0
    before_end, before_background = ahead[:, 2] - occluder_margin(radius), behind - MIN_STRAND_RADII * radius
    nearest = np.maximum(before_end, np.minimum(before_background, (ahead[:, 2] + behind) / 2))
    if (is_known[:count] & (reading[:count] < nearest)).any() or masked[1:count].all():
        return CUT_OFF
    return TIP if is_known[:count].any() else UNKNOWN


def occluder_margin(radius: float) -> float:
    """Return the smallest distance of an occluder in front of the object, m.

    radius : of the object, m; NaN if unknown.
    """
    return float(np.fmax(OCCLUDER_MARGIN_RADII * radius, MIN_OCCLUDER_MARGIN))
