"""Match the chains of one frame with its true cables: the input of all metrics of a frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...types import Camera, Chain, Crossing
from ..scenes.model import Truth
from .alignment import ChainAlignment, align_chain
from .distances import ChainDistances, measure_distances
from .image import project


@dataclass(frozen=True)
class Observed:
    """The detected chains of a frame, and its true cables (the objects).

    Attributes
    ----------
    chains
        the detected chains, m, in the camera's optical frame.
    truths
        the true cables in the same frame; a cable whose `seen` is None counts as seen all along.
    crossings
        the detected crossings of the chains in the camera's image; None leaves crossings out of the score (all counts 0).
    camera
        the intrinsics, to score the chains in the image alone, too; None leaves this out.
    """

    chains: tuple[Chain, ...]
    truths: tuple[Truth, ...]
    crossings: Sequence[Crossing] | None = None
    camera: Camera | None = None

    @cached_property
    def alignments(self) -> list[ChainAlignment]:
        """The alignment of each chain with the objects."""
        return [align_chain(chain, self.truths) for chain in self.chains]

    @cached_property
    def distances(self) -> list[ChainDistances]:
        """The distances of each chain's points from the objects that it follows."""
        both = zip(self.chains, self.alignments, strict=True)
        return [measure_distances(chain, alignment, self.truths) for chain, alignment in both]

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """(chain, object) indices, matched one to one so that the total common length is greatest."""
        overlap = np.zeros((len(self.chains), len(self.truths)))
        for c, alignment in enumerate(self.alignments):
            for stretch in alignment.stretches:
                overlap[c, stretch.cable] += len(stretch.joints) * self.chains[c].segment_length
        return [(int(c), int(t)) for c, t in zip(*linear_sum_assignment(-overlap), strict=True) if overlap[c, t] > 0]

    @property
    def matched(self) -> list[tuple[Chain, Truth]]:
        """The matched chains with their objects."""
        return [(self.chains[c], self.truths[t]) for c, t in self.pairs]

    @cached_property
    def coverage(self) -> list[float]:
        """The fraction, 0 to 1, of each object that its chain follows; 0 where it has none."""
        result = [0.0] * len(self.truths)
        for c, t in self.pairs:
            result[t] = covered_fraction(self.alignments[c], self.truths[t], t)
        return result

    @cached_property
    def in_image(self) -> tuple[Observed, float] | None:
        """The frame projected into the image, and m per px at the cables' median depth; None without camera or objects."""
        if self.camera is None or not self.truths:
            return None
        view = project(self.chains, self.truths, self.camera)
        return Observed(view.chains, view.truths), view.metres_per_pixel


def covered_fraction(alignment: ChainAlignment, truth: Truth, cable: int) -> float:
    """Return the fraction, 0 to 1, of a cable's length that a chain follows.

    Parameters
    ----------
    alignment
        the alignment of the chain with all true cables, from `align_chain`.
    truth
        the cable.
    cable
        index of `truth` among the true cables.
    """
    arcs = truth.arcs
    covered = np.zeros(len(arcs), dtype=bool)
    for stretch in alignment.stretches:
        if stretch.cable != cable or len(stretch.arcs) < 2:
            continue
        low, high = stretch.arcs.min(), stretch.arcs.max()
        for turn in (-1, 0, 1) if truth.closed else (0,):
            covered |= (arcs + turn * truth.length >= low - 1e-9) & (arcs + turn * truth.length <= high + 1e-9)
    return float(covered.mean())
