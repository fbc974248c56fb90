"""Where along the true cables a chain goes: each joint's place, and the stretches it follows without a break."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import binary_closing, minimum_filter1d
from scipy.spatial.distance import cdist

from ...types import Bools, Chain, Floats, Ints
from ..scenes.model import Truth

NEAR_RADII, NEAR = 2.5, 0.010  # a joint belongs to a place on a cable within max(2.5 r, 10 mm) ...
NEAR_RUN = 0.2  # ... or within a fifth of the hidden run
FLICKER = 0.002  # m; a seen stretch shorter than this inside a hidden run does not part it
MISFIT, JUMP = 6.25, 20.0  # cost of a joint at the edge of what is near, and of a jump: three such joints are worth one


@dataclass(frozen=True)
class Track:
    """A stretch of a chain that follows one cable in one direction.

    cable : which. joints : (K,) indices of the chain's joints. arcs : (K,) m along the cable, running on past the
    seam of a ring.
    """

    cable: int
    joints: Ints
    arcs: Floats


@dataclass(frozen=True)
class Walk:
    """A whole chain along the true cables. connections : pairs of joints looked at; wrong : jumps and reversals."""

    tracks: tuple[Track, ...]
    connections: int
    wrong: int

    def overlap(self, cables: int, segment_length: float) -> Floats:
        """(cables,) m of the chain on each cable."""
        result = np.zeros(cables)
        for track in self.tracks:
            result[track.cable] += len(track.joints) * segment_length
        return result


def hidden_runs(truth: Truth) -> list[tuple[int, int]]:
    """(first, last) sample of every run that is not seen; on a ring, last may run on past the seam."""
    if truth.seen is None or truth.seen.all():
        return []
    gap = max(1, round(FLICKER / truth.spacing))
    start = int(np.argmax(truth.seen)) if truth.closed else 0
    hidden = np.roll(~truth.seen, -start)
    padded = np.pad(hidden, gap)
    hidden = hidden | binary_closing(padded, np.ones(gap + 1, dtype=bool))[gap:-gap]
    edges = np.flatnonzero(np.diff(np.concatenate(([0], hidden.astype(int), [0]))))
    return [(int(a) + start, int(b) - 1 + start) for a, b in edges.reshape(-1, 2)]


def tolerance(truth: Truth) -> Floats:
    """(P,) m: how far from each axis sample a chain may be and still follow the cable there."""
    result = np.full(len(truth.axis), max(NEAR_RADII * truth.radius, NEAR))
    for first, last in hidden_runs(truth):
        index = np.arange(first, last + 1) % len(result)
        result[index] = np.maximum(result[index], NEAR_RUN * (last - first + 1) * truth.spacing)
    return result


def follow(chain: Chain, truths: tuple[Truth, ...]) -> Walk:
    """The likeliest places of the joints along the cables, and where their order breaks.

    A joint near a crossing is near two strands; the places are chosen together (Viterbi), so that a chain that is a
    little off does not seem to jump to the other strand and back.
    """
    joint, cable, arc, misfit = _candidates(chain, truths)
    if len(joint) == 0:
        return Walk((), 0, 0)
    chosen = _likeliest(chain, truths, joint, cable, arc, misfit)
    joint, cable, arc = joint[chosen], cable[chosen], arc[chosen]
    step = _arc_steps(truths, cable, arc)
    broken = _is_jump(chain, truths, joint, cable, step)
    tracks: list[Track] = []
    wrong = int(broken.sum())
    for part in np.split(np.arange(len(joint)), np.flatnonzero(broken) + 1):
        along = arc[part[0]] + np.concatenate(([0.0], np.cumsum(step[part[:-1]])))
        turns = _turning_points(along, max(1.2 * truths[cable[part[0]]].radius, 0.6 * chain.segment_length))
        wrong += len(turns)
        bounds = [0, *turns, len(part) - 1]
        for a, b in pairwise(bounds):
            tracks.append(Track(int(cable[part[0]]), joint[part[a : b + 1]], along[a : b + 1]))
    return Walk(tuple(tracks), len(joint) - 1, wrong)


def _candidates(chain: Chain, truths: tuple[Truth, ...]) -> tuple[Ints, Ints, Floats, Floats]:
    """Every place that a joint may be at: joint, cable, arc in m, cost; in the order of the joints."""
    parts = []
    for k, truth in enumerate(truths):
        gap = cdist(chain.joints, truth.axis)
        window = 2 * int(max(2 * truth.radius, 0.005) / truth.spacing) + 1
        least = minimum_filter1d(gap, window, axis=1, mode="wrap" if truth.closed else "nearest")
        near = tolerance(truth)
        joint, sample = np.nonzero((gap == least) & (gap <= near))
        cost = MISFIT * (gap[joint, sample] / near[sample]) ** 2
        parts.append((joint, np.full(len(joint), k), truth.arcs[sample], cost))
    joint, cable, arc, cost = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.argsort(joint, kind="stable")
    return joint[order], cable[order], arc[order], cost[order]


def _likeliest(chain: Chain, truths: tuple[Truth, ...], joint: Ints, cable: Ints, arc: Floats, misfit: Floats) -> Ints:
    """The chosen candidate of each joint that has any."""
    groups = np.split(np.arange(len(joint)), np.flatnonzero(np.diff(joint)) + 1)
    total = misfit.copy()
    before = np.full(len(joint), -1)
    for last, this in pairwise(groups):
        pairs = (np.repeat(last, len(this)), np.tile(this, len(last)))
        change = _change(chain, truths, joint, cable, arc, pairs).reshape(len(last), len(this))
        sums = total[last][:, None] + change
        best = sums.argmin(axis=0)
        before[this] = last[best]
        total[this] += sums[best, np.arange(len(this))]
    chosen = [int(groups[-1][total[groups[-1]].argmin()])]
    while before[chosen[-1]] >= 0:
        chosen.append(int(before[chosen[-1]]))
    return np.array(chosen[::-1])


def _change(chain: Chain, truths: tuple[Truth, ...], joint: Ints, cable: Ints, arc: Floats, pairs: tuple[Ints, Ints]) -> Floats:
    """The cost of going from one candidate to another: how much longer or shorter the cable is than the chain there."""
    a, b = pairs
    length = np.array([truth.length for truth in truths])[cable[a]]
    ring = np.array([truth.closed for truth in truths])[cable[a]]
    step = np.abs(arc[b] - arc[a])
    step = np.where(ring, np.minimum(step, length - step), step)
    run = np.asarray((joint[b] - joint[a]) * chain.segment_length, dtype=float)
    share = np.abs(step - run) / _slack(truths, cable[a], run)
    return np.asarray(JUMP * np.where(cable[a] != cable[b], 1.0, np.minimum(share**2, 1.0)))


def _slack(truths: tuple[Truth, ...], cable: Ints, run: Floats) -> Floats:
    """m by which the way along the cable may differ from that along the chain: corners are cut, noise adds."""
    radius = np.array([truth.radius for truth in truths])[cable]
    return np.asarray(0.5 * run + np.maximum(2 * radius, 0.005))


def _arc_steps(truths: tuple[Truth, ...], cable: Ints, arc: Floats) -> Floats:
    step = np.diff(arc)
    length = np.array([truth.length for truth in truths])[cable[:-1]]
    ring = np.array([truth.closed for truth in truths])[cable[:-1]]
    return np.asarray(np.where(ring, (step + length / 2) % length - length / 2, step))


def _is_jump(chain: Chain, truths: tuple[Truth, ...], joint: Ints, cable: Ints, step: Floats) -> Bools:
    run = np.asarray(np.diff(joint) * chain.segment_length, dtype=float)
    return np.asarray((cable[1:] != cable[:-1]) | (np.abs(step) - run > _slack(truths, cable[:-1], run)))


def _turning_points(along: Floats, least: float) -> list[int]:
    """Where the arc turns back by more than `least` in m."""
    turns: list[int] = []
    low = high = 0
    direction = 0
    for i, value in enumerate(along):
        low = i if value < along[low] else low
        high = i if value > along[high] else high
        back = value - along[low] if direction <= 0 else along[high] - value
        if direction == 0 and max(value - along[low], along[high] - value) > least:
            direction = 1 if value - along[low] > least else -1
            low = high = i
        elif direction != 0 and back > least:
            turns.append(low if direction < 0 else high)
            direction, low, high = -direction, i, i
    return turns
