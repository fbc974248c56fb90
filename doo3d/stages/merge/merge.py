"""Which chain ends belong together (paper, section III-F: choosing the best matches)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...config import FillConfig, MergeConfig
from ...geometry.arcs import tangent_path
from ...geometry.polyline import steps, unit
from ...kernels.end_tangents import end_tangents
from ...types import Assembly, Chain, Floats
from ...visibility import Visibility
from .. import FrameContext
from . import costs
from .assignment import STRATEGIES, Pair, insist
from .confidence import Link, alternatives, sureness

IMAGE_BORDER_RADII = 8.0
"""Radii from the edge of the view within which an end leaves it; two such ends are not joined."""

EXPOSED_END_LOOKAHEAD = 2.0
"""Radii beyond an end that are looked at for an occluder."""


@dataclass(frozen=True)
class Ends:
    """The two ends of every chain: end e is the first (even) or last (odd) of chain e // 2."""

    points: Floats
    directions: Floats
    curvatures: Floats
    unit_cost: float  # cost units per unit of length: per millimetre in 3-D, per pixel in 2-D


@dataclass(frozen=True)
class Joined:
    """What merging decided, and on what grounds. End e is the first (even) or last (odd) of chain e // 2.

    terms : name -> (E, E), what each pair of ends costs for that. cost : (E, E), their sum in the upper triangle, infinite where
    ends may not be joined. links : the connections. others : `cost` with what the camera says of the straight ways.
    confidence : 0 to 1, of each connection. ways : pairs -> (K, 2), cost of their gap paths for free space and for unknown space.
    """

    ends: Ends
    terms: dict[str, Floats]
    cost: Floats
    links: list[Link]
    others: Floats
    confidence: list[float]
    ways: Callable[[list[Pair]], Floats]


def merge(chains: list[Chain], context: FrameContext, config: MergeConfig, fill: FillConfig | None = None) -> list[Assembly]:
    """Join the two ends with the lowest cost (equation 5), again and again, until the wanted number of chains is left
    or no pair is good enough; longest first.

    fill : how gap paths are led; where a camera is known, a gap path costs for its parts in free space.
    """
    if not chains:
        return []
    radius = context.radius
    joined = join(chains, config, radius, fill or FillConfig(), context.visibility)
    result = _assemble(chains, joined.ends, joined.links, joined.confidence)
    result.sort(key=lambda assembly: -sum(len(piece) - 1 for piece in assembly.pieces))
    if config.chains is not None:
        return result[: config.chains]
    return [assembly for assembly in result if _length(assembly) >= config.min_length * radius]


def join(chains: list[Chain], config: MergeConfig, radius: float, fill: FillConfig, visibility: Visibility | None) -> Joined:
    """Which ends of the chains, one at least, are joined, with all that was known of them; arguments as of `merge`."""
    ends = _ends(chains, config, radius)
    terms = _terms(ends, config, radius, visibility)
    cost = _pair_costs(ends, terms, chains, config)
    if visibility is not None and config.free_space_weight:
        leaving = visibility.exits_view(ends.points, ends.directions, IMAGE_BORDER_RADII * radius)
        cost[np.ix_(leaving, leaving)] = np.inf
    if "open" in terms:
        cost += terms["open"]

    ways = partial(_ways, ends, config, radius, fill, visibility)
    extra = partial(_extra, ways, config)
    links = STRATEGIES[config.strategy](np.where(cost <= config.max_cost, cost, np.inf), extra, config)
    if config.chains is not None:
        links += insist(links, cost, [len(chain.joints) - 1 for chain in chains], extra, config)
    others = alternatives(cost, ends.points, ends.unit_cost, radius, config, visibility)
    return Joined(ends, terms, cost, links, others, sureness(links, others, config.max_cost, config.allow_closed_chains), ways)


def _length(assembly: Assembly) -> float:
    return sum(len(piece) - 1 for piece in assembly.pieces) * assembly.segment_length


def _ends(chains: list[Chain], config: MergeConfig, radius: float) -> Ends:
    bounds = np.cumsum([0, *(len(chain.joints) for chain in chains)])
    joints = np.ascontiguousarray(np.concatenate([chain.joints for chain in chains]))
    directions, curvatures = end_tangents(joints, bounds, float(config.tangent_window_radii * radius))
    points = joints[np.column_stack((bounds[:-1], bounds[1:] - 1)).ravel()]
    return Ends(points, directions, curvatures, 1000.0 if points.shape[1] == 3 else 1.0)


def _terms(ends: Ends, config: MergeConfig, radius: float, visibility: Visibility | None) -> dict[str, Floats]:
    """The terms of equation 5 and those beside it, weighted, for every pair of ends: (E, E) each."""
    distance = costs.euclidean(ends.points)
    towards = _expected(ends, distance, config, radius)
    terms = {
        "distance": config.distance_weight * ends.unit_cost * distance,
        "direction": config.bending.direction_weight * costs.direction(towards),
        "curvature": config.bending.curvature_weight * costs.curvature(ends.points, towards),
    }
    terms |= {
        name: weight * costs.custom_cost(name)(ends.points, ends.directions) for name, weight in config.custom_costs.items()
    }
    if visibility is not None and config.exposed_end_cost:
        free = visibility.is_exposed(ends.points, ends.directions, radius, EXPOSED_END_LOOKAHEAD * radius)
        terms["open"] = config.exposed_end_cost * costs.count_in(free)
    return terms


