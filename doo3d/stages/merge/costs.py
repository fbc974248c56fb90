"""The cost of joining two chain ends, for all pairs of E ends at once: equations 1 to 3 and 5 of Keipour et al. (RA-L 2022).

points : (E, D) m (px in 2-D), the positions of E ends. tangents : (E, D) unit, pointing out of the chains; or (E, E, D), the
tangent that end i is expected to have half way to end j. Costs of pairs are (E, E), in cost units: 1 per mm of gap (1 per px in
2-D), plus angles in radians times their weights (section `merge` of the settings).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...config import MergeConfig
from ...errors import ConfigError
from ...geometry.limits import AT_ONCE
from ...geometry.polyline import TINY, angle, unit
from ...plugins import COSTS, Registry
from ...types import Bools, Floats
from ...visibility import Visibility
from .ends import ChainEnds

CustomCost = Callable[[Floats, Floats], Floats]

CUSTOM_COSTS: Registry[CustomCost] = Registry(COSTS, {})
"""Cost terms of the user: from the ends' points (E, D) and tangents (E, D) to (E, E). Weights are in `merge.custom_costs`."""

EXPOSED = "exposed ends"
"""Name of the term for ends in plain view, which comes on top of the limit of the other terms."""

FORCED_COST_FACTOR = 3.0
"""Multiple of `max_cost` that a connection may cost, and of `max_gap` that it may span, where fewer chains are wanted than are
left otherwise: hands and boxes before a cable are wider than other gaps."""

IMAGE_BORDER_RADII = 8.0
"""Radii from the edge of the view within which an end exits it; two such ends are not joined."""

EXPOSED_END_LOOKAHEAD = 2.0
"""Radii beyond an end within which an occluder is looked for."""


def custom_cost(name: str) -> CustomCost:
    """Return the user's cost function that is registered in CUSTOM_COSTS under a name.

    The function takes the positions (E, D) m, D = 3 (in 2-D: px, D = 2) and the outward unit tangents (E, D) of E chain ends, and
    returns (E, E), the cost of joining each pair. Only entries [i, j] with i < j are used.

    Raises
    ------
    ConfigError : no term of that name is registered.
    """
    if name not in CUSTOM_COSTS:
        raise ConfigError(
            f"merge.custom_costs: there is no cost {name!r}; "
            f"doo3d.stages.merge.costs.CUSTOM_COSTS holds {', '.join(CUSTOM_COSTS) or 'none'}: register it there first, or "
            "install its plug-in",
            code="cost-unknown",
        )
    return CUSTOM_COSTS[name]


def euclidean(points: Floats) -> Floats:
    """Return the distances between E chain ends: equation 1 of Keipour et al. (RA-L 2022).

    Parameters
    ----------
    points
        (E, D) m, D = 3 (in 2-D: px, D = 2), positions of the ends.

    Returns
    -------
    (E, E) m (px in 2-D), distance of each pair, symmetric.
    """
    return _by_rows(lambda rows: np.linalg.norm(points[None] - points[rows, None], axis=-1), len(points))


def direction(tangents: Floats) -> Floats:
    """Return for each pair of chain ends the angle by which a line turns that leaves by one end and enters by the other.

    The angle is 0 if the tangents point straight against each other, as at a gap in a straight line. This is equation 2 of
    Keipour et al. (RA-L 2022).

    Parameters
    ----------
    tangents
        (E, D) unit, D = 2 or 3, tangent of each of E ends pointing out of its chain; or (E, E, D), where [i, j] is the tangent
        that end i is expected to have half way to end j.

    Returns
    -------
    (E, E) radians, 0 to pi, symmetric.
    """
    outward = _pairwise(tangents)
    return _by_rows(lambda rows: angle(outward[rows], -outward[:, rows].swapaxes(0, 1)), len(tangents))


def curvature(points: Floats, tangents: Floats) -> Floats:
    """Return for each pair of chain ends the angle by which an end must bend to head straight for the other end.

    That is the angle between the tangent of an end and the straight line to the other end; of the two angles of a pair the larger
    is returned. This is equation 3 of Keipour et al. (RA-L 2022).

    Parameters
    ----------
    points
        (E, D) m, D = 3 (in 2-D: px, D = 2), positions of E ends.
    tangents
        (E, D) unit, tangent of each end pointing out of its chain; or (E, E, D), where [i, j] is the tangent that end i is
        expected to have half way to end j.

    Returns
    -------
    (E, E) radians, 0 to pi, symmetric; 0 for ends that coincide.
    """
    outward = _pairwise(tangents)

    def bend_of(rows: slice) -> Floats:
        gap = points[None] - points[rows, None]
        bend = angle(outward[rows], gap)
        bend[np.linalg.norm(gap, axis=-1) < TINY] = 0
        return bend

    bend = _by_rows(bend_of, len(points))
    return np.asarray(np.maximum(bend, bend.T))


