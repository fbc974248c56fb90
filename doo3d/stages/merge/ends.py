"""The two ends of every chain: what they are called, where they lie and how they head out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.end_tangents import end_tangents
from ...types import Bools, Chain, Floats


@dataclass(frozen=True, order=True, slots=True)
class End:
    """One end of a chain: of the chain's number, and side 0 for its first joint, 1 for its last."""

    chain: int
    side: int

    @property
    def index(self) -> int:
        """Row of this end in arrays over all E ends: two rows a chain, the first joint's before the last's."""
        return 2 * self.chain + self.side

    @property
    def other(self) -> End:
        """The other end of the same chain."""
        return End(self.chain, 1 - self.side)

    def __str__(self) -> str:
        return f"{self.chain} {'end' if self.side else 'start'}"


Pair = tuple[End, End]
"""Two ends that are or could be joined, the lower first."""


def ends_of(count: int) -> list[End]:
    """Return the ends of `count` chains, in the order of their rows in arrays."""
    return [End(chain, side) for chain in range(count) for side in (0, 1)]


@dataclass(frozen=True)
class ChainEnds:
    """All E ends of the chains, as arrays with a row per end.

    Attributes
    ----------
    points
        (E, D) m (px in 2-D).
    tangents
        (E, D) unit, pointing out of the chains.
    curvatures
        (E, D) 1/m (1/px in 2-D), square to the tangents.
    closed
        (E,) bool, the chain is a ring already.
    """

    points: Floats
    tangents: Floats
    curvatures: Floats
    closed: Bools

    @property
    def unit_cost(self) -> float:
        """Cost units per unit of length: per millimetre in 3-D, per pixel in 2-D."""
        return 1000.0 if self.points.shape[1] == 3 else 1.0


def measure_ends(chains: list[Chain], window: float) -> ChainEnds:
    """Return the ends of the chains, one at least; tangents are fitted over `window` m (px in 2-D) of chain."""
    bounds = np.cumsum([0, *(len(chain.joints) for chain in chains)])
    joints = np.ascontiguousarray(np.concatenate([chain.joints for chain in chains]))
    tangents, curvatures = end_tangents(joints, bounds, float(window))
    points = joints[np.column_stack((bounds[:-1], bounds[1:] - 1)).ravel()]
    return ChainEnds(points, tangents, curvatures, np.repeat([chain.closed for chain in chains], 2))
