"""Follow an object through every frame of a period, starting from its anchors.

1. In an anchor, a frame that shows the object whole, the visible parts of the chain have known positions along the object.
2. From each anchor, forward and backward in time, the expected shape in the next frame is the last shape, moved with its last
   velocity. The strands of that frame are placed along it, and the object is fitted to them.
3. The forward and the backward shape of a frame are blended, weighted by how recently each joint was visible. If the two
   disagree, the one that fits the strands better is used. The strands are placed once more, along the blended shape.
4. Hidden joints are interpolated between their last and next visible positions, behind the occluder. Positions that were not
   measured are smoothed over time (Whittaker smoother), and so is the depth of all joints; visible joints keep their place in
   the image.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..geometry.curves import runs
from ..types import Floats
from .frame_evidence import Evidence, Period, fit_object, gather_evidence
from .objects import SequenceObject
from .observations import LENGTH_ERROR, Observation
from .registration import TOLERANCE_SHARE
from .shape import Shape
from .shape_smoothing import smooth_shapes

SPEED_SHARE = 0.7
"""Fraction of the last displacement of an object that is expected again in the next frame."""


def follow(
    items: Sequence[SequenceObject], period: Period, claimed: Sequence[Sequence[set[int]]], max_gap: int, past_only: bool = False
) -> list[list[Shape | None]]:
    """Find the objects of one tree in every frame of a period.

    A single cable is a tree of one object.

    Parameters
    ----------
    items
        the objects of the tree; only their anchors in the period are used.
    period
        the frames.
    claimed
        for each object and each frame, the indices of the chains that belong to other objects.
    max_gap
        largest number of successive frames without any strand of the tree that are filled in.
    past_only
        True to use earlier frames only, as while recording: no shape before the first anchor, and no smoothing over time.

    Returns
    -------
    For each object and each frame its shape; None if the object is missing.
    """
    followed = [_follow_object(item, period, own, past_only) for item, own in zip(items, claimed, strict=True)]
    followed = _drop_long_gaps(followed, max_gap)
    if past_only:
        return followed
    return [smooth_shapes(item, shapes, period.poses) for item, shapes in zip(items, followed, strict=True)]


def _follow_object(item: SequenceObject, period: Period, claimed: Sequence[set[int]], past_only: bool) -> list[Shape | None]:
    """Return the shape of an object in every frame, filled in where it is hidden.

    claimed, past_only : as for `follow`, of this object.
    """
    found = gather_evidence(item, period, claimed)
    order = range(len(found))
    forward = _follow_in_order(item, period.observations, found, order)
    if past_only:
        return forward
    backward = _follow_in_order(item, period.observations, found, order[::-1])
    is_earlier = _prefer_forward(found, forward, backward)
    return [_merge_passes(item, *each) for each in zip(period.observations, found, forward, backward, is_earlier, strict=True)]


def _prefer_forward(
    evidence: Sequence[Evidence], forward: Sequence[Shape | None], backward: Sequence[Shape | None]
) -> list[bool]:
    """Return for each frame whether the forward shape is used if the two disagree.

    Once a pass has placed a strand wrongly, its later frames fit again: only the cost of the frame in which that happened
    reveals it. So between two anchors the forward pass is used up to one frame, chosen for the smallest sum of all costs.
    """
    gains = [0.0 if a is None or b is None else _forward_advantage(a, b) for a, b in zip(forward, backward, strict=True)]
    result = [False] * len(evidence)
    anchors = [-1, *(k for k, found in enumerate(evidence) if found.own), len(evidence)]
    for first, end in pairwise(anchors):
        total = np.cumsum([0.0, *gains[first + 1 : end]])
        for frame in range(first + 1, first + 1 + int(np.argmax(total))):
            result[frame] = True
    return result


def _forward_advantage(before: Shape, after: Shape) -> float:
    """Return the cost of the backward shape minus that of the forward shape.

    In squared standard deviations; differences below 1 do not count, and then the shape whose joints were visible more
    recently is preferred.
    """
    earlier, later = float(before.age.sum()), float(after.age.sum())
    return after.cost - before.cost + (later - earlier) / max(later + earlier, 1.0)


def _follow_in_order(
    item: SequenceObject, observations: Sequence[Observation], evidence: Sequence[Evidence], order: range
) -> list[Shape | None]:
    """Follow an object in one direction of time, from its first anchor.

    order : indices of the frames, ascending or descending.
    """
    shapes: list[Shape | None] = [None] * len(observations)
    last: Shape | None = None
    motion: Floats = np.zeros(3)
    for frame in order:
        found = evidence[frame]
        expected = found.whole if last is None else last.joints + SPEED_SHARE * motion
        if not len(expected):
            continue
        shape = fit_object(item, observations[frame], found, expected, last)
        motion = np.zeros(3) if last is None else _motion(last, shape)
        shapes[frame] = last = shape
    return shapes


def _motion(last: Shape, shape: Shape) -> Floats:
    """Return the displacement of each joint between two frames, (M + 1, 3) m.

    Joints that are hidden in either frame move as their visible neighbors.
    """
    moved = shape.joints - last.joints
    known = np.flatnonzero(shape.seen & last.seen)
    if not len(known):
        return np.asarray(np.zeros_like(moved))
    at = np.arange(len(moved))
    return np.column_stack([np.interp(at, known, column[known]) for column in moved.T])


def _merge_passes(
    item: SequenceObject,
    observation: Observation,
    found: Evidence,
    before: Shape | None,
    after: Shape | None,
    prefer_forward: bool,
) -> Shape | None:
    """Return the object in a frame from its forward and its backward shape.

    Parameters
    ----------
    item
        the object.
    observation, found
        the frame, and its evidence for the object.
    before, after
        the shapes of the forward and of the backward pass; None if the pass has not reached the object.
    prefer_forward
        the shape to use if the two disagree; they are blended if they agree.
    """
    if before is None or after is None:
        known = before or after
        return None if known is None else fit_object(item, observation, found, known.joints)
    if not found.own and not _agree(before, after, item.length):
        return before if prefer_forward else after
    return fit_object(item, observation, found, _blend(before, after))


def _agree(before: Shape, after: Shape, length: float) -> bool:
    """Return whether two shapes agree in visible places, and roughly elsewhere.

    length : of the object, m.
    """
    apart = np.linalg.norm(before.joints - after.joints, axis=1)
    return bool(apart.max() <= TOLERANCE_SHARE * length and (apart[before.seen & after.seen] <= LENGTH_ERROR * length).all())


def _blend(before: Shape, after: Shape) -> Floats:
    """Return joints (M + 1, 3) m between two shapes, by the age of each joint."""
    total = before.age + after.age
    share = np.where(total > 0, before.age / np.maximum(total, 1), 0.5)[:, None]
    return np.asarray(before.joints * (1 - share) + after.joints * share)


def _drop_long_gaps(shapes: Sequence[list[Shape | None]], max_gap: int) -> list[list[Shape | None]]:
    """Remove a tree from gaps of more than `max_gap` frames without its strands."""
    result = [list(each) for each in shapes]
    unseen = [all(shape is None or not shape.seen.any() for shape in frame) for frame in zip(*shapes, strict=True)]
    for first, end in runs(np.array(unseen, dtype=bool)):
        if end - first > max_gap:
            for each in result:
                each[first:end] = [None] * (end - first)
    return result
