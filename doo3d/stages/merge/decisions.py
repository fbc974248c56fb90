"""The record of what merging decided: each connection with its cost, term by term, and its cheapest alternative."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...types import Chain, Floats
from .. import Assembly
from .assignment import Link
from .ends import Pair, ends_of
from .gap_path_costs import GapCost, GapPaths


@dataclass(frozen=True)
class Candidate:
    """Two ends that are or could be joined, and the cost of that.

    Attributes
    ----------
    ends
        the lower first; chains are numbered as pruning left them.
    points
        (2, D) m (px in 2-D), where the ends lie.
    terms
        name -> cost, without that of the gap path.
    """

    ends: Pair
    points: Floats
    terms: dict[str, float]
    _gap_paths: GapPaths = field(repr=False, compare=False)

    @property
    def gap_cost(self) -> GapCost:
        """The cost of the gap path; measured now unless the connection was considered when ends were joined."""
        return self._gap_paths.cost(self.ends)

    @property
    def cost(self) -> float:
        """The sum of all terms and of the cost of the gap path."""
        return sum(self.terms.values()) + sum(self.gap_cost)


@dataclass(frozen=True)
class MergeDecision:
    """One connection that was made.

    Attributes
    ----------
    chosen
        the two ends that were joined.
    runner_up
        the cheapest other pair that has one of the two ends, by its straight connection; None where none is allowed.
    confidence
        0 to 1.
    kept
        the connection is in an assembly that was kept.
    """

    chosen: Candidate
    runner_up: Candidate | None
    confidence: float
    kept: bool = True


@dataclass(frozen=True)
class DroppedChain:
    """A chain that is in no assembly that was kept, and the setting that dropped it: "merge.chains" or "merge.min_length"."""

    chain: Chain
    setting: str


@dataclass(frozen=True)
class Merged:
    """What merging made: the assemblies, longest first, its connections, the cheapest first, and the chains it dropped."""

    assemblies: list[Assembly]
    decisions: tuple[MergeDecision, ...] = ()
    dropped: tuple[DroppedChain, ...] = ()


def record_decisions(
    links: Sequence[Link],
    confidence: Sequence[float],
    kept: Sequence[bool],
    terms: dict[str, Floats],
    alternatives: Floats,
    gap_paths: GapPaths,
) -> tuple[MergeDecision, ...]:
    """Return the records of connections, the cheapest first.

    Parameters
    ----------
    links
        the connections.
    confidence, kept
        of each connection.
    terms
        name -> (E, E), cost of each pair of ends.
    alternatives
        (E, E), cost of each pair with its straight connection, in the upper triangle; infinite where not allowed.
    gap_paths
        of the ends.
    """
    symmetric = np.minimum(alternatives, alternatives.T)
    points, names = gap_paths.ends.points, ends_of(len(alternatives) // 2)

    def candidate(a: int, b: int) -> Candidate:
        a, b = min(a, b), max(a, b)
        costs = {name: float(term[a, b]) for name, term in terms.items()}
        return Candidate((names[a], names[b]), points[[a, b]], costs, gap_paths)

    records = []
    for i in sorted(range(len(links)), key=lambda i: links[i].cost):
        a, b = links[i].first.index, links[i].second.index
        others = symmetric[[a, b]]
        others[0, b] = others[1, a] = np.inf
        cheapest = int(np.argmin(others))
        runner_up = (
            candidate((a, b)[cheapest // len(symmetric)], cheapest % len(symmetric))
            if np.isfinite(others.flat[cheapest])
            else None
        )
        records.append(MergeDecision(candidate(a, b), runner_up, confidence[i], kept[i]))
    return tuple(records)
