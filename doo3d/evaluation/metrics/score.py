"""How good chains are, counted against known truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from ...types import Bools, Chain, Crossing, Floats, Ints
from ..scenes.model import Truth
from .alignment import Track, Walk, follow, hidden_runs, tolerance
from .crossings import count_right, true_crossings
from .merges import wrong_merges
from .nodes import node_error

RUN = 0.008  # m; a hidden run of this length or more is an occlusion
COVERED, OFF = 0.94, 0.03  # least share of an object that its chain follows; share of a chain off it that is too much
ON_RADII, ON = 1.5, 0.005  # a chain is off where it is farther than max(1.5 r, 5 mm) from the axis, where that is seen
BESIDE = 0.0025  # m that a chain has to reach on both sides of an occlusion
SIDE = 0.005  # m that have to be seen on both sides, or there is nothing to join
SAMPLE = 0.001  # m between the points of a chain that are measured


@dataclass(frozen=True)
class FrameScore:
    """One frame against its truth.

    correct : by all the rules; reasons : why not, a phrase each. objects, chains : how many there are, and were found.
    occlusions, occlusions_correct : hidden runs of at least RUN with the cable seen on both sides, and those passed well.
    connections, connections_wrong : pairs of joints along the truth, and those that jump or reverse.
    merges, merges_wrong : connections that merging made, and those that are wrong.
    rms_seen, rms_hidden : mm, chain to true axis; NaN where there is no such part.
    radius_ratio : found over true, mean over objects. end_error : mm, mean distance of chain ends from true tips.
    node_error : mm, mean distance of node i of a chain from node i of its object, evenly along it in the same order.
    coverage : least share of an object that its chain follows. off : greatest share of a chain off its object.
    crossings, crossings_right : places where true cables cross in the view and the upper one is seen, and those found with
    the right strand on top. crossings_extra : found where there are none.
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
    off: float
    merges: int = 0
    merges_wrong: int = 0
    node_error: float = float("nan")
    crossings: int = 0
    crossings_right: int = 0
    crossings_extra: int = 0


def score(chains: Sequence[Chain], truths: Sequence[Truth], crossings: Sequence[Crossing] | None = None) -> FrameScore:
    """The score of one frame.

    Parameters
    ----------
    chains : what was found, in the camera frame, m. The direction of a chain and the order of chains do not matter.
    truths : what is there; where `seen` is None all of it is taken as seen.
    crossings : of the chains, as the camera sees them; None: not looked at.
    """
    chains, truths = tuple(chains), tuple(truths)
    walks = [follow(chain, truths) for chain in chains] if truths else [Walk((), 0, 0) for _ in chains]
    overlap = np.array([walk.overlap(len(truths), chain.segment_length) for walk, chain in zip(walks, chains, strict=True)])
    overlap = overlap.reshape(len(chains), len(truths))
    pairs = [(int(c), int(t)) for c, t in zip(*linear_sum_assignment(-overlap), strict=True) if overlap[c, t] > 0]
    coverage = [0.0] * len(truths)
    for c, t in pairs:
        coverage[t] = covered(walks[c], truths[t], t)
    gaps = [_gaps(chain, walk, truths) for chain, walk in zip(chains, walks, strict=True)]
    off = [float(is_off.mean()) for _, _, is_off in gaps]
    runs = [(t, run) for t, truth in enumerate(truths) for run in occlusions(truth)]
    ways = [*zip(chains, walks, strict=True), *((ring, follow(ring, truths)) for ring in map(_reseamed, chains) if ring)]
    passed = sum(any(_passes(chain, walk, truths[t], t, run) for chain, walk in ways) for t, run in runs)
    wrong = sum(walk.wrong for walk in walks)
    reasons = _reasons(len(chains), len(truths), len(pairs), wrong, coverage, off)
    true = true_crossings(truths if crossings is not None else ())
    right, extra = count_right(crossings or (), chains, walks, truths, true)
    return FrameScore(
        correct=not reasons,
        reasons=reasons,
        objects=len(truths),
        chains=len(chains),
        occlusions=len(runs),
        occlusions_correct=passed,
        connections=sum(walk.connections for walk in walks),
        connections_wrong=wrong,
        rms_seen=_rms([gap[seen] for gap, seen, _ in gaps]),
        rms_hidden=_rms([gap[~seen] for gap, seen, _ in gaps]),
        radius_ratio=_mean([chains[c].radius / truths[t].radius for c, t in pairs]),
        end_error=_mean([_end_error(chains[c], truths[t]) for c, t in pairs if not truths[t].closed]),
        coverage=min(coverage, default=1.0),
        off=max(off, default=0.0),
        merges=sum(len(chain.connections) for chain in chains),
        merges_wrong=sum(wrong_merges(chain, walk) for chain, walk in zip(chains, walks, strict=True)),
        node_error=_mean([node_error(chains[c], truths[t]) for c, t in pairs]),
        crossings=int(true.seen.sum()),
        crossings_right=right,
        crossings_extra=extra,
    )


