"""The cost of joining two chain ends, for all pairs of E ends at once: equations 1 to 3 and 5 of Keipour et al. (RA-L 2022).

points : (E, D) m (px in 2-D), the ends. tangents : (E, D) unit, pointing out of the chains; or (E, E, D), the tangent of end i
expected half way to end j. Costs of pairs are (E, E).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...config import MergeConfig
from ...errors import ConfigError
from ...geometry.polyline import angle, unit
from ...types import Bools, Floats
from ...visibility import Visibility
from .ends import ChainEnds

CustomCost = Callable[[Floats, Floats], Floats]

CUSTOM_COSTS: dict[str, CustomCost] = {}
"""Cost terms of the user: from the ends' points (E, D) and tangents (E, D) to (E, E). Weights are in `merge.custom_costs`."""

EXPOSED = "exposed ends"
"""Name of the term for ends in plain view, which comes on top of the limit of the other terms."""

FORCED_COST_FACTOR = 3.0
"""Multiple of `max_cost` that a connection may cost where fewer chains are wanted than are left otherwise."""

IMAGE_BORDER_RADII = 8.0
"""Radii from the edge of the view within which an end exits it; two such ends are not joined."""

EXPOSED_END_LOOKAHEAD = 2.0
"""Radii beyond an end within which an occluder is looked for."""

COINCIDENT = 1e-12
"""m (px in 2-D); ends nearer to each other than this have no direction from one to the other."""


def custom_cost(name: str) -> CustomCost:
    """Return the user's cost term that is registered in CUSTOM_COSTS under a name.

    It is a function of the ends' points (E, D) and outward tangents (E, D) to costs (E, E).

    Raises
    ------
    ConfigError : no term of that name is registered.
    """
    if name not in CUSTOM_COSTS:
        raise ConfigError(
            f"merge.custom_costs: there is no cost {name!r}; "
            f"doo3d.stages.merge.costs.CUSTOM_COSTS holds {', '.join(CUSTOM_COSTS) or 'none'}: register it there first",
            code="cost-unknown",
        )
    return CUSTOM_COSTS[name]


def euclidean(points: Floats) -> Floats:
    """Return the distance between the two ends of each pair: equation 1 of Keipour et al. (RA-L 2022).

    Parameters
    ----------
    points
        (E, D) m (px in 2-D), the ends.

    Returns
    -------
    (E, E) m (px in 2-D).
    """
    return np.asarray(np.linalg.norm(points[None] - points[:, None], axis=-1))


def direction(tangents: Floats) -> Floats:
    """Return the angle by which the direction changes between the two ends of each pair.

    Equation 2 of Keipour et al. (RA-L 2022). The angle is 0 if the tangents point straight against each other, as at a gap in
    a straight line.

    Parameters
    ----------
    tangents
        (E, D) unit, tangent of each end pointing out of its chain; or (E, E, D), where [i, j] is the tangent that end i is
        expected to have half way to end j.

    Returns
    -------
    (E, E) radians, 0 to pi.
    """
    outward = _pairwise(tangents)
    return angle(outward, -outward.swapaxes(0, 1))


def curvature(points: Floats, tangents: Floats) -> Floats:
    """Return the angle by which the connection of each pair bends at its ends, the larger of the two.

    Equation 3 of Keipour et al. (RA-L 2022). At each end it is the angle between the tangent and the straight line to the other
    end; 0 for ends that coincide.

    Parameters
    ----------
    points
        (E, D) m (px in 2-D), the ends.
    tangents
        (E, D) unit, tangent of each end pointing out of its chain; or (E, E, D), where [i, j] is the tangent that end i is
        expected to have half way to end j.

    Returns
    -------
    (E, E) radians, 0 to pi.
    """
    gap = points[None] - points[:, None]
    bend = angle(_pairwise(tangents), gap)
    bend[np.linalg.norm(gap, axis=-1) < COINCIDENT] = 0
    return np.asarray(np.maximum(bend, bend.T))


def count_in(ends: Bools) -> Floats:
    """Return for each pair of ends how many of the two are marked in `ends` (E,) bool: (E, E), 0, 1 or 2."""
    return ends[:, None].astype(float) + ends[None]


