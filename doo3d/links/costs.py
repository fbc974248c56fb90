"""Costs per unit of length, which links and contacts share, and the costs of contacts.

A cost unit is a mm of gap, in an image a px; a radian of a turn costs `merge.direction_weight`. The costs of contacts were set by
hand, and measured together on rendered harnesses with masks, with ragged masks, and as clouds.
"""

from collections.abc import Sequence

from ..config import MergeConfig
from ..scene.scene import Scene
from ..types import Floats


def unit_cost(dim: int) -> float:
    """Return the number of cost units per unit of length: 1000 per m in space, which is 1 per mm, and 1 per px in an image."""
    return 1000.0 if dim == 3 else 1.0


def length_costs(paths: Sequence[Floats], scene: Scene, config: MergeConfig, per_length: float) -> Floats:
    """Return the cost of the length of each path in free space, in unknown space, and over bare surface.

    Parameters
    ----------
    paths
        K >= 1 polylines across gaps, each (P, D) m (px in 2-D).
    scene
        what was captured.
    config
        section `merge` of the settings: the weights of free space and of unknown space. Bare surface costs as much as free space.
    per_length
        cost units per m (px in 2-D).

    Returns
    -------
    (K, 3) cost units.
    """
    return per_length * scene.gap_lengths(paths) * (config.free_space_weight, config.unknown_weight, config.free_space_weight)


MISFIT_COST = 300.0
"""Cost units per sum of both radii by which two axes at a contact are nearer or farther apart than its explanation says: 0 for a
branch, one sum of radii for a crossing."""

MISS_COST = 20.0
"""Cost units per sum of both radii by which the straight continuation of an end misses the axis of a strand. It is small, since
it only chooses the position straight ahead among those that fit the end."""

TIP_COST = 120.0
"""Cost units of leaving an end free: an end is attached to a strand if the attachment costs less."""

BRANCH_COST = 60.0
"""Cost units of two opposite branches where two strands might cross instead."""

GAP_LINK_COST = 250.0
"""Cost units up to which two ends of a cloud are linked across a gap; a link that costs as much has no confidence. Half of
`merge.max_cost`, as an end that stays free costs half of it."""
