"""Fit an object to the evidence of one frame: a chain that shows it whole, or strands."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..geometry.equal_segments import close_ring
from ..types import Bools, Chain, Floats
from .chain_matching import MIN_MOTION_RADII
from .object_length import FILLED_ERROR
from .objects import Anchor, SequenceObject
from .observations import LENGTH_ERROR, Observation, ObservedStrand, visible_joints
from .registration import MISSING_COST, TOLERANCE_SHARE, Placed, fit_joints, place_strands, relax_lengths
from .rings import fit_ring, place_on_ring, ring_joints
from .shape import Shape
from .strand_cutting import cut_misjoined, cut_strands
from .strand_ends import MIN_STRAND_RADII, UNKNOWN
from .world_frame import in_camera

ANCHOR_ODDS = 100.0
"""Factor by which the odds that a chain is right are greater if it has the length of the object and follows its motion: of 2,400
frames rendered with a D435 and a stereo camera, of chains with a confidence below .1 four of five are within 20 mm."""

NEVER = 10**6
"""Age, in frames, of a joint that was never visible."""


@dataclass(frozen=True)
class Evidence:
    """The evidence of a frame for one object.

    Attributes
    ----------
    own
        in an anchor, the visible parts of the object's chain with their positions along it; empty in other frames.
    whole
        (M + 1, 3) m, in an anchor, the joints of the whole object; (0, 3) in other frames.
    strands
        indices of the strands of the frame that may belong to the object.
    doubt
        cost of an anchor, from the confidence of its chain; 0 in other frames.
    """

    own: Sequence[Placed]
    whole: Floats
    strands: tuple[int, ...]
    doubt: float = 0.0


class Period(NamedTuple):
    """Successive frames in which objects are followed.

    Attributes
    ----------
    first
        index in the capture of the first frame.
    observations
        the observations of the T frames.
    poses
        (T, 4, 4) m, camera to the frame of the observations; (0, 4, 4) if no camera saw them, or several did.
    is_single
        whether the capture has one object, so that every chain may be of it.
    """

    first: int
    observations: Sequence[Observation]
    poses: Floats
    is_single: bool = False


def gather_evidence(item: SequenceObject, period: Period, claimed: Sequence[set[int]]) -> list[Evidence]:
    """Return the evidence of each frame of a period for one object."""
    anchors = {anchor.frame - period.first: anchor for anchor in item.anchors}
    result = []
    for frame, observation in enumerate(period.observations):
        free = tuple(k for k, strand in enumerate(observation.strands) if strand.chain not in claimed[frame])
        result.append(Evidence((), np.zeros((0, 3)), free))
        if frame in anchors:
            anchor = anchors[frame]
            chain = observation.detection.chains[anchor.chain]
            placed = _place_anchor(chain, anchor, item, period.poses[frame : frame + 1, :3, 3])
            result[-1] = Evidence((placed,), _resample_anchor(chain, anchor, item), free, _doubt(chain.confidence))
    return result


def _doubt(confidence: float) -> float:
    """Return the cost of an anchor whose chain has a confidence, 0 to 1.

    It is the negative logarithm of the probability that the chain is right, given that its length is, and its motion.
    """
    return float(np.log1p((1 / max(confidence, 1e-6) - 1) / ANCHOR_ODDS))


def _place_anchor(chain: Chain, anchor: Anchor, item: SequenceObject, center: Floats) -> Placed:
    """Return the visible parts of a whole chain at their positions along the object.

    The difference between the lengths of chain and object is distributed over the segments in proportion to the variances of
    their lengths, which are larger in filled gaps. center : position of the camera, as for `visible_joints`.
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
    """Return the joints of an anchor's chain as those of the object, (M + 1, 3) m."""
    if item.closed:
        return close_ring(ring_joints(chain, anchor.backwards, anchor.start, item.segments)[:-1], item.segment_length)
    joints, backwards = chain.nodes(item.segments + 1), anchor.backwards
    return relax_lengths(joints[::-1].copy() if backwards else joints, item.segment_length, np.zeros(len(joints), dtype=bool))


def own_shapes(item: SequenceObject, period: Period, frame: int, found: Evidence) -> list[Shape]:
    """Return the chains of a frame that may be the whole object as shapes of it, in both directions.

    They cost the squared deviation of their length, and more the less confident they are. item, period, frame, found : as for
    `fit_object`.
    """
    result = []
    chains = period.observations[frame].detection.chains
    for number in sorted({period.observations[frame].strands[k].chain for k in found.strands} - {-1}):
        chain = chains[number]
        off = (chain.length / item.length - 1) / LENGTH_ERROR
        if item.closed or chain.closed or off**2 >= MISSING_COST:
            continue
        for backwards in (False, True):
            anchor = Anchor(period.first + frame, number, backwards)
            shape = fit_object(item, period, frame, found, _resample_anchor(chain, anchor, item))
            unsure = -2 * np.log(max(chain.confidence, np.exp(-MISSING_COST / 2)))
            result.append(replace(shape, cost=shape.cost + off**2 + float(unsure)))
    return result


def fit_object(
    item: SequenceObject, period: Period, frame: int, found: Evidence, expected: Floats, last: Shape | None = None
) -> Shape:
    """Fit the expected shape of an object to the strands of a frame.

    Parameters
    ----------
    item
        the object.
    period, frame, found
        the frames, the index of the frame in them, and its evidence for the object.
    expected
        (M + 1, 3) m, expected joints.
    last
        the shape in the previous frame, for the ages of the joints; None without one.
    """
    cost, observation = found.doubt, period.observations[frame]
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
            strands = cut_misjoined(strands, expected, item.length, least, not observation.object_given)
        placed = place(strands, expected, item.length, tolerance)
        cost = _mean_cost(strands, placed, MISSING_COST if observation.object_given else UNKNOWN * MISSING_COST)
        if placed:
            nearer, *_ = fit(expected, placed, item.length)
            placed = place(strands, nearer, item.length, tolerance) or placed
    joints, seen, measured = fit(expected, placed, item.length)
    contradicted = _contradicted_share(item, period, frame, joints, seen)
    age = np.where(seen, 0, (last.age if last is not None else np.full(len(seen), NEVER)) + 1)
    cost += MISSING_COST * contradicted
    return Shape(joints, seen, age, cost, np.zeros_like(seen) if found.own else ~seen, measured, contradicted)


def _contradicted_share(item: SequenceObject, period: Period, frame: int, joints: Floats, seen: Bools) -> float:
    """Return the fraction of the joints of an object that are not seen where the camera sees another surface; 0 if unknown."""
    background = period.observations[frame].background
    if not len(period.poses) or background is None:
        return 0.0
    return float((background.contradicts(in_camera(period.poses[frame], joints), item.radius) & ~seen).mean())


def _mean_cost(strands: Sequence[ObservedStrand], placed: Sequence[Placed], missing: float) -> float:
    """Return the mean cost of placed strands, weighted by length.

    missing : cost of a strand that was not placed; less if it may be something else, since the caller did not specify the object.
    """
    total = sum(strand.length for strand in strands)
    if not total:
        return 0.0
    placed_length = sum(item.span[1] - item.span[0] for item in placed)
    costs = sum(item.cost * (item.span[1] - item.span[0]) for item in placed)
    return (costs + missing * max(0.0, total - placed_length)) / total
