"""The ends of chains, the pairs of ends that may be linked, and links."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..config import MergeConfig
from ..geometry.curves import Curves
from ..geometry.polyline import angle
from ..scene.scene import Scene
from ..types import Bools, Floats
from .costs import unit_cost
from .depth_gaps import Gaps, depth_gaps
from .hidden_strands import Exits, hidden_strands

FORCED_COST_FACTOR = 3.0
"""Multiple of `max_cost` that a link may cost, and of `max_gap` that it may span, if more chains are left than are wanted: hands
and boxes in front of a cable are wider than other gaps."""

IMAGE_BORDER_RADII = 8.0
"""Radii from the edge of the view within which an end leaves the view; two such ends are not linked."""


class End(NamedTuple):
    """Name of one end of a chain. Ends sort by chain, then by side.

    Attributes
    ----------
    chain
        index of the chain.
    side
        0 for the chain's first joint, 1 for its last.
    """

    chain: int
    side: int

    @classmethod
    def at(cls, row: int) -> End:
        """Return the end at a row of arrays over all ends of all chains."""
        return cls(*divmod(row, 2))

    @property
    def row(self) -> int:
        """The row of this end in arrays over all ends of all chains: 2 * chain + side."""
        return 2 * self.chain + self.side

    @property
    def other(self) -> End:
        """The other end of the same chain."""
        return End(self.chain, 1 - self.side)

    def __str__(self) -> str:
        return f"{self.chain} {'end' if self.side else 'start'}"


Pair = tuple[End, End]
"""Two ends that are or could be linked, the lower first."""


class Link(NamedTuple):
    """Two chain ends that belong together, and the cost of linking them. Links sort by cost.

    Attributes
    ----------
    cost
        in cost units: 1 per mm of gap (1 per px in 2-D), plus angles in radians times their weights (section `merge` of the
        settings).
    first, second
        the two ends. `first` has the lower chain number or, in one chain, side 0.
    """

    cost: float
    first: End
    second: End

    @property
    def pair(self) -> Pair:
        """The two ends, (first, second)."""
        return self.first, self.second

    @property
    def rows(self) -> tuple[int, int]:
        """The rows of the two ends in arrays over all ends of all chains."""
        (a, a_side), (b, b_side) = self.first, self.second
        return 2 * a + a_side, 2 * b + b_side


def ends_of(count: int) -> list[End]:
    """Return both ends of each of `count` chains: side 0, side 1 of chain 0, then of chain 1, and so on."""
    return [End(chain, side) for chain in range(count) for side in (0, 1)]


@dataclass(frozen=True)
class Ends:
    """The E ends of all chains as arrays, and their pairs. Rows 2 c and 2 c + 1 are the first and the last joint of chain c.

    Attributes
    ----------
    points
        (E, D) m, D = 3 (in 2-D: px, D = 2), position of each end.
    tangents
        (E, D) unit, tangent at each end, pointing out of its chain.
    closed
        (E,) bool, True if the end's chain is already a ring.
    radius
        radius of the object, m (px in 2-D).
    config
        section `merge` of the settings: the weights of the terms, and the limits.
    gap_unit
        factor by which gaps may be longer and cost less, from the spacing of a cloud's points; 1 for a frame or an image.
    max_turn
        radians, angle by which an object may turn across a gap.
    segment_length
        m (px in 2-D), of the chains.
    chains
        the joints of the chains.
    seen
        gaps in which only the depth is missing: rows of two ends, the lower first -> (P, D) m, the points from the first to the
        second. The costs of these pairs are 0.
    notes
        messages to the user: such gaps were not searched.
    """

    points: Floats
    tangents: Floats
    closed: Bools
    radius: float
    config: MergeConfig
    gap_unit: float = 1.0
    max_turn: float = np.pi
    segment_length: float = 1.0
    chains: Curves = field(default_factory=lambda: Curves.of([]))
    seen: Gaps = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    exits: Exits = field(default_factory=dict)

    @classmethod
    def of(cls, chains: Curves, scene: Scene, segment_length: float, config: MergeConfig) -> Ends:
        """Measure position and outward tangent of both ends of each chain, at least one.

        A parabola is fitted to the last `merge.tangent_window_radii` radii of a chain, at least to its last segment.
        """
        tangents = chains.ends(config.tangent_window_radii * scene.radius)
        closed = np.repeat(chains.closed, 2)
        units, points = (scene.gap_unit, scene.max_turn, segment_length), chains.points[chains.tips]
        if config.strategy == "greedy":
            return cls(points, tangents, closed, scene.radius, config, *units, chains)
        seen, notes = depth_gaps(points, tangents, chains, scene) if len(scene.each_layer) == 1 else ({}, ())
        hidden, exits = hidden_strands(points, tangents, chains, scene)
        return cls(points, tangents, closed, scene.radius, config, *units, chains, seen | hidden, notes, exits)

    @cached_property
    def window(self) -> float:
        """The length of chain at an end from which its tangent is taken, m (px in 2-D). Ends closer than this are near."""
        return self.config.tangent_window_radii * self.radius

    @property
    def max_gap(self) -> float:
        """The longest gap between two ends, m (px in 2-D): `merge.max_gap`, times `gap_unit`."""
        return self.config.gap * self.gap_unit

    @property
    def unit_cost(self) -> float:
        """The number of cost units per unit of length: 1000 per m in 3-D, which is 1 per mm, over `gap_unit`; 1 per px in 2-D."""
        return unit_cost(self.points.shape[1]) / self.gap_unit

    @cached_property
    def pairs(self) -> tuple[Floats, Floats, Floats]:
        """Distance, turn and bend of each pair of ends, (E, E) each, symmetric.

        The turn is the angle between the tangent of one end and the reversed tangent of the other; the bend is the larger of the
        angles between the tangents and the straight line from end to end, 0 for ends at one place. Both are in radians, 0 to pi.
        """
        gap = self.points - self.points[:, None]
        distance = np.linalg.norm(gap, axis=2)
        bend = np.where(distance > 0, angle(self.tangents[:, None], gap), 0.0)
        return distance, angle(self.tangents[:, None], -self.tangents), np.maximum(bend, bend.T)

    @property
    def distance(self) -> Floats:
        """The distance of each pair of ends, (E, E) m (px in 2-D), symmetric."""
        return self.pairs[0]

    @property
    def turns(self) -> Floats:
        """The turn between each pair of ends, (E, E) radians, symmetric: 0 for a gap in a straight line."""
        return self.pairs[1]

    def limited(self, cost: Floats, scene: Scene) -> Floats:
        """Return the cost of linking each pair of ends, infinite where a link is not allowed.

        Not allowed are ends farther apart than `max_gap`; costs above `max_cost` (3 times both if `chains` is set); ends of a
        ring; the two ends of one chain, unless `allow_closed_chains` is set; and two ends that both leave the view, unless
        `free_space_weight` is 0. The diagonal and the entries below it are infinite too, so that each pair counts once.

        Parameters
        ----------
        cost
            (E, E) cost units.
        scene
            says which ends leave the view.
        """
        config, of_chain = self.config, np.arange(len(cost)) // 2
        factor = 1 if config.chains is None else FORCED_COST_FACTOR
        allowed = (self.distance <= factor * self.max_gap) & (cost <= factor * config.max_cost)
        allowed &= ~(self.closed | self.closed[:, None])
        if config.chains is None:
            allowed &= self.turns <= self.max_turn
        if not config.allow_closed_chains:
            allowed &= of_chain != of_chain[:, None]
        if config.free_space_weight:
            exiting = scene.exits_view(self.points, self.tangents, IMAGE_BORDER_RADII * self.radius)
            allowed &= ~(exiting & exiting[:, None])
        return np.where(np.triu(allowed, 1), cost, np.inf)
