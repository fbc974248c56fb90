"""The chains of one frame, judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..types import Chain, Crossing
from ..types.results import kept_crossings
from .evidence import Evidence

CERTAIN = 0.7
"""Confidence of a frame from which on the usual one is enough: between this and 0.85 others made one of 396 frames right."""


@dataclass(frozen=True)
class Verdict:
    """The chains of one frame, judged.

    Attributes
    ----------
    chains
        chains along the object's axis with their confidence, longest first.
    crossings
        where strands cross in the view, and which is on top.
    evidence
        for each chain, what speaks against it; its confidence comes from that.
    unchosen
        chains found besides the wanted number (`merge.chains`) of most probable ones.
    """

    chains: list[Chain]
    crossings: tuple[Crossing, ...] = ()
    evidence: tuple[Evidence, ...] = ()
    unchosen: tuple[Chain, ...] = ()

    def of_most_probable(self, count: int) -> Verdict:
        """Return the verdict with the wanted number of most probable chains, and the others as `unchosen`."""
        place = {k: i for i, k in enumerate(most_probable_chains(self.chains, count))}
        return Verdict(
            [self.chains[k] for k in place],
            kept_crossings(self.crossings, place),
            tuple(self.evidence[k] for k in place),
            tuple(chain for k, chain in enumerate(self.chains) if k not in place),
        )

    def with_evidence(self, evidence: Sequence[Evidence]) -> Verdict:
        """Return the verdict with other evidence, and the confidence that follows from it."""
        chains = [replace(chain, confidence=each.confidence) for chain, each in zip(self.chains, evidence, strict=True)]
        return replace(self, chains=chains, evidence=tuple(evidence))


def most_probable_chains(chains: Sequence[Chain], count: int) -> list[int]:
    """Return the indices of the most probable chains, in ascending order; of those at CERTAIN (0.7) or above, the longest.

    There, differences in confidence are noise, and a long piece of the object is worth more than a short one.

    chains : the chains of one frame. count : number of chains wanted; all are returned if there are fewer.
    """
    order = sorted(range(len(chains)), key=lambda k: (-min(chains[k].confidence, CERTAIN), -chains[k].length))
    return sorted(order[:count])
