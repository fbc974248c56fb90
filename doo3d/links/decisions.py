"""The record of the links: each with its cost, term by term, and its cheapest alternative."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..geometry.assembly import Assembly
from ..types import Floats
from .ends import Link, Pair, ends_of
from .terms.gap_path import GapCost, GapPaths

TOO_MANY = "too many chains"
"""In place of a setting: the chain is not one of the longest, to which merging is limited."""


@dataclass(frozen=True)
class LinkCandidate:
    """Two chain ends that are or could be linked, and the cost of linking them.

    Costs are in cost units: 1 per mm of gap (1 per px in 2-D), plus angles in radians times their weights.

    Attributes
    ----------
    ends
        the two ends, that of the lower chain first. `End.chain` is an index in the list of chains that pruning left.
    points
        (2, D) m, D = 3 (in 2-D: px, D = 2), the positions of the two ends.
    terms
        name of the cost term, such as "distance" -> cost. The cost of the gap path is not among them.
    """

    ends: Pair
    points: Floats
    terms: dict[str, float]
    _gap_paths: GapPaths = field(repr=False, compare=False)

    @property
    def gap_cost(self) -> GapCost:
        """The cost of the path across the gap, in cost units (1 per mm, 1 per px in 2-D, times a weight of the settings).

        It has three parts, for the length in free space, in unknown space and over bare surface, and is computed on first access
        if merging did not need it.
        """
        return self._gap_paths.cost(self.ends)

    @property
    def cost(self) -> float:
        """The whole cost of the link in cost units: the sum of all terms and of the cost of the gap path."""
        return sum(self.terms.values()) + sum(self.gap_cost)


@dataclass(frozen=True)
class LinkDecision:
    """One link, and its cheapest alternative.

    Attributes
    ----------
    chosen
        the two ends that were linked.
    runner_up
        the cheapest other pair that includes one of the two ends; None if there is none. To find it, the gaps of all pairs are
        taken as straight.
    confidence
        confidence of the link, 0 to 1.
    kept
        False if the object that the link belongs to was dropped.
    """

    chosen: LinkCandidate
    runner_up: LinkCandidate | None
    confidence: float
    kept: bool = True


@dataclass(frozen=True)
class DroppedChain:
    """A chain that is part of no object that was kept.

    Attributes
    ----------
    joints
        (N + 1, D) m, D = 3 (in 2-D: px, D = 2), joints of the dropped chain.
    length
        m (px in 2-D), sum of its segments.
    setting
        the setting that dropped it: "merge.chains" (too many objects) or "merge.min_length" (object too short); or TOO_MANY, if
        it was left out before the ends were linked.
    """

    joints: Floats
    length: float
    setting: str


@dataclass(frozen=True)
class Merged:
    """The objects, each put together from chains, and a record of the links.

    Attributes
    ----------
    assemblies
        one per object, longest first: the chains of the object in order, with the paths across the gaps between them.
    record
        makes `decisions`, when they are first asked for.
    dropped
        the chains that are part of no assembly.
    notes
        messages to the user, one sentence each: that there were too many chains.
    is_refused
        True if fewer chains are wanted than are left, and the others could only be linked where the camera sees no object.
    """

    assemblies: list[Assembly]
    record: Callable[[], tuple[LinkDecision, ...]] = field(default=tuple, repr=False, compare=False)
    dropped: tuple[DroppedChain, ...] = ()
    notes: tuple[str, ...] = ()
    is_refused: bool = False

    @property
    def dropped_length(self) -> float:
        """The length of the chains dropped because of the wanted number of objects, m (px in 2-D)."""
        return sum(item.length for item in self.dropped if item.setting == "merge.chains")

    @cached_property
    def decisions(self) -> tuple[LinkDecision, ...]:
        """One record per link, the cheapest link first."""
        return self.record()


def record_decisions(
    links: Sequence[Link],
    confidence: Sequence[float],
    kept: Sequence[bool],
    terms: dict[str, Floats],
    alternatives: Floats,
    gap_paths: GapPaths,
) -> tuple[LinkDecision, ...]:
    """Return one record per link, the cheapest first, with its cost and its cheapest alternative.

    The alternative is the cheapest other link of one of its two ends; None if no other is allowed.

    Parameters
    ----------
    links
        the chosen links.
    confidence
        confidence of each link, 0 to 1.
    kept
        for each link, whether it is part of an object that was kept.
    terms
        name of the term -> (E, E) cost units, what the term adds to the cost of each pair of E ends.
    alternatives
        (E, E) cost units, cost of linking each pair of ends across a straight gap. Only entries [i, j] with i < j are used;
        infinite where a link is not allowed.
    gap_paths
        the gap paths of all pairs of ends, with their costs.
    """
    symmetric = np.minimum(alternatives, alternatives.T)
    points, names = gap_paths.ends.points, ends_of(len(alternatives) // 2)

    def candidate(a: int, b: int) -> LinkCandidate:
        a, b = min(a, b), max(a, b)
        costs = {name: float(term[a, b]) for name, term in terms.items()}
        return LinkCandidate((names[a], names[b]), points[[a, b]], costs, gap_paths)

    records = []
    for i in sorted(range(len(links)), key=lambda i: links[i].cost):
        a, b = links[i].rows
        others = symmetric[[a, b]]
        others[0, b] = others[1, a] = np.inf
        of_pair, other = divmod(int(np.argmin(others)), len(symmetric))
        runner_up = candidate((a, b)[of_pair], other) if np.isfinite(others[of_pair, other]) else None
        records.append(LinkDecision(candidate(a, b), runner_up, confidence[i], kept[i]))
    return tuple(records)
