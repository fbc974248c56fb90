"""Ends in plain view, which are probably real tips."""

from __future__ import annotations

import numpy as np

from ...scene.scene import Scene
from ...types import Floats
from ..candidates import Candidates

EXPOSED_END_LOOKAHEAD = 2.0
"""Radii beyond an end within which an occluder is looked for."""


def exposed_ends(candidates: Candidates, scene: Scene) -> Floats | None:
    """Return the number of ends in plain view of each pair times `merge.exposed_end_cost`, (E, E) cost units.

    None where that costs nothing, and for a cloud without camera views.
    """
    if not scene.sees_space or not candidates.config.exposed_end_cost:
        return None
    lookahead = EXPOSED_END_LOOKAHEAD * candidates.radius
    exposed = scene.is_exposed(candidates.points, candidates.tangents, candidates.radius, lookahead)
    return np.asarray(candidates.config.exposed_end_cost * (exposed[:, None].astype(float) + exposed[None]))
