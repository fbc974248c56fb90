"""Find an object in every frame of a period, starting from its anchors, the frames in which it is seen whole.

1. In an anchor, the seen parts of the chain have known positions along the object.
2. From each anchor, forward and backward in time, the expected shape in the next frame is the last shape, moved on with its last
   velocity. The strands of that frame are registered with it, and the object is fitted to them.
3. The forward and the backward shape of a frame are blended, weighted by how recently each joint was seen. If the two disagree,
   the shape that fits the strands better is used. The strands are registered once more, with that shape.
4. Joints that are hidden are carried from where they were seen last and are seen next, behind what hides them. What was not
   measured is smoothed over time (Whittaker smoother), and so is the depth of all joints; seen joints stay where they are in
   the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..geometry.curves import runs
from ..geometry.equal_segments import close_ring
from ..types import Chain, Floats
from .chain_matching import MIN_MOTION_RADII
from .objects import Anchor, SequenceObject
from .observations import LENGTH_ERROR, Observation, ObservedStrand, visible_joints
from .registration import MISSING_COST, TOLERANCE_SHARE, Placed, fit_joints, place_strands, relax_lengths
from .rings import fit_ring, place_on_ring, ring_joints
from .shape import Shape
from .shape_smoothing import smooth_shapes
from .strand_cutting import cut_misjoined, cut_strands
from .strand_ends import MIN_STRAND_RADII
from .tracks import FILLED_ERROR

SPEED_SHARE = 0.7
"""Share of the last displacement of an object that is expected again in the next frame."""

NEVER = 10**6
"""Age, in frames, of a joint that was never seen."""


@dataclass(frozen=True)
class _Evidence:
    """What a frame holds for one object: its own seen parts with their places (an anchor), or strands without; and its camera."""

    own: Sequence[Placed]
    whole: Floats
    strands: tuple[int, ...]


class Period(NamedTuple):
    """P."""

    first: int
    observations: Sequence[Observation]
    poses: Floats


def follow(
    items: Sequence[SequenceObject],
    period: Period,
    claimed: Sequence[Sequence[set[int]]],
    max_gap: int,
    past_only: bool = False,
) -> list[list[Shape | None]]:
    """F."""
    followed = [_follow_object(item, period, own, past_only) for item, own in zip(items, claimed, strict=True)]
    followed = _drop_long_gaps(followed, max_gap)
    if past_only:
        return followed
    return [smooth_shapes(item, shapes, period.poses) for item, shapes in zip(items, followed, strict=True)]


def _follow_object(item: SequenceObject, period: Period, claimed: Sequence[set[int]], past_only: bool) -> list[Shape | None]:
    """F."""
    found = _gather_evidence(item, period, claimed)
    order = range(len(found))
    forward = _follow_in_order(item, period.observations, found, order)
    if past_only:
        return forward
    backward = _follow_in_order(item, period.observations, found, order[::-1])
    is_earlier = _prefer_forward(found, forward, backward)
    return [_merge_passes(item, *each) for each in zip(period.observations, found, forward, backward, is_earlier, strict=True)]


def _prefer_forward(
    evidence: Sequence[_Evidence], forward: Sequence[Shape | None], backward: Sequence[Shape | None]
) -> list[bool]:
    """Tell for each frame whether the shape from earlier frames counts if that from later ones disagrees.

    Once a pass has laid a strand wrongly, its later frames fit: what tells is its cost at the frame in which that happened. So
    between two anchors there is one frame up to which the forward pass counts: that for which the sum of all costs is the least.
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
    """Return how much better the earlier shape of a frame is than the later one, in squared standard deviations.

    Costs that differ by less than 1 tell nothing: then the one counts whose joints were seen more recently.
    """
    earlier, later = float(before.age.sum()), float(after.age.sum())
    return after.cost - before.cost + (later - earlier) / max(later + earlier, 1.0)


def _gather_evidence(item: SequenceObject, period: Period, claimed: Sequence[set[int]]) -> list[_Evidence]:
    """G."""
    anchors = {anchor.frame - period.first: anchor for anchor in item.anchors}
    result = []
    for frame, observation in enumerate(period.observations):
        free = tuple(k for k, strand in enumerate(observation.strands) if strand.chain not in claimed[frame])
        result.append(_Evidence((), np.zeros((0, 3)), free))
        if frame in anchors:
            anchor = anchors[frame]
            chain = observation.detection.chains[anchor.chain]
            placed = _place_anchor(chain, anchor, item, period.poses[frame : frame + 1, :3, 3])
            result[-1] = _Evidence((placed,), _resample_anchor(chain, anchor, item), free)
    return result


def _place_anchor(chain: Chain, anchor: Anchor, item: SequenceObject, center: Floats) -> Placed:
    """Return the seen parts of a whole chain at their places along the object.

    What its length misses is shared among its segments by the variances of their lengths: that of a filled gap is known less.
    """
    count = len(chain.depth_filled)
    shown, sight = visible_joints(chain, 0, count, 0, count, center)
    variance = np.where(chain.occluded, FILLED_ERROR, LENGTH_ERROR) ** 2
    lengths = chain.segment_length + (item.length - chain.length) * variance / variance.sum()
    along = np.append(0.0, np.cumsum(lengths))[shown]
    arcs = item.length - along if anchor.backwards else along
    if item.closed:
        arcs = (arcs + anchor.start * item.length) % item.length
    return Placed(arcs, chain.joints[shown], (0.0, item.length), 0.0, sight)


