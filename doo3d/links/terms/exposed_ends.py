"""Ends in plain view, which are probably real tips."""

import numpy as np

from ...scene.scene import Scene
from ...types import Floats
from ..ends import Ends

EXPOSED_END_LOOKAHEAD = 2.0
"""Radii beyond an end within which an occluder is looked for."""


def exposed_ends(ends: Ends, scene: Scene) -> Floats | None:
    """Return the number of ends in plain view of each pair times `merge.exposed_end_cost`, (E, E) cost units.

    None where that costs nothing, and for a cloud without camera views.
    """
    if not scene.sees_space or not ends.config.exposed_end_cost:
        return None
    lookahead = EXPOSED_END_LOOKAHEAD * ends.radius
    exposed = scene.is_exposed(ends.points, ends.tangents, ends.radius, lookahead)
    return np.asarray(ends.config.exposed_end_cost * (exposed[:, None].astype(float) + exposed[None]))
