"""The gap paths between chain ends, and the cost of those that run through free or unknown space."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...geometry.gap_path import GapPath, gap_path
from ...geometry.limits import AT_ONCE
from ...geometry.radii import STEP_RADII
from ...scene.point_visibility import OPEN, PointVisibility
from ...scene.scene import Scene
from ...types import Bools, Floats, Ints
from ..costs import length_costs
from ..ends import FORCED_COST_FACTOR, End, Ends, Pair

CONNECTION_POINTS = 20
CONNECTION_SHARES = np.linspace(0, 1, CONNECTION_POINTS)
"""Number of points on the straight line between two near ends, and their shares of its length. The gap costs nothing if none of
them is in free space."""

CONNECTION_SAMPLES = (np.arange(12) + 0.5) / 12
"""Shares of a straight gap at which `with_straight_gaps` classifies positions."""


class GapCost(NamedTuple):
    """The cost of a gap path in three parts, in cost units: 1 per mm (1 per px in 2-D) times a weight of the settings.

    Attributes
    ----------
    free_space
        cost of the length in space that the camera saw to be empty, or outside the image.
    unknown
        cost of the length at places without a depth reading.
    bare
        cost of the length over the bare surface that the object lies on; as much per length as free space.
    """

    free_space: float
    unknown: float
    bare: float = 0.0

    @property
    def open(self) -> float:
        """The cost of the length where the camera would have seen the object: in free space and over bare surface."""
        return self.free_space + self.bare


@dataclass(frozen=True)
class GapPaths:
    """The gap paths (paths across gaps) of all pairs of chain ends, and their costs, each computed on first use and kept.

    Attributes
    ----------
    ends
        position and tangent of the ends of all chains, with section `merge` of the settings: `free_space_weight`,
        `unknown_weight`, `gap_side`, `tangent_window_radii`.
    scene
        distinguishes free from hidden space.
    """

    ends: Ends
    scene: Scene
    _paths: dict[Pair, GapPath] = field(default_factory=dict, repr=False)
    _costs: dict[Pair, GapCost] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        for rows, line in self.ends.seen.items():
            a, b = (End(*divmod(row, 2)) for row in rows)
            self._paths[a, b], self._paths[b, a] = GapPath.along(line), GapPath.along(line[::-1].copy())
            self._costs[a, b] = GapCost(0.0, 0.0)

    def path(self, start: End, end: End) -> GapPath:
        """Return the path across the gap from one end to another, m (px in 2-D): an arc, a straight line, an arc.

        The path from `end` to `start` is the same curve reversed, up to rounding.
        """
        if (start, end) not in self._paths:
            points, tangents = self.ends.points, self.ends.tangents
            self._paths[start, end] = gap_path(
                points[start.row], tangents[start.row], points[end.row], tangents[end.row],
                inside=self.ends.config.gap_side == "inside",
            )  # fmt: skip
        return self._paths[start, end]

    def costs(self, pairs: Sequence[Pair]) -> list[float]:
        """Return the cost of the gap path of each pair of ends: of its lengths in free space, in unknown space, on bare surface.

        The cost is 0 for ends closer than `tangent_window_radii` radii if the straight line between them meets no free space, and
        for all pairs if both weights are 0.

        Parameters
        ----------
        pairs
            pairs of ends, in each the lower end first.

        Returns
        -------
        One cost per pair, in cost units: 1 per mm (1 per px in 2-D) times the weight.
        """
        if not (self.ends.config.free_space_weight or self.ends.config.unknown_weight):
            return [0.0] * len(pairs)
        if missing := [pair for pair in pairs if pair not in self._costs]:
            self._costs.update(zip(missing, self._measure(missing), strict=True))
        return [sum(self._costs[pair]) for pair in pairs]

    def forced_costs(self, pairs: Sequence[Pair]) -> list[float]:
        """Return the cost of the gap path of each pair for links that only the wanted number of chains makes.

        The number makes large bends and distances likely, but no object where the camera would have seen one. So if one end is a
        tip in plain view, free space and bare surface cost FORCED_COST_FACTOR times as much, as the limit does. Otherwise the
        mask continues at both ends, only the depth is missing, and the gap path is beside the object: then bare surface costs
        nothing. In 2-D and for clouds the costs are those of `costs`.
        """
        costs = []
        for pair, cost in zip(pairs, self.costs(pairs), strict=True):
            gap = self.cost(pair)
            is_tip = self._tips[[end.row for end in pair]].any()
            costs.append(cost + (FORCED_COST_FACTOR - 1) * gap.open if is_tip else cost - gap.bare)
        return costs

    @cached_property
    def _tips(self) -> Bools:
        """Which ends are tips in plain view, (E,)."""
        return self.scene.tips(self.ends.points, self.ends.tangents, self.ends.radius) > 0

    def cost(self, pair: Pair) -> GapCost:
        """Return the cost of the gap path of one pair of ends in its three parts, in cost units."""
        self.costs([pair])
        return self._costs.get(pair, GapCost(0.0, 0.0))

    def _measure(self, pairs: Sequence[Pair]) -> list[GapCost]:
        """Return the costs of gap paths; a short gap costs nothing if the straight line between its ends meets no free space."""
        first, second = (np.array(pairs) @ (2, 1)).T.copy()  # rows of ends, as `End.row`
        ends, is_near = self.ends.points, self.ends.distance[first, second] < self.ends.window
        costly = ~is_near
        if is_near.any():
            samples = _straight_gaps(ends, first[is_near], second[is_near], CONNECTION_SHARES)
            bounds = np.arange(0, len(samples) + 1, CONNECTION_POINTS)
            costly[is_near] = self.scene.lengths(samples, bounds)[:, [0, 2]].any(axis=1)
        cost = np.zeros((len(pairs), 3))
        if costly.any():
            spacing = STEP_RADII * self.ends.radius
            paths = [self.path(a, b).points(spacing) for (a, b), is_costly in zip(pairs, costly, strict=True) if is_costly]
            cost[costly] = length_costs(paths, self.scene, self.ends.config, self.ends.unit_cost)
        return [GapCost(*row) for row in cost.tolist()]

    def with_straight_gaps(self, cost: Floats) -> Floats:
        """Return the cost of each pair of ends with the cost of a straight gap, through free and unknown space, added.

        Straight gaps stand in for gap paths, which are too expensive to compute for all pairs.

        Parameters
        ----------
        cost
            (E, E) cost units, cost of linking each pair of E ends without the gap; infinite where a link is not allowed.

        Returns
        -------
        (E, E) cost units, a new array; infinite where `cost` is.
        """
        total, config = cost.copy(), self.ends.config
        if not (config.free_space_weight or config.unknown_weight):
            return total
        first, second = np.nonzero(np.isfinite(cost))
        for start in range(0, len(first), AT_ONCE):
            a, b = first[start : start + AT_ONCE], second[start : start + AT_ONCE]
            total[a, b] += self._straight_gap_costs(a, b)
        for pair in self.ends.seen:
            total[pair] = cost[pair]
        return total

    def _straight_gap_costs(self, first: Ints, second: Ints) -> Floats:
        """Return the cost of a straight gap between K ends and K others, given by their rows, (K,) cost units."""
        samples = _straight_gaps(self.ends.points, first, second, CONNECTION_SAMPLES)
        classes = self.scene.classify(samples).reshape(len(first), len(CONNECTION_SAMPLES))
        is_open = np.isin(classes, OPEN).mean(axis=1)
        unknown = (classes == PointVisibility.NO_DEPTH).mean(axis=1)
        length = self.ends.distance[first, second]
        unknown[(length < self.ends.window) & (is_open == 0)] = 0.0
        weighted = self.ends.config.free_space_weight * is_open + self.ends.config.unknown_weight * unknown
        return np.asarray(self.ends.unit_cost * length * weighted)


def _straight_gaps(points: Floats, first: Ints, second: Ints, shares: Floats) -> Floats:
    """Return the positions at S shares of the straight lines between the ends of K pairs, (K S, D), pair by pair."""
    lines = points[first, None] + shares[:, None] * (points[second] - points[first])[:, None]
    return lines.reshape(-1, points.shape[1])