def _resample_anchor(chain: Chain, anchor: Anchor, item: SequenceObject) -> Floats:
    if item.closed:
        return close_ring(ring_joints(chain, anchor.backwards, anchor.start, item.segments)[:-1], item.segment_length)
    joints, backwards = chain.nodes(item.segments + 1), anchor.backwards
    return relax_lengths(joints[::-1].copy() if backwards else joints, item.segment_length, np.zeros(len(joints), dtype=bool))


def _follow_in_order(
    item: SequenceObject, observations: Sequence[Observation], evidence: Sequence[_Evidence], order: range
) -> list[Shape | None]:
    """Follow the object frame by frame in one direction of time, from the first anchor on."""
    shapes: list[Shape | None] = [None] * len(observations)
    last: Shape | None = None
    motion: Floats = np.zeros(3)
    for frame in order:
        found = evidence[frame]
        expected = found.whole if last is None else last.joints + SPEED_SHARE * motion
        if not len(expected):
            continue
        shape = _fit_object(item, observations[frame], found, expected, last)
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


def _fit_object(
    item: SequenceObject, observation: Observation, found: _Evidence, expected: Floats, last: Shape | None = None
) -> Shape:
    """Return the object bent from where it is expected to what a frame shows."""
    cost = 0.0
    place, fit = (place_on_ring, fit_ring) if item.closed else (place_strands, fit_joints)
    placed = found.own
    if not placed:
        strands = [observation.strands[k] for k in found.strands]
        radius = float(np.nan_to_num(item.radius))
        tolerance, least = max(TOLERANCE_SHARE * item.length, MIN_MOTION_RADII * radius), MIN_STRAND_RADII * radius
        for side, node in enumerate(item.nodes):
            if node is not None:
                strands = cut_strands(strands, expected[-side], least, tolerance)
        if not item.closed:
            strands = cut_misjoined(strands, expected, item.length, least)
        placed = place(strands, expected, item.length, tolerance)
        cost = _mean_cost(strands, placed)
        if placed:
            nearer, *_ = fit(expected, placed, item.length)
            placed = place(strands, nearer, item.length, tolerance) or placed
    joints, seen, measured = fit(expected, placed, item.length)
    age = np.where(seen, 0, (last.age if last is not None else np.full(len(seen), NEVER)) + 1)
    return Shape(joints, seen, age, cost, np.zeros_like(seen) if found.own else ~seen, measured)


def _mean_cost(strands: Sequence[ObservedStrand], placed: Sequence[Placed]) -> float:
    """Return how badly strands fit where they were laid, a mean over their lengths; a strand that fits nowhere costs much."""
    total = sum(strand.length for strand in strands)
    if not total:
        return 0.0
    placed_length = sum(item.span[1] - item.span[0] for item in placed)
    costs = sum(item.cost * (item.span[1] - item.span[0]) for item in placed)
    return (costs + MISSING_COST * max(0.0, total - placed_length)) / total


def _merge_passes(
    item: SequenceObject,
    observation: Observation,
    found: _Evidence,
    before: Shape | None,
    after: Shape | None,
    prefer_forward: bool,
) -> Shape | None:
    """Return the object in a frame, from what comes from earlier and from later frames: blended where the two agree."""
    if before is None or after is None:
        known = before or after
        return None if known is None else _fit_object(item, observation, found, known.joints)
    if not found.own and not _agree(before, after, item.length):
        return before if prefer_forward else after
    return _fit_object(item, observation, found, _blend(before, after))


def _agree(before: Shape, after: Shape, length: float) -> bool:
    """Tell whether two shapes of a frame have its strands in the same places, and are near each other where it shows none."""
    apart = np.linalg.norm(before.joints - after.joints, axis=1)
    return bool(apart.max() <= TOLERANCE_SHARE * length and (apart[before.seen & after.seen] <= LENGTH_ERROR * length).all())


def _blend(before: Shape, after: Shape) -> Floats:
    """Return the joints (M + 1, 3) between those from earlier and from later frames, by how recently each was seen."""
    total = before.age + after.age
    share = np.where(total > 0, before.age / np.maximum(total, 1), 0.5)[:, None]
    return np.asarray(before.joints * (1 - share) + after.joints * share)


def _drop_long_gaps(shapes: Sequence[list[Shape | None]], max_gap: int) -> list[list[Shape | None]]:
    """Drop the objects of a tree from frames in a row without any strand of them, if there are more than `max_gap`."""
    result = [list(each) for each in shapes]
    unseen = [all(shape is None or not shape.seen.any() for shape in frame) for frame in zip(*shapes, strict=True)]
    for first, end in runs(np.array(unseen, dtype=bool)):
        if end - first > max_gap:
            for each in result:
                each[first:end] = [None] * (end - first)
    return result
