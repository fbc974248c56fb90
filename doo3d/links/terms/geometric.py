"""The terms of Keipour et al. (RA-L 2022): distance, direction and curvature, equations 1 to 3."""

from ...scene.scene import Scene
from ...types import Floats
from ..ends import Ends


def distance(ends: Ends, _: Scene) -> Floats:
    """Return the distance of each pair of ends times `merge.distance_weight`, (E, E) cost units."""
    return ends.config.distance_weight * ends.unit_cost * ends.distance


def direction(ends: Ends, _: Scene) -> Floats:
    """Return the turn half way between each pair of ends times `merge.direction_weight`, (E, E) cost units."""
    return ends.config.angle_weights[0] * ends.pairs[1]


def curvature(ends: Ends, _: Scene) -> Floats:
    """Return the larger bend of each pair of ends times `merge.curvature_weight`, (E, E) cost units.

    The bend of an end is the angle between its tangent half way and the straight line to the other end; 0 for ends that coincide.
    """
    return ends.config.angle_weights[1] * ends.pairs[2]
