"""Find where true cables cross in the view, and count the crossings detected with the right strand on top."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...geometry.curves import Curves
from ...geometry.intersections import find_intersections
from ...types import Bools, Chain, Crossing, Floats, Ints, SegmentRef
from ..scenes.model import Truth
from .alignment import ChainAlignment
from .observed import Observed
from .record import Metric, parts, share

MIN_SELF_CROSSING_RADII = 4.0
"""Least length along a cable, in radii, between the two passes of a crossing with itself."""

MAX_OFFSET_RADII = 5.0
"""Greatest distance, in radii and in addition to a segment, from a detected crossing to the true one along each strand."""

NO_MATCH = 1e6
"""Cost in m of an impossible match; the assignment solver does not accept infinity."""


@dataclass(frozen=True)
class TrueCrossings:
    """The C places where the axes of true cables cross in the camera's image.

    Attributes
    ----------
    cable
        (C, 2) int, indices of the upper and of the lower cable. The upper one is nearer to the camera. Both are equal where a
        cable crosses itself.
    arc
        (C, 2) m, arc length at which the crossing lies along the upper and along the lower cable.
    seen
        (C,) bool, whether the camera sees the upper cable at the crossing.
    """

    cable: Ints
    arc: Floats
    seen: Bools


def true_crossings(truths: Sequence[Truth]) -> TrueCrossings:
    """Find all places where the axes of cables cross in the camera's image.

    A cable's crossing with itself counts only if its two passes are more than 4 radii apart along the cable.

    Parameters
    ----------
    truths
        the cables, m, in the camera's optical frame; a cable whose `seen` is None counts as seen all along.

    Returns
    -------
    TrueCrossings
        cables, positions and visibility of each crossing; of length 0 if there are none.
    """
    if not truths:
        return TrueCrossings(np.zeros((0, 2), dtype=int), np.zeros((0, 2)), np.zeros(0, dtype=bool))
    axes = [truth.line for truth in truths]
    seen = [_seen_samples(truth, len(axis)) for truth, axis in zip(truths, axes, strict=True)]
    values = [np.column_stack((_project(axis), each)) for axis, each in zip(axes, seen, strict=True)]
    curves = Curves.of(values, [truth.closed for truth in truths])
    intersections = find_intersections(curves)
    at_crossing = curves.interpolate(intersections.chain, intersections.segment + intersections.t)[..., 2:]
    arc = (intersections.segment + intersections.t) * np.array([truth.spacing for truth in truths])[intersections.chain]
    cable, upper = intersections.chain, (at_crossing[:, 1, 0] < at_crossing[:, 0, 0]).astype(int)
    order = np.column_stack((upper, 1 - upper))
    cable, arc = np.take_along_axis(cable, order, axis=1), np.take_along_axis(arc, order, axis=1)
    upper_seen = np.take_along_axis(at_crossing[:, :, 1], order, axis=1)[:, 0] > 0
    gaps = [_arc_gap(truths[a], *arcs) if a == b else np.inf for (a, b), arcs in zip(cable.tolist(), arc.tolist(), strict=True)]
    apart = np.array(gaps) > MIN_SELF_CROSSING_RADII * np.array([truth.radius for truth in truths])[cable[:, 0]]
    return TrueCrossings(cable[apart], arc[apart], upper_seen[apart])


def _project(points: Floats) -> Floats:
    """Return points (N, 3) m of the camera frame as (x / z, y / z, depth in m), (N, 3)."""
    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    return np.column_stack((points[:, :2] / z[:, None], points[:, 2]))


def _seen_samples(truth: Truth, count: int) -> Floats:
    """Return for each of the first `count` axis samples 1 if it is seen, else 0; a closed axis is repeated."""
    return np.ones(count) if truth.seen is None else truth.seen[np.arange(count) % len(truth.axis)].astype(float)


def _arc_gap(truth: Truth, a: float, b: float) -> float:
    """Return the distance in m along the cable between two arc lengths, the shorter way around a closed cable."""
    gap = abs(a - b)
    return min(gap % truth.length, -gap % truth.length) if truth.closed else gap


def count_crossings(
    detected: Sequence[Crossing],
    chains: Sequence[Chain],
    alignments: Sequence[ChainAlignment],
    truths: Sequence[Truth],
    true: TrueCrossings,
) -> tuple[int, int]:
    """Count the detected crossings that are correct, and those that match no true crossing.

    Detected and true crossings are matched one to one. They can match if, on both cables, they are at most 5 radii plus one
    segment length apart, measured along the cable.

    Parameters
    ----------
    detected
        the detected crossings.
    chains
        the detected chains, to which the crossings refer by index.
    alignments
        the alignment of each chain with the true cables, in the order of `chains`, from `align_chain`.
    truths
        the true cables.
    true
        the crossings of the true cables, from `true_crossings`.

    Returns
    -------
    correct : number of true crossings that match a detected one with the right cable on top. Only those count whose upper cable
        is visible at the crossing.
    extra : number of detected crossings that match no true one, whichever cable is on top.
    """
    offsets = np.full((len(true.cable), len(detected), 2), NO_MATCH)
    for k, crossing in enumerate(detected):
        sides = [_position(alignments[side.chain], side) for side in (crossing.upper, crossing.lower)]
        if sides[0] is None or sides[1] is None:
            continue
        slack = chains[crossing.upper.chain].segment_length
        for c in range(len(offsets)):
            for flip, pair in enumerate(((sides[0], sides[1]), (sides[1], sides[0]))):
                offsets[c, k, flip] = _offset(truths, true, c, pair, slack)
    rows, columns = linear_sum_assignment(offsets.min(axis=2))
    matched = offsets[rows, columns].min(axis=1) < NO_MATCH
    correct = matched & (offsets[rows, columns, 0] <= offsets[rows, columns, 1]) & true.seen[rows]
    return int(correct.sum()), len(detected) - int(matched.sum())


def _position(alignment: ChainAlignment, ref: SegmentRef) -> tuple[int, float] | None:
    """Return the cable of a segment's middle and the arc length in m there; None if it is on no cable."""
    joint = ref.segment + 0.5
    for stretch in alignment.stretches:
        if stretch.joints[0] - 0.5 <= joint <= stretch.joints[-1] + 0.5:
            return stretch.cable, float(np.interp(joint, stretch.joints, stretch.arcs))
    return None