def count_in(ends: Bools) -> Floats:
    """Return for each pair of E ends how many of the two are marked: 0, 1 or 2.

    Parameters
    ----------
    ends
        (E,) bool, True for a marked end.

    Returns
    -------
    (E, E) float, symmetric; 0 or 2 on the diagonal.
    """
    return ends[:, None].astype(float) + ends[None]


def cost_terms(ends: ChainEnds, radius: float, visibility: Visibility | None, config: MergeConfig) -> dict[str, Floats]:
    """Return the terms of the cost of connecting each pair of chain ends, each already multiplied by its weight.

    The terms are "distance", "direction" and "curvature" of Keipour et al. (RA-L 2022, equation 5), those that the user named in
    `merge.custom_costs`, and "exposed ends" if `merge.exposed_end_cost` is set: the cost of joining ends in plain view, which are
    probably real tips.

    Parameters
    ----------
    ends
        position, tangent and curvature of the E ends of all chains.
    radius
        radius of the object, m (px in 2-D).
    visibility
        tells which ends are in plain view; None for a cloud without camera views, which has no term "exposed ends".
    config
        section `merge` of the settings: the weights.

    Returns
    -------
    Name of the term -> (E, E), what the term adds to the cost of each pair, in cost units: 1 per mm of gap (1 per px in 2-D),
    plus angles in radians times their weights. The terms are symmetric, except perhaps those of the user.

    Raises
    ------
    ConfigError : `merge.custom_costs` names a term that is not registered in CUSTOM_COSTS.
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

    The cost is the sum of the terms. Not allowed are ends farther apart than `max_gap`; costs above `max_cost` without the term
    "exposed ends" (3 times both if `chains` is set); ends of a ring; the two ends of one chain, unless
    `allow_closed_chains` is set; and two ends that both leave the view, unless `free_space_weight` is 0. The diagonal and the
    entries below it are infinite too, so that each pair counts once.

    Parameters
    ----------
    ends
        position and tangent of the E ends of all chains.
    terms
        name of the term -> (E, E) cost units, as `cost_terms` returns them.
    radius
        radius of the object, m (px in 2-D).
    visibility
        tells which ends leave the view; None for a cloud without camera views.
    config
        section `merge` of the settings: the limits.

    Returns
    -------
    (E, E) in cost units: 1 per mm of gap (1 per px in 2-D), plus angles in radians times their weights.
    """
    total = np.zeros((len(ends.points), len(ends.points)))
    for name, term in terms.items():
        if name != EXPOSED:
            total += term
    factor = 1 if config.chains is None else FORCED_COST_FACTOR
    too_far = euclidean(ends.points) > factor * config.max_gap * ends.gap_unit
    total[too_far | (total > factor * config.max_cost)] = np.inf
    if ends.max_turn < np.pi and config.chains is None:
        total[direction(ends.tangents) > ends.max_turn] = np.inf
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


def _by_rows(values: Callable[[slice], Floats], count: int) -> Floats:
    """Return values of all pairs, (E, E) or (E, E, D), computed a few rows at a time where there are many ends."""
    rows = max(1, AT_ONCE // max(count, 1))
    if count <= rows:
        return np.asarray(values(slice(None)))
    return np.concatenate([values(slice(start, start + rows)) for start in range(0, count, rows)])


def _expected_tangents(ends: ChainEnds, distance: Floats, radius: float, config: MergeConfig) -> Floats:
    """Return the tangent of every end half way to every other, (E, E, D) unit, if it keeps a share of its curvature.

    On a circle the direction half way along an arc is that of its chord, so two ends of one bend then match exactly. No
    object bends more sharply than two of its radii, and no curvature is known well enough to extrapolate far.
    """
    strength = np.linalg.norm(ends.curvatures, axis=1, keepdims=True)
    bend = ends.curvatures * np.minimum(1.0, 1 / np.maximum(2 * radius * strength, 1e-12))

    def tangents(rows: slice) -> Floats:
        half_way = np.minimum(distance[rows], config.tangent_window_radii * radius)[:, :, None] / 2
        return unit(ends.tangents[rows, None] + config.bending.curvature_persistence * half_way * bend[rows, None])

    return _by_rows(tangents, len(distance))
