"""Align chains with the true cables: find the position of each joint along a cable, and the stretches without a jump."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import binary_closing
from scipy.spatial.distance import cdist

from ...geometry.curve_alignment import SLACK_SHARE, Candidates, nearest_samples
from ...geometry.curves import runs
from ...types import Bools, Chain, Floats, Ints
from ..scenes.model import Truth

TOLERANCE_RADII, MIN_TOLERANCE = 2.5, 0.010
"""A joint is on a cable of radius r within max(2.5 r, 10 mm) of its axis."""

HIDDEN_RUN_TOLERANCE = 0.2
"""In a hidden run, a joint is also on the cable within this fraction of the run's length from the axis."""

MIN_SEEN_LENGTH = 0.002
"""Length in m of the shortest seen stretch that splits a hidden run in two."""

MISFIT_COST = 6.25
"""Cost of a joint at the edge of its tolerance; three of them cost about as much as a jump."""

SLACK_RADII, MIN_SLACK = 2.0, 0.005
"""In a step, the lengths along cable and chain may differ by max(2 r, 5 mm) in addition to a fraction of the step."""


@dataclass(frozen=True)
class Stretch:
    """A run of successive joints of a chain that follows one true cable in one direction, without a jump.

    Attributes
    ----------
    cable
        index of the cable among the true cables.
    joints
        (K,) int, indices of its K joints in the chain; joints on no cable are left out.
    arcs
        (K,) m, arc length along the cable at which each joint lies. On a closed cable, the values continue above the cable's
        length or below 0 where the stretch passes the cable's first point.
    """

    cable: int
    joints: Ints
    arcs: Floats


@dataclass(frozen=True)
class ChainAlignment:
    """The positions of a chain's joints on the true cables.

    Attributes
    ----------
    stretches
        the runs of joints that follow one cable in one direction, in the order of the chain.
    connections
        number of pairs of successive joints on cables; joints on no cable are skipped.
    wrong
        number of these pairs where the chain jumps along or between cables, plus the number of joints where it turns back.
    """

    stretches: tuple[Stretch, ...] = ()
    connections: int = 0
    wrong: int = 0


def hidden_runs(truth: Truth) -> list[tuple[int, int]]:
    """Return the hidden stretches of a cable as (first, last) indices of axis samples, both included.

    Seen stretches shorter than 2 mm do not split a hidden run. The list is empty if all of the cable is seen or `truth.seen` is
    None. On a closed cable, the indices may exceed the last one: take them modulo the number of axis samples.
    """
    if truth.seen is None or truth.seen.all():
        return []
    gap = max(1, round(MIN_SEEN_LENGTH / truth.spacing))
    start = int(np.argmax(truth.seen)) if truth.closed else 0
    hidden = np.roll(~truth.seen, -start)
    padded = np.pad(hidden, gap)
    hidden = hidden | binary_closing(padded, np.ones(gap + 1, dtype=bool))[gap:-gap]
    return [(first + start, end - 1 + start) for first, end in runs(hidden)]


def axis_tolerance(truth: Truth) -> Floats:
    """Return the distance in m from each of the P axis samples within which a chain is on the cable, (P,).

    The distance is max(2.5 radii, 10 mm); in a hidden run, a fifth of the length of the run if that is more.
    """
    result = np.full(len(truth.axis), max(TOLERANCE_RADII * truth.radius, MIN_TOLERANCE))
    for first, last in hidden_runs(truth):
        index = np.arange(first, last + 1) % len(result)
        result[index] = np.maximum(result[index], HIDDEN_RUN_TOLERANCE * (last - first + 1) * truth.spacing)
    return result


