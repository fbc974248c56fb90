"""Find an object in every frame of a period, starting from its anchors, the frames in which it is seen whole.

1. In an anchor, the seen parts of the chain have known positions along the object.
2. From each anchor, forward and backward in time, the expected shape in the next frame is the last shape, moved on with its last
   velocity. The strands of that frame are registered with it, and the object is fitted to them.
3. The forward and the backward shape of a frame are blended, weighted by how recently each joint was seen. If the two disagree,
   the shape that fits the strands better is used. The strands are registered once more, with that shape.
4. Joints that were not seen are smoothed over time (Whittaker smoother); seen joints stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.curves import runs
from ..geometry.polyline import whittaker_smooth
from ..types import Bools, Chain, Floats, Ints
from .objects import SequenceObject
from .observations import MIN_STRAND_RADII, Observation, ObservedStrand, cut_strands
from .registration import MISSING_COST, SHIFT_TOLERANCES, Placed, bend, place_strands, to_lengths
from .tracking import MIN_MOTION_RADII

SPEED_SHARE = 0.7
"""Share of the last displacement of an object that is expected again in the next frame."""

TOLERANCE_SHARE = 0.06
"""Largest distance of a strand from the expected shape, as a share of the object's length; as in tracking, MIN_MOTION_RADII are
always allowed."""

TIME_STIFFNESS, SEEN_WEIGHT = 30.0, 1e4
"""Weights of the second differences over time, and of a position that was seen, relative to 1 for one that was not seen."""

NEVER = 10**6
"""Age, in frames, of a joint that was never seen."""


@dataclass(frozen=True)
class Shape:
    """The shape of an object in one frame.

    Attributes
    ----------
    joints
        (M + 1, 3) m, positions.
    seen
        (M + 1,) bool, True for joints seen in the frame.
    age
        (M + 1,) int, frames since each joint was seen last.
    cost
        misfit of the frame's strands to the expected shape, in squared standard deviations; 0 for an anchor.
    from_time
        (M + 1,) bool, True for joints whose positions come from other frames only.
    """

    joints: Floats
    seen: Bools
    age: Ints
    cost: float
    from_time: Bools


@dataclass(frozen=True)
class _Clues:
    """What a frame holds for one object: its own seen parts with their places (an anchor), or strands without."""

    own: tuple[Placed, ...] | None
    whole: Floats | None
    strands: tuple[int, ...]


def follow(
    items: Sequence[SequenceObject],
    observations: Sequence[Observation],
    first: int,
    claimed: Sequence[Sequence[set[int]]],
    max_gap: int,
    past_only: bool = False,
) -> list[list[Shape | None]]:
    """Find the objects of one tree in every frame of a period; a single cable is a tree of one object.

    Parameters
    ----------
    items
        the objects of the tree; only their anchors in the period are used.
    observations
        the observations of all frames of the period.
    first
        index in the capture of the first observation.
    claimed
        for each object and each frame, the indices of the chains that belong to other objects.
    max_gap
        largest number of successive frames without any strand of the tree that are filled in.
    past_only
        True to use earlier frames only, as while recording: no shape before the first anchor, and no smoothing over time.

    Returns
    -------
    For each object and each frame its shape; None if the object is not in the frame.
    """
    located = [_located(item, observations, first, own, past_only) for item, own in zip(items, claimed, strict=True)]
    located = _without_long_gaps(located, max_gap)
    return located if past_only else [_smoothed(item, shapes) for item, shapes in zip(items, located, strict=True)]


def _located(
    item: SequenceObject, observations: Sequence[Observation], first: int, claimed: Sequence[set[int]], past_only: bool
) -> list[Shape | None]:
    """Return an object in every frame, filled in however long it is hidden."""
    clues = _clues(item, observations, first, claimed)
    forward = _pass(item, observations, clues, range(len(observations)))
    if past_only:
        return forward
    backward = _pass(item, observations, clues, range(len(observations) - 1, -1, -1))
    shapes: list[Shape | None] = []
    for frame, (before, after) in enumerate(zip(forward, backward, strict=True)):
        shapes.append(_decided(item, observations[frame], clues[frame], before, after))
    return shapes


def _clues(item: SequenceObject, observations: Sequence[Observation], first: int, claimed: Sequence[set[int]]) -> list[_Clues]:
    anchors = {anchor.frame - first: anchor for anchor in item.anchors}
    result = []
    for frame, observation in enumerate(observations):
        anchor = anchors.get(frame)
        own, whole = None, None
        if anchor is not None:
            chain = observation.detection.chains[anchor.chain]
            own = (_own_place(chain, anchor.backwards, item),)
            whole = _resampled(chain, anchor.backwards, item)
        free = tuple(k for k, strand in enumerate(observation.strands) if strand.chain not in claimed[frame])
        result.append(_Clues(own, whole, free))
    return result


def _own_place(chain: Chain, backwards: bool, item: SequenceObject) -> Placed:
    """Return the seen parts of a whole chain at their places along the object."""
    seen = np.append(~chain.depth_filled, False) | np.append(False, ~chain.depth_filled)
    along = np.flatnonzero(seen) * chain.segment_length * item.length / chain.length
    return Placed(item.length - along if backwards else along, chain.joints[seen], (0.0, item.length), 0.0)


def _resampled(chain: Chain, backwards: bool, item: SequenceObject) -> Floats:
    joints = chain.nodes(item.segments + 1)
    return to_lengths(joints[::-1].copy() if backwards else joints, item.segment_length, np.zeros(len(joints), dtype=bool))


def _pass(item: SequenceObject, observations: Sequence[Observation], clues: Sequence[_Clues], order: range) -> list[Shape | None]:
    """Follow the object frame by frame in one direction of time, from the first anchor on."""
    shapes: list[Shape | None] = [None] * len(observations)
    last: Shape | None = None
    motion: Floats = np.zeros(3)
    for frame in order:
        clue = clues[frame]
        if last is None:
            if clue.whole is None:
                continue
            expected = clue.whole
        else:
            expected = last.joints + SPEED_SHARE * motion
        shape = _fitted(item, observations[frame], clue, expected, last)
        motion = np.zeros(3) if last is None else _motion(last, shape)
        shapes[frame] = last = shape
    return shapes


def _motion(last: Shape, shape: Shape) -> Floats:
    """Return how far each joint moved from one frame to the next (M + 1, 3); hidden joints move as the seen ones beside them."""
    moved = shape.joints - last.joints
    known = np.flatnonzero(shape.seen & last.seen)
    if not len(known):
        return np.asarray(np.zeros_like(moved))
    at = np.arange(len(moved))
    return np.column_stack([np.interp(at, known, column[known]) for column in moved.T])


def _fitted(item: SequenceObject, observation: Observation, clue: _Clues, expected: Floats, last: Shape | None = None) -> Shape:
    """Return the object bent from where it is expected to what a frame shows."""
    cost = 0.0
    if clue.own is not None:
        placed: Sequence[Placed] = clue.own
    else:
        strands = [observation.strands[k] for k in clue.strands]
        tolerance = max(TOLERANCE_SHARE * item.length, MIN_MOTION_RADII * (item.radius if np.isfinite(item.radius) else 0.0))
        is_joined = item.nodes != (None, None)
        for side, node in enumerate(item.nodes):
            if node is not None:
                least = MIN_STRAND_RADII * (item.radius if np.isfinite(item.radius) else 0.0)
                strands = cut_strands(strands, expected[-side], least, tolerance)
        placed = place_strands(strands, expected, item.length, tolerance)
        if strands and not placed and not is_joined:  # beside a hidden part of a tree there are other parts
            placed = place_strands(strands, expected, item.length, SHIFT_TOLERANCES * tolerance)
        cost = _total_cost(strands, placed)
        if placed:
            nearer, _ = bend(expected, placed, item.length)
            placed = place_strands(strands, nearer, item.length, tolerance) or placed
    joints, seen = bend(expected, placed, item.length)
    age = np.where(seen, 0, (last.age if last is not None else np.full(len(seen), NEVER)) + 1)
    return Shape(joints, seen, age, cost, ~seen if clue.own is None else np.zeros_like(seen))


def _total_cost(strands: Sequence[ObservedStrand], placed: Sequence[Placed]) -> float:
    """Return how badly strands fit where they were laid, a mean over their lengths; a strand that fits nowhere costs much."""
    total = sum(strand.length for strand in strands)
    if not total:
        return 0.0
    laid = sum(item.span[1] - item.span[0] for item in placed)
    costs = sum(item.cost * (item.span[1] - item.span[0]) for item in placed)
    return (costs + MISSING_COST * max(0.0, total - laid)) / total


def _decided(
    item: SequenceObject, observation: Observation, clue: _Clues, before: Shape | None, after: Shape | None
) -> Shape | None:
    """Return the object in a frame, from what comes from earlier and from later frames.

    Where the two agree on the frame, they are blended; else the one onto which the frame's strands fit better counts.
    """
    if before is None or after is None:
        known = before or after
        return None if known is None else _fitted(item, observation, clue, known.joints)
    expected = [_blended(before, after)]
    if clue.own is None and np.linalg.norm(before.joints - after.joints, axis=1).max() > TOLERANCE_SHARE * item.length:
        expected = [expected[0], before.joints, after.joints]
        earlier = [0.0, before.cost, after.cost]
        fitted = [_fitted(item, observation, clue, joints) for joints in expected]
        costs = [shape.cost + past for shape, past in zip(fitted, earlier, strict=True)]
        if before.seen.any() and after.seen.any():
            costs[0] += min(before.cost, after.cost)
        return fitted[int(np.argmin(costs))]
    return _fitted(item, observation, clue, expected[0])


def _blended(before: Shape, after: Shape) -> Floats:
    """Return the joints (M + 1, 3) between those from earlier and from later frames, by how recently each was seen."""
    total = before.age + after.age
    share = np.where(total > 0, before.age / np.maximum(total, 1), 0.5)[:, None]
    return np.asarray(before.joints * (1 - share) + after.joints * share)


def _without_long_gaps(shapes: Sequence[list[Shape | None]], max_gap: int) -> list[list[Shape | None]]:
    """Drop the objects of a tree from frames in a row without any strand of them, if there are more than `max_gap`."""
    result = [list(each) for each in shapes]
    unseen = [all(shape is None or not shape.seen.any() for shape in frame) for frame in zip(*shapes, strict=True)]
    for first, end in runs(np.array(unseen, dtype=bool)):
        if end - first > max_gap:
            for each in result:
                each[first:end] = [None] * (end - first)
    return result


def _smoothed(item: SequenceObject, shapes: list[Shape | None]) -> list[Shape | None]:
    """Smooth over time what was not seen; the joints that were seen stay."""
    result = list(shapes)
    for first, end in runs(np.array([shape is not None for shape in shapes], dtype=bool)):
        result[first:end] = _smooth_run(item, [shape for shape in shapes[first:end] if shape is not None])
    return result


def _smooth_run(item: SequenceObject, shapes: Sequence[Shape]) -> list[Shape]:
    """Smooth over time what was not seen in frames in a row."""
    joints = np.array([shape.joints for shape in shapes])
    seen = np.array([shape.seen for shape in shapes])
    smooth = joints.copy()
    for k in np.flatnonzero(~seen.all(axis=0)):
        weights = np.where(seen[:, k], SEEN_WEIGHT, 1.0)[:, None, None] * np.eye(3)
        smooth[:, k] = np.where(seen[:, k, None], joints[:, k], whittaker_smooth(joints[:, k], weights, TIME_STIFFNESS))
    return [
        replace(shape, joints=to_lengths(line, item.segment_length, shape.seen))
        for line, shape in zip(smooth, shapes, strict=True)
    ]
