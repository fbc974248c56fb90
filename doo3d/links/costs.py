"""Costs per unit of length, which links and contacts share. Cost units are mm of gap, in an image px."""

from __future__ import annotations

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
