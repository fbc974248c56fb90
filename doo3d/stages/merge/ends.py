"""The two ends of every chain: their names, positions, tangents and curvatures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...geometry.curves import Curves
from ...types import Bools, Floats


class End(NamedTuple):
    """Name of one end of a chain. Ends sort by chain, then by side.

    Attributes
    ----------
    chain
        index of the chain in the list of chains that are merged.
    side
        0 for the chain's first joint, 1 for its last.
    """

    chain: int
    side: int

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
"""Two ends that are or could be joined, the lower first."""


def ends_of(count: int) -> list[End]:
    """Return both ends of each of `count` chains: side 0, side 1 of chain 0, then of chain 1, and so on."""
    return [End(chain, side) for chain in range(count) for side in (0, 1)]


@dataclass(frozen=True)
class ChainEnds:
    """The E ends of all chains as arrays: rows 2 c and 2 c + 1 are the first and the last joint of chain c.

    Attributes
    ----------
    points
        (E, D) m, D = 3 (in 2-D: px, D = 2), position of each end.
    tangents
        (E, D) unit, tangent at each end, pointing out of its chain.
    curvatures
        (E, D) 1/m (1/px in 2-D), curvature vector at each end: perpendicular to the tangent, towards the inside of the bend; its
        length is 1 / radius of the bend, 0 for a straight chain.
    closed
        (E,) bool, True if the end's chain is already a ring.
    gap_unit
        factor by which gaps may be longer and cost less, from the spacing of a cloud's points; 1 for a frame or an image.
    max_turn
        radians, angle by which an object may turn across a gap.
    """

    points: Floats
    tangents: Floats
    curvatures: Floats
    closed: Bools
    gap_unit: float = 1.0
    max_turn: float = np.pi

    @property
    def unit_cost(self) -> float:
        """The number of cost units per unit of length: 1000 per m in 3-D, which is 1 per mm, over `gap_unit`; 1 per px in 2-D."""
        return 1000.0 / self.gap_unit if self.points.shape[1] == 3 else 1.0


def measure_ends(chains: Curves, window: float, gap_unit: float = 1.0, max_turn: float = np.pi) -> ChainEnds:
    """Measure position, outward tangent and curvature of both ends of each chain.

    Parameters
    ----------
    chains
        the joints of the chains, at least one.
    window
        m (px in 2-D), length of chain at the end to which a parabola is fitted; at least the last segment is used.
    gap_unit
        factor by which gaps may be longer and cost less than the settings say.
    max_turn
        radians, angle by which an object may turn across a gap.

    Returns
    -------
    Both ends of every chain, in the order of the chains.
    """
    return ChainEnds(chains.points[chains.tips], *chains.ends(window), np.repeat(chains.closed, 2), gap_unit, max_turn)