def _offset(truths: Sequence[Truth], true: TrueCrossings, c: int, pair: tuple[tuple[int, float], ...], slack: float) -> float:
    """Return the total distance in m of a pair of positions from the strands of true crossing c.

    Parameters
    ----------
    truths, true
        the cables, and their crossings.
    c
        index of the true crossing.
    pair
        cable and arc in m of the upper and of the lower strand.
    slack
        m that each position may be off in addition to MAX_OFFSET_RADII; NO_MATCH is returned beyond that.
    """
    total = 0.0
    for (cable, arc), true_cable, true_arc in zip(pair, true.cable[c], true.arc[c], strict=True):
        gap = _arc_gap(truths[cable], arc, true_arc)
        if cable != true_cable or gap > MAX_OFFSET_RADII * truths[cable].radius + slack:
            return NO_MATCH
        total += gap
    return total


def measure(match: Observed) -> dict[str, Any]:
    """Return the numbers of true crossings whose upper cable is seen, of those detected correctly, and of false crossings."""
    true = true_crossings(match.truths if match.crossings is not None else ())
    correct, extra = count_crossings(match.crossings or (), match.chains, match.alignments, match.truths, true)
    return {"crossings": int(true.seen.sum()), "crossings_correct": correct, "crossings_extra": extra}


METRIC = Metric(measure, (share(("upper", "strand"), 15, "crossings", parts("crossings", right="crossings_correct")),))