def cost_terms(ends: ChainEnds, radius: float, visibility: Visibility | None, config: MergeConfig) -> dict[str, Floats]:
    """Return the weighted cost terms of every pair of ends.

    They are those of equation 5 of Keipour et al. (RA-L 2022) and further ones. The further terms are the user's own and the
    cost of ends in plain view, which are probably real tips.

    Parameters
    ----------
    ends
        position, tangent and curvature of the E ends of all chains.
    radius
        radius of the object, m (px in 2-D).
    visibility
        tells which ends are in plain view; None for a cloud without camera views.
    config
        section `merge` of the settings: the weights.

    Returns
    -------
    Name of the term -> (E, E) cost units.
    """
    distance = euclidean(ends.points)
    expected = _expected_tangents(ends, distance, radius, config)
    terms = {
        "distance": config.distance_weight * ends.unit_cost * distance,
        "direction": config.bending.direction_weight * direction(expected),
        "curvature": config.bending.curvature_weight * curvature(ends.points, expected),
    }
    terms |= {name: weight * custom_cost(name)(ends.points, ends.tangents) for name, weight in config.custom_costs.items()}
    if visibility is not None and config.exposed_end_cost:
        exposed = visibility.is_exposed(ends.points, ends.tangents, radius, EXPOSED_END_LOOKAHEAD * radius)
        terms[EXPOSED] = config.exposed_end_cost * count_in(exposed)
    return terms


def pair_costs(
    ends: ChainEnds, terms: dict[str, Floats], radius: float, visibility: Visibility | None, config: MergeConfig
) -> Floats:
    """Return the cost of connecting each pair of ends; infinite where a connection is not allowed.

    Not allowed are ends that are too far apart or cost too much, ends of a ring, the two ends of one chain (unless rings are
    allowed), and two ends that both leave the view. The lower triangle is infinite too, so that each pair counts once.

    Parameters
    ----------
    ends
        position and tangent of the E ends of all chains.
    terms
        name of the term -> (E, E) cost units.
    radius
        radius of the object, m (px in 2-D).
    visibility
        tells which ends leave the view; None for a cloud without camera views.
    config
        section `merge` of the settings: the limits.

    Returns
    -------
    (E, E) cost units: 1 per mm of gap (1 per px in 2-D), weights per radian.
    """
    total = np.zeros((len(ends.points), len(ends.points)))
    for name, term in terms.items():
        if name != EXPOSED:
            total += term
    limit = config.max_cost * (1 if config.chains is None else FORCED_COST_FACTOR)
    total[(euclidean(ends.points) > config.max_gap) | (total > limit)] = np.inf
    total[np.tri(len(total), dtype=bool)] = np.inf
    total[ends.closed] = np.inf
    total[:, ends.closed] = np.inf
    if not config.allow_closed_chains:
        first = np.arange(0, len(total), 2)
        total[first, first + 1] = np.inf
    if visibility is not None and config.free_space_weight:
        exiting = visibility.exits_view(ends.points, ends.tangents, IMAGE_BORDER_RADII * radius)
        total[np.ix_(exiting, exiting)] = np.inf
    if EXPOSED in terms:
        total += terms[EXPOSED]
    return np.asarray(total)


def _pairwise(tangents: Floats) -> Floats:
    """Return the tangents as (E, E, D)."""
    if tangents.ndim == 3:
        return tangents
    return np.broadcast_to(tangents[:, None], (len(tangents), *tangents.shape))


def _expected_tangents(ends: ChainEnds, distance: Floats, radius: float, config: MergeConfig) -> Floats:
    """Return the tangent of every end half way to every other, (E, E, D) unit, if it keeps a share of its curvature.

    On a circle the direction half way along an arc is that of its chord, so two ends of one bend then match exactly. No
    object bends more sharply than two of its radii, and no curvature is known well enough to extrapolate far.
    """
    half_way = np.minimum(distance, config.tangent_window_radii * radius)[:, :, None] / 2
    strength = np.linalg.norm(ends.curvatures, axis=1, keepdims=True)
    bend = ends.curvatures * np.minimum(1.0, 1 / np.maximum(2 * radius * strength, 1e-12))
    return unit(ends.tangents[:, None] + config.bending.curvature_persistence * half_way * bend[:, None])
