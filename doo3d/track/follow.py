"""Follow an object through every frame of a period, starting from its anchors.

1. In an anchor, a frame that shows the object whole, the visible parts of the chain have known positions along the object.
2. From each anchor, forward and backward in time, the expected shape in the next frame is the last shape, moved with its last
   velocity. The strands of that frame are placed along it, and the object is fitted to them.
3. The forward and the backward shape of a frame are blended, weighted by how recently each joint was visible, and the strands are
   placed once more along the blended shape. If the two disagree, both are hypotheses. If no shape fits well, the frame's own
   chains of the right length are hypotheses, too, in either direction. The path of least cost through the hypotheses of all
   frames is taken (Viterbi algorithm). A hypothesis costs the misfit of the strands, the strands that it leaves out, and what of
   it the camera contradicts.
4. Hidden joints are interpolated between their last and next visible positions, behind the occluder. Positions that were not
   measured are smoothed over time (Whittaker smoother), and so is the depth of all joints; visible joints keep their place in
   the image.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..geometry.curves import runs
from ..types import Floats, Ints
from .frame_evidence import Evidence, Period, fit_object, gather_evidence, own_shapes
from .objects import SequenceObject
from .observations import LENGTH_ERROR
from .registration import MISSING_COST, TOLERANCE_SHARE
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
    forward = _follow_in_order(item, period, found, order)
    if past_only:
        return forward
    backward = _follow_in_order(item, period, found, order[::-1])
    hypotheses = [_hypotheses(item, period, *each) for each in zip(order, found, forward, backward, strict=True)]
    return most_likely_path(hypotheses, TOLERANCE_SHARE * item.length)


def most_likely_path(hypotheses: Sequence[Sequence[Shape]], tolerance: float) -> list[Shape | None]:
    """Return one of the hypotheses of each frame, so that the sum of all costs is least (Viterbi algorithm).

    Parameters
    ----------
    hypotheses
        possible shapes of an object in each frame; none where it is missing.
    tolerance
        m, standard deviation of its mean motion from frame to frame. A motion costs MISSING_COST at most.
    """
    totals: list[Floats] = []
    before: list[Ints] = []
    last: Sequence[Shape] = ()
    for shapes in hypotheses:
        cost = np.array([shape.cost for shape in shapes])
        came = np.zeros(len(shapes), dtype=np.int64)
        if last and shapes:
            apart = [[np.linalg.norm(a.joints - b.joints, axis=1).mean() for a in last] for b in shapes]
            steps = totals[-1] + np.minimum((np.array(apart) / tolerance) ** 2, MISSING_COST)
            came = steps.argmin(axis=1)
            cost += steps.min(axis=1)
        totals.append(cost)
        before.append(came)
        last = shapes
    result: list[Shape | None] = [None] * len(hypotheses)
    at = 0
    for k in range(len(hypotheses) - 1, -1, -1):
        if hypotheses[k]:
            at = at if k + 1 < len(hypotheses) and hypotheses[k + 1] else int(totals[k].argmin())
            result[k] = hypotheses[k][at]
            at = int(before[k][at])
    return result


def _follow_in_order(item: SequenceObject, period: Period, evidence: Sequence[Evidence], order: range) -> list[Shape | None]:
    """Follow an object in one direction of time, from its first anchor.

    order : indices of the frames, ascending or descending.
    """
    shapes: list[Shape | None] = [None] * len(evidence)
    last: Shape | None = None
    motion: Floats = np.zeros(3)
    for frame in order:
        found = evidence[frame]
        expected = found.whole if last is None else last.joints + SPEED_SHARE * motion
        if not len(expected):
            continue
        shape = fit_object(item, period, frame, found, expected, last)
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


def _hypotheses(
    item: SequenceObject, period: Period, frame: int, found: Evidence, before: Shape | None, after: Shape | None
) -> list[Shape]:
    """Return the possible shapes of an object in a frame.

    These are the forward and the backward shape, or one between them if they agree. If they do not fit the strands well, and the
    capture has no other object, the frame's own chains of the object's length are hypotheses, too.

    Parameters
    ----------
    item, period, frame, found
        the object, the frames, the index of the frame in them, and its evidence for the object.
    before, after
        the shapes of the forward and of the backward pass; None if the pass has not reached the object.
    """
    if before is None or after is None:
        known = before or after
        if known is None:
            return []
        result = [fit_object(item, period, frame, found, known.joints)]
    elif found.own or _agree(before, after, item.length):
        result = [fit_object(item, period, frame, found, _blend(before, after))]
    else:
        age = np.array([float(before.age.sum()), float(after.age.sum())])
        shares = age / max(age.sum(), 1.0)
        result = [replace(shape, cost=shape.cost + share) for shape, share in zip((before, after), shares, strict=True)]
    if found.own or not period.is_single or min(shape.cost for shape in result) < 1:
        return result
    return result + own_shapes(item, period, frame, found)


def _agree(before: Shape, after: Shape, length: float) -> bool:
    """Return whether two shapes agree in visible places, and on the mean elsewhere.

    length : of the object, m.
    """
    apart = np.linalg.norm(before.joints - after.joints, axis=1)
    return bool(apart.mean() <= TOLERANCE_SHARE * length and (apart[before.seen & after.seen] <= LENGTH_ERROR * length).all())


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
