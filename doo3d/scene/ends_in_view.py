"""What the depth image says of the ends of chains: whether they are in plain view, and whether they are tips."""

from dataclasses import replace

import numpy as np

from ..geometry.polyline import unit
from ..geometry.radii import STEP_RADII
from ..types import Bools, Floats
from .depth_model import DepthModel
from .point_visibility import PointVisibility

TIP_LOOKAHEAD_RADII = np.array([3.0, 4.0, 5.0])
"""Radii ahead of an end at which a tip is recognized: a chain may stop two radii before the tip, where thinning ends."""

TIP_FAN = np.radians(25.0) * np.array((-1, 0, 1))
"""Directions in the image, from straight on, in which the mask ends at a tip: the tangent of an end is that uncertain."""

OCCLUDER_MARGIN_RADII = 0.6
"""Radii by which an occluder is nearer at least. A strand on top of another one is nearer by two, at its border by one."""


def are_exposed(model: DepthModel, ends: Floats, directions: Floats, radius: float, reach: float) -> Bools:
    """Return which chain ends are in plain view, so that nothing can hide a continuation.

    Unlike `tip_log_odds` this does not ask whether the mask goes on: an end in plain view may lie on the object.

    An end is exposed if, on its straight continuation, a position in free space comes before any position that an occluder
    hides.

    Parameters
    ----------
    model
        what the depth image says of positions.
    ends
        (E, D) m in the camera's optical frame, positions of E ends.
    directions
        (E, D) unit vectors, pointing out of the chains.
    radius
        radius of the object, m. An occluder is at least OCCLUDER_MARGIN_RADII (0.6) radii nearer to the camera than the
        position.
    reach
        m, how far ahead of the end to look.

    Returns
    -------
    (E,) bool
    """
    step = STEP_RADII / 2 * radius
    ahead = ends[:, None] + np.arange(step, reach * (1 + 1e-9), step)[:, None] * directions[:, None]
    points = ahead.reshape(-1, ends.shape[1])
    free = replace(model, own_object_counts_as_free=True).classify(points) == PointVisibility.FREE
    hidden = replace(model, margin=OCCLUDER_MARGIN_RADII * radius).classify(points) == PointVisibility.HIDDEN
    free, hidden = free.reshape(ahead.shape[:2]), hidden.reshape(ahead.shape[:2])
    first_free = np.where(free.any(axis=1), free.argmax(axis=1), ahead.shape[1])
    return np.asarray(first_free < np.where(hidden.any(axis=1), hidden.argmax(axis=1), ahead.shape[1]))


def tip_log_odds(model: DepthModel, ends: Floats, directions: Floats, radius: float) -> Floats:
    """Return the log-odds that ends are tips in plain view: the mask does not go on ahead, and space there is open.

    Where the mask goes on, the object does too, and only its depth is lost. Ahead, the median over TIP_LOOKAHEAD_RADII counts
    of the log-odds that a position is free or bare; nothing is known to be beyond the border of the image.

    Parameters
    ----------
    model
        what the depth image says of positions.
    ends
        (E, 3) m in the camera's optical frame, positions of E ends.
    directions
        (E, 3) unit vectors, pointing out of the chains.
    radius
        radius of the object, m.

    Returns
    -------
    (E,) nat, above 0 for a tip in plain view; minus infinity where the mask goes on.
    """
    ahead = ends[:, None] + radius * TIP_LOOKAHEAD_RADII[:, None] * directions[:, None]
    state = model.log_odds(ahead.reshape(-1, 3))
    is_open = np.median(np.maximum(state.free, state.bare).reshape(ahead.shape[:2]), axis=1)
    at = model.camera.project(ends)
    forward = unit(model.camera.project(ends + radius * directions) - at)
    turned = np.cos(TIP_FAN)[:, None, None] * forward + np.sin(TIP_FAN)[:, None, None] * forward[:, ::-1] * (-1, 1)
    reach = (model.camera.fx * radius / ends[:, 2])[:, None, None] * TIP_LOOKAHEAD_RADII[:, None]
    height, width = model.facts.mask.shape
    u, v = np.rint(at[:, None] + reach * turned[:, :, None]).astype(np.int64).clip(0, (width - 1, height - 1)).T
    return np.where(model.facts.mask[v, u].any(axis=(0, 2)), -np.inf, is_open)
