"""The costs of the user, from functions of the ends' points (E, D) and tangents (E, D) to (E, E)."""

from collections.abc import Callable

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
    return {name: _custom_term(name, weight) for name, weight in config.custom_costs.items()}


def _custom_term(name: str, weight: float) -> Callable[[Ends, Scene], Floats]:
    if name not in CUSTOM_COSTS:
        raise ConfigError(
            f"merge.custom_costs: there is no cost {name!r}; doo3d.plugins.CUSTOM_COSTS holds "
            f"{', '.join(CUSTOM_COSTS) or 'none'}: register it there first, or install its plug-in",
            code="cost-unknown",
        )
    cost = CUSTOM_COSTS[name]
    return lambda ends, _: weight * cost(ends.points, ends.tangents)
