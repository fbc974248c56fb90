"""The terms of the cost of a link: equation 5 of Keipour et al. (RA-L 2022), extended by what was seen.

A term is a function of the ends and the scene to (E, E), what it adds to the cost of linking each pair of ends,
already multiplied by its weight, or None where it has nothing to say. Costs are in cost units: 1 per mm of gap (1 per px in 2-D),
plus angles in radians times their weights (section `merge` of the settings). A new term is a function here and a line in TERMS.
Gap paths are too expensive to compute for all pairs: `gap_path` gives their costs for the pairs that are asked for.
"""

from collections.abc import Callable

import numpy as np

from ...scene.scene import Scene
from ...types import Floats
from ..ends import Ends
from .custom import custom_terms
from .exposed_ends import exposed_ends
from .geometric import curvature, direction, distance
from .layers import layers

Term = Callable[[Ends, Scene], "Floats | None"]

EXPOSED = "exposed ends"
"""Name of the term for ends in plain view, which comes on top of the limit of the other terms."""

TERMS: dict[str, Term] = {
    "distance": distance,
    "direction": direction,
    "curvature": curvature,
    "layers": layers,
    EXPOSED: exposed_ends,
}
"""The terms by name, in the order in which they are added."""


def cost_terms(ends: Ends, scene: Scene) -> dict[str, Floats]:
    """Return what each term adds to the cost of linking each pair of chain ends.

    Parameters
    ----------
    ends
        the ends of all chains, with section `merge` of the settings.
    scene
        what was captured.

    Returns
    -------
    Name of the term -> (E, E) cost units. The terms are symmetric, except perhaps those of the user. Where only the depth
    between two ends is missing, all are 0.

    Raises
    ------
    ConfigError : `merge.custom_costs` names a term that is not registered in CUSTOM_COSTS.
    """
    terms = TERMS | custom_terms(ends.config)
    costs = {name: term(ends, scene) for name, term in terms.items()}
    given = {name: cost for name, cost in costs.items() if cost is not None}
    for pair in ends.seen:
        for cost in given.values():
            cost[pair] = cost[pair[::-1]] = 0.0
    return given


def pair_costs(ends: Ends, terms: dict[str, Floats], scene: Scene) -> Floats:
    """Return the cost of linking each pair of ends, the sum of the terms, (E, E) cost units; infinite where no link is allowed.

    `Ends.limited` says where a link is not allowed, except where only the depth is missing. The term "exposed ends" does not
    count for the limit of the cost.
    """
    limiting = sum((term for name, term in terms.items() if name != EXPOSED), np.zeros_like(ends.distance))
    total = ends.limited(limiting, scene) + terms.get(EXPOSED, 0.0)
    for pair in ends.seen:
        total[pair] = 0.0
    return total
