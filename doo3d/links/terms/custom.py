"""The costs of the user, from functions of the ends' points (E, D) and tangents (E, D) to (E, E)."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ...config import MergeConfig
from ...errors import ConfigError
from ...plugins import CUSTOM_COSTS
from ...scene.scene import Scene
from ...types import Floats
from ..ends import Ends


def custom_terms(config: MergeConfig) -> dict[str, Callable[[Ends, Scene], Floats]]:
    """Return the terms that `merge.custom_costs` names, each with its weight.

    Raises
    ------
    ConfigError : no cost of that name is registered.
    """
    for name in config.custom_costs:
        if name not in CUSTOM_COSTS:
            raise ConfigError(
                f"merge.custom_costs: there is no cost {name!r}; doo3d.plugins.CUSTOM_COSTS holds "
                f"{', '.join(CUSTOM_COSTS) or 'none'}: register it there first, or install its plug-in",
                code="cost-unknown",
            )
    return {name: partial(_custom_term, name, weight) for name, weight in config.custom_costs.items()}


def _custom_term(name: str, weight: float, ends: Ends, _: Scene) -> Floats:
    """Return a custom cost of each pair of ends times its weight, (E, E) cost units."""
    return np.asarray(weight * CUSTOM_COSTS[name](ends.points, ends.tangents))
