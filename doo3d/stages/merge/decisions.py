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
    """Two chain ends that are or could be connected, and what the connection costs.

    Costs are in cost units: 1 per mm of gap (1 per px in 2-D).

    Attributes
    ----------
    ends
        the two ends, the lower first. Chain numbers are indices in the list of chains that pruning left.
    points
        (2, D) m (px in 2-D), the positions of the two ends.
    terms
        name of the term -> cost, without the cost of the gap path.
    """

    ends: Pair
    points: Floats
    terms: dict[str, float]
    _gap_paths: GapPaths = field(repr=False, compare=False)

    @property
    def gap_cost(self) -> GapCost:
        """The cost of the gap path, in free and in unknown space; measured on first access if merging did not need it."""
        return self._gap_paths.cost(self.ends)

    @property
    def cost(self) -> float:
        """The whole cost of the connection: all terms and the cost of the gap path."""
        return sum(self.terms.values()) + sum(self.gap_cost)


@dataclass(frozen=True)
class MergeDecision:
    """One connection that was made, and its cheapest alternative.

    Attributes
    ----------
    chosen
        the two ends that were connected.
    runner_up
        the cheapest other pair that includes one of the two ends, compared by their straight connections; None if there is none.
    confidence
        confidence of the connection, 0 to 1.
    kept
        False if the connection is part of an object that was dropped in the end.
    """

    chosen: Candidate
    runner_up: Candidate | None
    confidence: float
    kept: bool = True


@dataclass(frozen=True)
class DroppedChain:
    """A chain that is part of no object that was kept.

    Attributes
    ----------
    chain
        the dropped chain.
    setting
        the setting that dropped it: "merge.chains" (too many objects) or "merge.min_length" (object too short).
    """

    chain: Chain
    setting: str


@dataclass(frozen=True)
class Merged:
    """The result of merging.

    Attributes
    ----------
    assemblies
        one per object: its pieces in order, with the paths across the gaps. Longest first.
    decisions
        the connections made, the cheapest first.
    dropped
        the chains that are part of no assembly.
    """

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
    """Return a record of each connection with its cost and its cheapest alternative, the cheapest first.

    Parameters
    ----------
    links
        the chosen connections.
    confidence
        of each connection, 0 to 1.
    kept
        for each connection, whether it is part of an object that was kept.
    terms
        name of the term -> (E, E), cost of each pair of ends.
    alternatives
        (E, E) cost units, of each pair by its straight connection. Only the upper triangle counts; infinite where a connection is
        not allowed.
    gap_paths
        the gap paths of all pairs of ends, with their costs.
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
