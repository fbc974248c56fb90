"""Score the chains of one frame against the truth, by the strict rule of Keipour et al. (RA-L 2022)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...types import Camera, Chain, Crossing
from ..scenes.model import Truth
from .alignment import ChainAlignment, align_chain, overlaps
from .crossings import count_crossings, true_crossings
from .distances import ChainDistances, end_error, measure_distances, rms_mm
from .image import project
from .merges import wrong_merges
from .nodes import node_error
from .occlusions import occlusions, passed_occlusions

MIN_COVERAGE, MAX_OFF_FRACTION = 0.94, 0.03
"""Least fraction of an object that its chain must follow; fraction of a chain off its object that is too much."""


@dataclass(frozen=True)
class FrameScore:
    """The score of one frame: its detected chains against its true cables (the objects).

    Attributes
    ----------
    correct
        whether the frame is correct by the strict rule of Keipour et al. (RA-L 2022): one chain for each object, no wrong
        connection, at least 94 % of each object covered, and less than 3 % of each chain off its object.
    reasons
        why the frame is not correct, a phrase for each broken rule; empty if it is correct.
    objects, chains
        numbers of true cables and of detected chains.
    occlusions, occlusions_correct
        number of stretches of 8 mm or more where the camera does not see the cable but sees it on both sides, and number of those
        that a chain passes correctly.
    connections, connections_wrong
        number of pairs of successive joints on cables, and number of those where the chain jumps or turns back.
    rms_seen, rms_hidden
        mm, RMS distance of the chains from the true axis, where the camera sees the cable and where it is hidden; NaN if there
        is no such part.
    radius_ratio
        detected over true radius, mean over objects with a chain; NaN if there are none.
    end_error
        mm, mean distance of chain ends from the tips of open objects; NaN if no open object has a chain.
    coverage
        fraction, 0 to 1, of an object that its chain follows, least over all objects; 1 if there are no objects.
    off_fraction
        fraction, 0 to 1, of a chain that is off its object, greatest over all chains; 0 if there are no chains.
    merges, merges_wrong
        number of places where the detection joined two pieces to one chain, and number of those that are wrong.
    node_error
        mm, mean distance of joint i of a chain from node i of its object, with as many evenly spaced nodes on the object as the
        chain has joints; NaN if no object has a chain.
    crossings, crossings_correct, crossings_extra
        number of places where true cables cross in the image with the upper one seen, number of those detected with the right
        cable on top, and number of detected crossings that do not exist.
    image_correct
        whether the frame is right in the image: the same rule for the same chains and cables, projected into the image, with
        distances in px as they are at the median depth of the cables; None if the camera is unknown.
    image_rms
        px, RMS distance of the projected chains from the projected axes where they are seen; NaN if the camera is unknown.
    """

    correct: bool
    reasons: tuple[str, ...]
    objects: int
    chains: int
    occlusions: int
    occlusions_correct: int
    connections: int
    connections_wrong: int
    rms_seen: float
    rms_hidden: float
    radius_ratio: float
    end_error: float
    coverage: float
    off_fraction: float
    merges: int = 0
    merges_wrong: int = 0
    node_error: float = float("nan")
    crossings: int = 0
    crossings_correct: int = 0
    crossings_extra: int = 0
    image_correct: bool | None = None
    image_rms: float = float("nan")


@dataclass(frozen=True)
class _Match:
    """Chains aligned with the objects of a frame, and matched one to one.

    pairs : (chain, object) indices. coverage : per object, 0 where it has no chain.
    """

    chains: tuple[Chain, ...]
    truths: tuple[Truth, ...]
    alignments: list[ChainAlignment]
    distances: list[ChainDistances]
    pairs: list[tuple[int, int]]
    coverage: list[float]

    @property
    def connections_wrong(self) -> int:
        return sum(alignment.wrong for alignment in self.alignments)

    @property
    def off_fraction(self) -> float:
        return max((distances.off_fraction for distances in self.distances), default=0.0)


def score(
    chains: Sequence[Chain],
    truths: Sequence[Truth],
    crossings: Sequence[Crossing] | None = None,
    camera: Camera | None = None,
) -> FrameScore:
    """Score the chains of one frame against its true cables.

    Parameters
    ----------
    chains
        the detected chains, m, in the camera's optical frame. Their order and their directions do not matter, except that
        `crossings` refers to them by index.
    truths
        the true cables in the same frame; a cable whose `seen` is None counts as seen all along.
    crossings
        the detected crossings of the chains in the camera's image; None leaves crossings out of the score (all counts 0).
    camera
        the intrinsics, to score the chains in the image alone, too; None leaves this out.

    Returns
    -------
    FrameScore
        whether the frame is correct, the reasons if it is not, the counts of correct and wrong parts, and the errors in mm.
    """
    match = _match(tuple(chains), tuple(truths))
    runs = [(t, run) for t, truth in enumerate(match.truths) for run in occlusions(truth)]
    reasons = _reasons(match)
    true = true_crossings(match.truths if crossings is not None else ())
    crossings_correct, crossings_extra = count_crossings(crossings or (), match.chains, match.alignments, match.truths, true)
    pairs = [(match.chains[c], match.truths[t]) for c, t in match.pairs]
    image_correct, image_rms = (None, float("nan")) if camera is None else _score_in_image(chains, truths, camera)
    return FrameScore(
        correct=not reasons,
        reasons=reasons,
        objects=len(match.truths),
        chains=len(match.chains),
        occlusions=len(runs),
        occlusions_correct=passed_occlusions(match.chains, match.alignments, match.truths, runs),
        connections=sum(alignment.connections for alignment in match.alignments),
        connections_wrong=match.connections_wrong,
        rms_seen=rms_mm([part.distance[part.seen] for part in match.distances]),
        rms_hidden=rms_mm([part.distance[~part.seen] for part in match.distances]),
        radius_ratio=_mean([chain.radius / truth.radius for chain, truth in pairs]),
        end_error=_mean([end_error(chain, truth) for chain, truth in pairs if not truth.closed]),
        coverage=min(match.coverage, default=1.0),
        off_fraction=match.off_fraction,
        merges=sum(len(chain.connections) for chain in match.chains),
        merges_wrong=sum(wrong_merges(*both) for both in zip(match.chains, match.alignments, strict=True)),
        node_error=_mean([node_error(chain, truth) for chain, truth in pairs]),
        crossings=int(true.seen.sum()),
        crossings_correct=crossings_correct,
        crossings_extra=crossings_extra,
        image_correct=image_correct,
        image_rms=image_rms,
    )


def _score_in_image(chains: Sequence[Chain], truths: Sequence[Truth], camera: Camera) -> tuple[bool, float]:
    """Return whether projected chains are correct by the rule for a frame, and their RMS distance in px from the seen axes."""
    if not truths:
        return not chains, float("nan")
    view = project(chains, truths, camera)
    match = _match(view.chains, view.truths)
    distance = rms_mm([part.distance[part.seen] for part in match.distances]) / 1e3
    return len(view.chains) == len(chains) and not _reasons(match), distance / view.metres_per_pixel


def _match(chains: tuple[Chain, ...], truths: tuple[Truth, ...]) -> _Match:
    """Align chains with objects, and match them one to one by the greatest total length in common."""
    alignments = [align_chain(chain, truths) for chain in chains]
    overlap = overlaps(chains, alignments, len(truths))
    pairs = [(int(c), int(t)) for c, t in zip(*linear_sum_assignment(-overlap), strict=True) if overlap[c, t] > 0]
    coverage = [0.0] * len(truths)
    for c, t in pairs:
        coverage[t] = covered_fraction(alignments[c], truths[t], t)
    distances = [measure_distances(chain, alignment, truths) for chain, alignment in zip(chains, alignments, strict=True)]
    return _Match(chains, truths, alignments, distances, pairs, coverage)


def _reasons(match: _Match) -> tuple[str, ...]:
    """Return a phrase for each of the rules that the frame breaks."""
    chains, objects = len(match.chains), len(match.truths)
    coverage = min(match.coverage, default=1.0)
    reasons = []
    if chains != objects:
        reasons.append(f"{chains} chains for {objects} objects")
    if len(match.pairs) < min(chains, objects):
        reasons.append(f"{objects - len(match.pairs)} objects without a chain")
    if match.connections_wrong:
        reasons.append(f"{match.connections_wrong} wrong connections")
    if coverage < MIN_COVERAGE:
        reasons.append(f"{coverage:.0%} covered")
    if match.off_fraction >= MAX_OFF_FRACTION:
        reasons.append(f"{match.off_fraction:.0%} off")
    return tuple(reasons)


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


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")
