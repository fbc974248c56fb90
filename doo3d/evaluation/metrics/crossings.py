"""Where true cables cross in the view, and whether a detection says rightly which of them is on top."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...geometry.intersections import PolylineSet, find_intersections
from ...types import Bools, Chain, Crossing, Floats, Ints, SegmentRef
from ..scenes.model import Truth
from .alignment import Walk

NEIGHBOURS = 4.0  # radii along a cable; nearer places of it are one place, which does not cross itself
NEAR_RADII = 5.0  # a crossing that was found is the true one within so many radii and a segment along both strands
NEVER = 1e6  # m, instead of infinity, which the assignment does not take

View = Callable[[Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class TrueCrossings:
    """C crossings of true cables. cable, arc : (C, 2), upper strand first; m along the cable. seen : (C,) bool, the upper is."""

    cable: Ints
    arc: Floats
    seen: Bools


def from_camera(points: Floats) -> tuple[Floats, Floats]:
    """Points (N, 3) m of the camera frame as the camera sees them: (N, 2) on the plane z = 1, and their distance (N,)."""
    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    return points[:, :2] / z[:, None], points[:, 2]


def true_crossings(truths: Sequence[Truth], view: View = from_camera) -> TrueCrossings:
    """Every place where the axes of cables cross in the view; the upper one is the nearer there."""
    if not truths:
        return TrueCrossings(np.zeros((0, 2), dtype=int), np.zeros((0, 2)), np.zeros(0, dtype=bool))
    closed = [truth.closed for truth in truths]
    ways = [np.concatenate((truth.axis, truth.axis[:1])) if truth.closed else truth.axis for truth in truths]
    seen = [np.ones(len(way)) if truth.seen is None else truth.seen[np.arange(len(way)) % len(truth.axis)]
            for truth, way in zip(truths, ways, strict=True)]  # fmt: skip
    flat, away = zip(*map(view, ways), strict=True)
    found = find_intersections(flat, closed)
    lines = PolylineSet.from_polylines([np.column_stack(both) for both in zip(away, seen, strict=True)], closed)
    there = lines.interpolate(found.chain, found.segment + found.t)
    arc = (found.segment + found.t) * np.array([truth.spacing for truth in truths])[found.chain]
    cable, upper = found.chain, (there[:, 1, 0] < there[:, 0, 0]).astype(int)
    order = np.column_stack((upper, 1 - upper))
    cable, arc = np.take_along_axis(cable, order, axis=1), np.take_along_axis(arc, order, axis=1)
    shown = np.take_along_axis(there[:, :, 1], order, axis=1)[:, 0] > 0
    gap = [_gap(truths[a], *arcs) if a == b else np.inf for (a, b), arcs in zip(cable.tolist(), arc.tolist(), strict=True)]
    apart = np.array(gap) > NEIGHBOURS * np.array([truth.radius for truth in truths])[cable[:, 0]]
    return TrueCrossings(cable[apart], arc[apart], shown[apart])


def _gap(truth: Truth, one: float, other: float) -> float:
    """m along the cable from one arc to another, the shorter way round a ring."""
    gap = abs(one - other)
    return min(gap % truth.length, -gap % truth.length) if truth.closed else gap


def count_right(
    found: Sequence[Crossing], chains: Sequence[Chain], walks: Sequence[Walk], truths: Sequence[Truth], true: TrueCrossings
) -> tuple[int, int]:
    """How many of the true crossings that are seen were found with the right strand on top, and how many found are none.

    walks : of each of the chains along the cables.
    """
    miss = np.full((len(true.cable), len(found), 2), NEVER)
    for k, crossing in enumerate(found):
        sides = [_arc(walks[side.chain], side) for side in (crossing.upper, crossing.lower)]
        if sides[0] is None or sides[1] is None:
            continue
        slack = chains[crossing.upper.chain].segment_length
        for c in range(len(miss)):
            for flip, pair in enumerate(((sides[0], sides[1]), (sides[1], sides[0]))):
                miss[c, k, flip] = _miss(truths, true, c, pair, slack)
    rows, columns = linear_sum_assignment(miss.min(axis=2))
    paired = miss[rows, columns].min(axis=1) < NEVER
    right = paired & (miss[rows, columns, 0] <= miss[rows, columns, 1]) & true.seen[rows]
    return int(right.sum()), len(found) - int(paired.sum())


def _arc(walk: Walk, place: SegmentRef) -> tuple[int, float] | None:
    """The cable and the arc in m of the middle of a segment; None where the chain follows nothing."""
    joint = place.segment + 0.5
    for track in walk.tracks:
        if track.joints[0] - 0.5 <= joint <= track.joints[-1] + 0.5:
            return track.cable, float(np.interp(joint, track.joints, track.arcs))
    return None


def _miss(truths: Sequence[Truth], true: TrueCrossings, c: int, pair: tuple[tuple[int, float], ...], slack: float) -> float:
    """How far, m, the places of a pair lie from the strands of a true crossing, upper first; NEVER when not near."""
    total = 0.0
    for (cable, arc), is_cable, is_arc in zip(pair, true.cable[c], true.arc[c], strict=True):
        gap = _gap(truths[cable], arc, is_arc)
        if cable != is_cable or gap > NEAR_RADII * truths[cable].radius + slack:
            return NEVER
        total += gap
    return total