def _reasons(chains: int, objects: int, matched: int, wrong: int, coverage: list[float], off: list[float]) -> tuple[str, ...]:
    reasons = []
    if chains != objects:
        reasons.append(f"{chains} chains for {objects} objects")
    if matched < min(chains, objects):
        reasons.append(f"{objects - matched} objects without a chain")
    if wrong:
        reasons.append(f"{wrong} wrong connections")
    if min(coverage, default=1.0) < COVERED:
        reasons.append(f"{min(coverage):.0%} covered")
    if max(off, default=0.0) >= OFF:
        reasons.append(f"{max(off):.0%} off")
    return tuple(reasons)


def covered(walk: Walk, truth: Truth, cable: int) -> float:
    """The share of the cable's length that the chain follows."""
    arcs = truth.arcs
    steps = np.zeros(len(arcs), dtype=bool)
    for track in walk.tracks:
        if track.cable != cable or len(track.arcs) < 2:
            continue
        low, high = track.arcs.min(), track.arcs.max()
        for turn in (-1, 0, 1) if truth.closed else (0,):
            steps |= (arcs + turn * truth.length >= low - 1e-9) & (arcs + turn * truth.length <= high + 1e-9)
    return float(steps.mean())


def occlusions(truth: Truth) -> list[tuple[int, int]]:
    """(first, last) sample of each hidden run of at least RUN with the cable seen on both sides."""
    side = 0 if truth.closed else int(np.ceil(SIDE / truth.spacing))
    last_sample = np.inf if truth.closed else len(truth.axis) - 1 - side
    return [(a, b) for a, b in hidden_runs(truth) if (b - a + 1) * truth.spacing >= RUN and a >= side and b <= last_sample]


