"""What it costs to join two chain ends: the paper's equations 1 to 3, each for all pairs of E ends at once.

points : (E, D) m (px in 2-D), the ends. directions : (E, D) unit, pointing out of the chains; or (E, E, D), what that of
end i is expected to be on its way to end j. All return (E, E).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import ConfigError
from ...geometry.polyline import angle
from ...types import Bools, Floats

CustomCost = Callable[[Floats, Floats], Floats]

CUSTOM_COSTS: dict[str, CustomCost] = {}
"""Cost terms of the user: from the ends' points (E, D) and directions (E, D) to (E, E). Weights are in `merge.custom_costs`."""


FORCED_COST_FACTOR = 3.0
"""Multiple of `max_cost` that a connection may cost where fewer chains are wanted than are left otherwise."""


def custom_cost(name: str) -> CustomCost:
    """Return the cost term of that name in CUSTOM_COSTS.

    Raises
    ------
    ConfigError : there is none.
    """
    if name not in CUSTOM_COSTS:
        raise ConfigError(
            f"merge.custom_costs: there is no cost {name!r}; "
            f"doo3d.stages.merge.costs.CUSTOM_COSTS holds {', '.join(CUSTOM_COSTS) or 'none'}: register it there first",
            code="cost-unknown",
        )
    return CUSTOM_COSTS[name]


def _pairwise(directions: Floats) -> Floats:
    if directions.ndim == 3:
        return directions
    return np.broadcast_to(directions[:, None], (len(directions), *directions.shape))


def euclidean(points: Floats) -> Floats:
    """Distance between the ends, m (px in 2-D): equation 1."""
    return np.asarray(np.linalg.norm(points[None] - points[:, None], axis=-1))


def direction(directions: Floats) -> Floats:
    """Angle between one end's direction and the opposite of the other's, radians: equation 2."""
    towards = _pairwise(directions)
    return angle(towards, -towards.swapaxes(0, 1))


def curvature(points: Floats, directions: Floats) -> Floats:
    """The larger of the angles by which either end must bend towards the other, radians: equation 3.

    Zero for ends that coincide, which need no bend.
    """
    way = points[None] - points[:, None]
    bend = angle(_pairwise(directions), way)
    bend[np.linalg.norm(way, axis=-1) < 1e-12] = 0
    return np.asarray(np.maximum(bend, bend.T))


def count_in(ends: Bools) -> Floats:
    """Return how many ends of each pair are marked in `ends`, (E,) bool: 0, 1 or 2."""
    return ends[:, None].astype(float) + ends[None]