def align_chain(chain: Chain, truths: tuple[Truth, ...]) -> ChainAlignment:
    """Find the position of each joint of a chain on the true cables, and where the chain jumps or turns back.

    Parameters
    ----------
    chain
        the chain, joints in m, in the frame of the cables.
    truths
        the true cables; the result refers to them by index.

    Returns
    -------
    ChainAlignment
        the stretches that follow one cable in one direction, and the numbers of connections and of wrong ones. If no joint is on
        a cable, there are no stretches and the numbers are 0.
    """
    if not truths:
        return ChainAlignment()
    candidates = _candidates(chain, truths)
    chosen = candidates.choose(MISFIT_COST)
    if not len(chosen):
        return ChainAlignment()
    joint, cable, arc = candidates.point[chosen], candidates.curve[chosen], candidates.arc[chosen]
    step = _arc_steps(truths, cable, arc)
    broken = _is_jump(chain, truths, joint, cable, step)
    stretches: list[Stretch] = []
    wrong = int(broken.sum())
    for part in np.split(np.arange(len(joint)), np.flatnonzero(broken) + 1):
        arcs = arc[part[0]] + np.concatenate(([0.0], np.cumsum(step[part[:-1]])))
        turns = _turning_points(arcs, max(1.2 * truths[cable[part[0]]].radius, 0.6 * chain.segment_length))
        wrong += len(turns)
        for a, b in pairwise([0, *turns, len(part) - 1]):
            stretches.append(Stretch(int(cable[part[0]]), joint[part[a : b + 1]], arcs[a : b + 1]))
    return ChainAlignment(tuple(stretches), len(joint) - 1, wrong)


def _candidates(chain: Chain, truths: tuple[Truth, ...]) -> Candidates:
    """Return, for each joint, all positions on cables within tolerance."""
    parts = []
    for k, truth in enumerate(truths):
        distances, tolerance = cdist(chain.joints, truth.axis), axis_tolerance(truth)
        half_window = int(_min_slack(truth) / truth.spacing)
        joint, sample = nearest_samples(distances, tolerance, half_window, "wrap" if truth.closed else "nearest")
        parts.append((joint, np.full(len(joint), k), truth.arcs[sample], distances[joint, sample], tolerance[sample]))
    joints, cables, arcs, distance, limits = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.argsort(joints, kind="stable")
    cables = cables[order]
    return Candidates(
        point=joints[order],
        curve=cables,
        arc=arcs[order],
        distance=distance[order],
        tolerance=limits[order],
        slack=np.array([_min_slack(truth) for truth in truths])[cables],
        direction=np.zeros(len(cables), dtype=int),
        period=np.array([truth.length if truth.closed else np.inf for truth in truths])[cables],
        path_position=joints[order].astype(float),
        path_unit=chain.segment_length,
    )


def _min_slack(truth: Truth) -> float:
    """Return the least allowed difference in m between a step along the cable and one along the chain."""
    return max(SLACK_RADII * truth.radius, MIN_SLACK)


def _arc_steps(truths: tuple[Truth, ...], cable: Ints, arc: Floats) -> Floats:
    """Return the signed steps in m along the cables from each joint to the next, the shorter way round a closed cable."""
    step = np.diff(arc)
    length = np.array([truth.length for truth in truths])[cable[:-1]]
    closed = np.array([truth.closed for truth in truths])[cable[:-1]]
    return np.asarray(np.where(closed, (step + length / 2) % length - length / 2, step))


def _is_jump(chain: Chain, truths: tuple[Truth, ...], joint: Ints, cable: Ints, step: Floats) -> Bools:
    """Return which steps change the cable, or move farther along it than the chain is long there."""
    run = np.asarray(np.diff(joint) * chain.segment_length, dtype=float)
    slack = SLACK_SHARE * run + np.array([_min_slack(truth) for truth in truths])[cable[:-1]]
    return np.asarray((cable[1:] != cable[:-1]) | (np.abs(step) - run > slack))


def _turning_points(arcs: Floats, min_reversal: float) -> list[int]:
    """Return the indices at which the arc lengths turn back by more than `min_reversal` (m)."""
    turns: list[int] = []
    low = high = 0
    direction = 0
    for i, arc in enumerate(arcs):
        low = i if arc < arcs[low] else low
        high = i if arc > arcs[high] else high
        reversal = arc - arcs[low] if direction <= 0 else arcs[high] - arc
        if direction == 0 and max(arc - arcs[low], arcs[high] - arc) > min_reversal:
            direction = 1 if arc - arcs[low] > min_reversal else -1
            low = high = i
        elif direction != 0 and reversal > min_reversal:
            turns.append(low if direction < 0 else high)
            direction, low, high = -direction, i, i
    return turns