def _reseamed(chain: Chain) -> Chain | None:
    """A ring that starts half-way round, so that what lies across its seam is looked at, too."""
    if not chain.closed:
        return None
    joints = np.roll(chain.joints[:-1], len(chain.joints) // 2, axis=0)
    return replace(chain, joints=np.vstack((joints, joints[:1])), radii=np.zeros(0), occluded=np.zeros(0, dtype=bool))


def _passes(chain: Chain, walk: Walk, truth: Truth, cable: int, run: tuple[int, int]) -> bool:
    """One track of the chain goes from one side of the hidden run to the other and keeps near it."""
    index = np.arange(run[0], run[1] + 1)
    start, end = index[0] * truth.spacing, index[-1] * truth.spacing
    hidden = truth.axis[index % len(truth.axis)]
    sides = int(np.ceil(2 * chain.segment_length / truth.spacing))
    around = np.arange(run[0] - sides, run[1] + sides + 1)
    around = around % len(truth.axis) if truth.closed else np.clip(around, 0, len(truth.axis) - 1)
    near = float(tolerance(truth)[index % len(truth.axis)].max())
    for track in walk.tracks:
        for turn in (-1, 0, 1) if truth.closed else (0,):
            low, high = start + turn * truth.length, end + turn * truth.length
            if track.cable != cable or track.arcs.min() > low - BESIDE or track.arcs.max() < high + BESIDE:
                continue
            piece = _piece(chain, track, low, high)
            gap = cdist(piece, truth.axis[around])
            there = cdist(piece, hidden)
            return bool(gap.min(axis=1).max() <= near and there.min(axis=0).max() <= near)
    return False


def _piece(chain: Chain, track: Track, low: float, high: float) -> Floats:
    """The points of the chain from the last joint before an arc to the first behind it."""
    rising = track.arcs[-1] >= track.arcs[0]
    arcs, joints = (track.arcs, track.joints) if rising else (track.arcs[::-1], track.joints[::-1])
    first = joints[max(int(np.argmax(arcs > low)) - 1, 0)]
    last = joints[min(len(arcs) - 1, len(arcs) - int(np.argmax(arcs[::-1] < high)))]
    return _dense(chain, min(first, last), max(first, last))[0]


def _dense(chain: Chain, first: int = 0, last: int | None = None) -> tuple[Floats, Floats]:
    """(Q, 3) points at most SAMPLE apart from joint to joint, and (Q,) where they are, counted in joints."""
    last = len(chain.joints) - 1 if last is None else last
    each = max(1, int(np.ceil(chain.segment_length / SAMPLE)))
    at = np.linspace(first, last, (last - first) * each + 1)
    index = np.minimum(at.astype(int), len(chain.joints) - 2)
    part = (at - index)[:, None]
    return chain.joints[index] * (1 - part) + chain.joints[index + 1] * part, at


def off_share(chain: Chain, walk: Walk, truths: tuple[Truth, ...]) -> float:
    """The share of the chain that is off what it follows, or follows nothing."""
    return float(_gaps(chain, walk, truths)[2].mean())


def _gaps(chain: Chain, walk: Walk, truths: tuple[Truth, ...]) -> tuple[Floats, Bools, Bools]:
    """Of the chain's points: distance in m to the axis of the strand followed, whether that is seen, whether off it.

    Points that follow nothing are off, and are left out of the distances.
    """
    points, at = _dense(chain)
    gap, seen, off = np.full(len(points), np.nan), np.ones(len(points), dtype=bool), np.ones(len(points), dtype=bool)
    for track in walk.tracks:
        on = np.flatnonzero((at >= track.joints[0] - 0.5) & (at <= track.joints[-1] + 0.5))
        truth = truths[track.cable]
        sample, gap[on] = _nearest(points[on], np.interp(at[on], track.joints, track.arcs), chain.segment_length, truth)
        seen[on] = True if truth.seen is None else truth.seen[sample]
        limit = np.where(seen[on], max(ON_RADII * truth.radius, ON), tolerance(truth)[sample])
        off[on] = gap[on] > limit
    return gap, seen, off


def _nearest(points: Floats, arcs: Floats, reach: float, truth: Truth) -> tuple[Ints, Floats]:
    """The axis sample nearest each point, looked for round a guessed arc, and the distance to the axis in m."""
    spacing, count = truth.spacing, len(truth.axis)
    window = np.arange(-int(reach / spacing) - 2, int(reach / spacing) + 3)
    index = np.round(arcs / spacing).astype(int)[:, None] + window
    index = index % count if truth.closed else np.clip(index, 0, count - 1)
    gap = np.linalg.norm(truth.axis[index] - points[:, None], axis=-1)
    sample = index[np.arange(len(points)), gap.argmin(axis=1)]
    tangent = np.gradient(truth.axis, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    offset = points - truth.axis[sample]
    along = np.clip(np.einsum("ij,ij->i", offset, tangent[sample]), -spacing, spacing)
    return sample, np.linalg.norm(offset - along[:, None] * tangent[sample], axis=1)


def _end_error(chain: Chain, truth: Truth) -> float:
    gap = cdist(chain.joints[[0, -1]], truth.axis[[0, -1]])
    return 1e3 * float(min(np.trace(gap), np.trace(gap[::-1]))) / 2


def _rms(parts: list[Floats]) -> float:
    values = np.concatenate([np.zeros(0), *parts])
    values = values[np.isfinite(values)]
    return 1e3 * float(np.sqrt((values**2).mean())) if len(values) else float("nan")


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")