def _pair_costs(ends: Ends, terms: dict[str, Floats], chains: list[Chain], config: MergeConfig) -> Floats:
    """Equation 5 for every pair of ends, infinite where they may not be joined: (E, E)."""
    total = np.zeros((len(ends.points), len(ends.points)))
    for name, term in terms.items():
        if name != "open":
            total += term
    distance = costs.euclidean(ends.points)
    limit = config.max_cost * (1 if config.chains is None else costs.FORCED_COST_FACTOR)
    total[(distance > config.max_gap) | (total > limit)] = np.inf
    total[np.tri(len(total), dtype=bool)] = np.inf
    closed = np.repeat([chain.closed for chain in chains], 2)
    total[closed] = np.inf
    total[:, closed] = np.inf
    if not config.allow_closed_chains:
        index = np.arange(0, len(total), 2)
        total[index, index + 1] = np.inf
    return np.asarray(total)


def _extra(ways: Callable[[list[Pair]], Floats], config: MergeConfig, pairs: list[Pair]) -> list[float]:
    """What connections cost for what of their ways runs through free space, or where nothing is known."""
    if not pairs or not (config.free_space_weight or config.unknown_weight):
        return [0.0] * len(pairs)
    return [float(price) for price in ways(pairs).sum(axis=1)]


def _ways(
    ends: Ends, config: MergeConfig, radius: float, fill: FillConfig, visibility: Visibility | None, pairs: list[Pair]
) -> Floats:
    """What the ways of connections cost for free space, and for what is not known: (K, 2).

    A short gap costs nothing where the straight way across it is not free.
    """
    one, other = ends.points[np.array(pairs)].swapaxes(0, 1)
    asked = np.linalg.norm(other - one, axis=1) >= config.tangent_window_radii * radius
    if visibility is not None:
        asked |= visibility.free_and_unknown_lengths(list(np.linspace(one, other, 20, axis=1)))[:, 0] > 0
    ways = [
        tangent_path(
            ends.points[a], ends.directions[a], ends.points[b], ends.directions[b], radius / 2,
            inside=fill.side == "inside",
        )
        for (a, b), ask in zip(pairs, asked, strict=True) if ask
    ]  # fmt: skip
    cost = np.zeros((len(pairs), 2))
    if ways:
        told = (
            visibility.free_and_unknown_lengths(ways)
            if visibility is not None
            else np.array([(0.0, steps(way).sum()) for way in ways])
        )
        cost[asked] = ends.unit_cost * told * (config.free_space_weight, config.unknown_weight)
    return cost


def _expected(ends: Ends, distance: Floats, config: MergeConfig, radius: float) -> Floats:
    """The direction of every end half way to every other, (E, E, D) unit, if it keeps a share of its curvature.

    On a circle the direction half way along an arc is that of its chord, so two ends of one bend then match exactly. No
    object bends more sharply than two of its radii, and no curvature is known well enough to go on for long.
    """
    half = np.minimum(distance, config.tangent_window_radii * radius)[:, :, None] / 2
    strength = np.linalg.norm(ends.curvatures, axis=1, keepdims=True)
    bend = ends.curvatures * np.minimum(1.0, 1 / np.maximum(2 * radius * strength, 1e-12))
    return unit(ends.directions[:, None] + config.bending.curvature_persistence * half * bend[:, None])


def _assemble(chains: list[Chain], ends: Ends, links: list[Link], confidence: list[float]) -> list[Assembly]:
    partner = {a: (b, price, s) for (a, b, price), s in zip(links, confidence, strict=True)}
    partner |= {b: (a, price, s) for a, (b, price, s) in partner.items()}
    done: set[int] = set()
    result = []
    starts = [e for e in range(len(ends.points)) if e not in partner]
    for start in [*starts, *range(0, len(ends.points), 2)]:
        if start // 2 in done:
            continue
        pieces, headings, prices, known, e, closed = [], [], [], [], start, False
        while True:
            chain = chains[e // 2]
            done.add(e // 2)
            pieces.append(chain.joints if e % 2 == 0 else chain.joints[::-1])
            out = e ^ 1
            if chain.closed:
                headings.append(ends.directions[[out, e]])
                closed = True
            if out not in partner:
                break
            e, price, s = partner[out]
            headings.append(ends.directions[[out, e]])
            prices.append(price)
            known.append(s)
            if e == start:
                closed = True
                break
        length = chains[0].segment_length
        result.append(Assembly(tuple(pieces), tuple(headings), tuple(prices), length, closed, tuple(known)))
    return result
