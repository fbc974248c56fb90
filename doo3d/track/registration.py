"""Register the strands of a frame with an object of approximately known shape.

An object does not stretch, so a strand covers the same length of the object as its own. Its start and its direction along the
object are unknown, and are searched. Then the object is fitted to the strands, starting from its expected shape. Joints
between strands, or beyond the last one, move with their neighbors and keep the expected shape as far as the length allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import accumulate, combinations_with_replacement
from operator import itemgetter

import numpy as np
from scipy.linalg.lapack import dpbsv

from ..geometry.polyline import arc_length, resample, unit
from ..kernels import equalize_lengths, strand_places
from ..types import Bools, Floats
from .observations import LENGTH_ERROR, ObservedStrand, no_sights

STEPS_PER_SEGMENT = 3
"""Number of positions per segment that are tried for the start of a strand."""

MISSING_COST = 25.0
"""Largest cost of placing the tip of a strand away from the end of the object, and cost of a strand that fits nowhere, in
squared standard deviations: 5 of them."""

SHIFT_TOLERANCES = 2.5
"""Ratio of the tolerance of a strand's mean displacement to that of a change of its shape. The displacement weighs less by its
square, since the whole object may have moved."""

TOLERANCE_SHARE = 0.06
"""Largest distance of a strand from the expected shape, as a fraction of the object's length; as in tracking, MIN_MOTION_RADII
are always allowed."""

TURN_WEIGHT, PLACE_WEIGHT = 0.02, 3e-6
"""Weights of the first differences of the displacements from the expected shape, and of the displacements themselves, relative
to 1 for their second differences and for a joint of a strand. Beyond a strand an object turns with it; this fades over (1 /
0.02)^(1/2) = 7 segments, and the displacement fades much more slowly."""

LENGTH_ROUNDS, LENGTH_TOLERANCE = 60, 1e-3
"""Largest number of iterations in which segments are brought to their length, and relative tolerance of that length."""


@dataclass(frozen=True)
class Placed:
    """A strand with its position along an object.

    Attributes
    ----------
    arcs
        (K,) m, arc length on the object of each sample of the strand.
    points
        (K, 3) m, the samples.
    span
        (first, last) m, arc lengths on the object between which the strand is placed.
    cost
        misfit in squared standard deviations; 0 for a perfect fit.
    sight
        (K, 3) unit, as in `ObservedStrand`.
    """

    arcs: Floats
    points: Floats
    span: tuple[float, float]
    cost: float
    sight: Floats = field(default_factory=no_sights)

    @property
    def measured(self) -> Placed:
        """The samples with measured depth."""
        if not len(self.sight):
            return self
        known = ~self.sight.any(axis=1)
        return Placed(self.arcs[known], self.points[known], self.span, self.cost)


def place_strands(strands: Sequence[ObservedStrand], expected: Floats, length: float, tolerance: float) -> list[Placed]:
    """Find the position of each strand of a frame along an object.

    Strands are placed in order of descending length. Each takes the position of least cost: distance from the expected shape,
    and distance of its tips from the ends of the object. Strands do not overlap, and the object must be long enough to reach
    from one to the next. The mean displacement of a strand weighs little, since the object may have moved.

    Parameters
    ----------
    strands
        the strands of the frame.
    expected
        (M + 1, 3) m, expected joints of the object.
    length
        m, length of the object.
    tolerance
        m, largest RMS distance of a strand from the expected shape; a strand farther away belongs to another object.

    Returns
    -------
    The strands that were placed, in their order along the object.

    Notes
    -----
    Strands without depth are placed on the unit sphere around the camera, onto which the object is projected.
    """
    if not strands or not all(strand.is_flat for strand in strands):
        return _place(strands, expected, length, tolerance)
    center = strands[0].points[0] - strands[0].sight[0]
    seen = on_unit_sphere(expected, strands[0])
    along = arc_length(seen)
    if not along[-1] > 0:  # seen end on
        return []
    on_sphere = [replace(strand, sight=strand.sight[:0]) for strand in strands]
    placed = _place(on_sphere, seen, along[-1], tolerance * along[-1] / length)
    arcs = np.linspace(0.0, length, len(expected))
    result = []
    for item in placed:
        first, last = np.interp(item.span, along, arcs).tolist()
        on_object, sight = np.interp(item.arcs, along, arcs), item.points - center
        result.append(replace(item, arcs=on_object, span=(first, last), sight=sight))
    return result


def on_unit_sphere(joints: Floats, strand: ObservedStrand) -> Floats:
    """Return joints (M + 1, 3) m projected onto the unit sphere around the camera.

    strand : a strand without depth, whose sights give the position of the camera.
    """
    center = strand.points[0] - strand.sight[0]
    return np.asarray(center + unit(joints - center))


def _place(strands: Sequence[ObservedStrand], expected: Floats, length: float, tolerance: float) -> list[Placed]:
    """Place strands along an object in the same space, as `place_strands`."""
    if not strands:
        return []
    starts, costs, backwards = strand_places(
        *_joined(strands),
        np.array([0, *accumulate(len(strand.arcs) for strand in strands)]),
        np.array([strand.length for strand in strands], dtype=float),
        np.array([strand.tips for strand in strands], dtype=float),
        expected,
        length,
        tolerance,
        steps=STEPS_PER_SEGMENT,
        length_error=LENGTH_ERROR,
        shift_tolerances=SHIFT_TOLERANCES,
        max_tip_cost=MISSING_COST,
    )
    placed = []
    places = zip(starts.tolist(), costs.tolist(), backwards.tolist(), strands, strict=True)
    for start, cost, is_backwards, strand in sorted((each for each in places if each[0] < np.inf), key=itemgetter(0)):
        along = start + (strand.length - strand.arcs if is_backwards else strand.arcs)
        placed.append(Placed(along, strand.points, (start, start + strand.length), cost, strand.sight))
    return placed


def _joined(items: Sequence[ObservedStrand | Placed]) -> tuple[Floats, Floats, Floats]:
    """Return the points, arc lengths and sights of all strands, one after another.

    (N, 3) m, (N,) m and (N, 3); sights are 0 for measured points.
    """
    sights = [item.sight if len(item.sight) else np.zeros_like(item.points) for item in items]
    points, arcs = [item.points for item in items], [item.arcs for item in items]
    return np.concatenate(points), np.concatenate(arcs), np.concatenate(sights)


def fit_joints(expected: Floats, placed: Sequence[Placed], length: float) -> tuple[Floats, Bools, Bools]:
    """Fit the joints of an object to the strands placed on it.

    Parameters
    ----------
    expected
        (M + 1, 3) m, expected joints of the object.
    placed
        the strands, with their positions along the object.
    length
        m, length of the object.

    Returns
    -------
    joints : (M + 1, 3) m, neighbors about `length` / M apart.
    seen, measured : (M + 1,) bool, True for joints covered by a strand, and for joints covered by its measured samples.

    Notes
    -----
    Regularized least squares: the displacement d of the expected joints minimizes the squared distances from the
    samples, those without depth across their sights, plus |d''|^2, TURN_WEIGHT |d'|^2 and PLACE_WEIGHT |d|^2, with differences
    for derivatives. Then the joints between strands are spaced evenly, and the remaining errors of lengths are removed with
    little motion of visible joints (Mueller et al., "Position based dynamics", 2007).
    """
    segment = length / (len(expected) - 1)
    bent = _fit_to_samples(expected, placed, segment) if placed else expected
    seen = covered(placed, len(expected), segment)
    measured = seen & covered([item.measured for item in placed], len(expected), segment)
    return relax_lengths(bent, segment, seen), seen, measured


def _fit_to_samples(expected: Floats, placed: Sequence[Placed], segment: float) -> Floats:
    """Return joints (M + 1, 3) m fitted to measured samples, then to all of them.

    Joints between strands are spaced evenly. segment : m, length of a segment.
    """
    points, arcs, sights = _joined(placed)
    joints, measured = expected, ~sights.any(axis=1)
    for used in [measured] if measured.all() else [measured, measured | True]:
        if used.any():
            joints = joints + _displacements(joints, points[used], arcs[used] / segment, sights[used])
    last = len(joints) - 1
    near = np.rint(arcs / segment).astype(int)
    is_fixed = np.zeros(last + 1, dtype=bool)
    is_fixed[near[(near >= 0) & (near <= last)]] = is_fixed[0] = is_fixed[last] = True
    fixed, along = np.flatnonzero(is_fixed), arc_length(joints)
    return resample(joints, np.interp(np.arange(last + 1), fixed, along[fixed]))


def _displacements(joints: Floats, points: Floats, at: Floats, sights: Floats) -> Floats:
    """Return the least-squares displacements of joints, as of `fit_joints`.

    joints : (M + 1, 3) m. points, at, sights : (K, 3) m, the samples; (K,), position of each in segments; (K, 3) as in
    `ObservedStrand`.
    """
    count = len(joints)
    at = np.clip(at, 0.0, count - 1 - 1e-9)
    low = at.astype(int)
    shares = ((low, 1 - at + low), (low + 1, at - low))  # weights of the joints before and after each sample
    misfit = points - sum(share[:, None] * joints[joint] for joint, share in shares)
    misfit -= (misfit * sights).sum(axis=1, keepdims=True) * sights
    bands, right = _penalties(count).copy(), np.zeros((count, 3))
    np.add.at(bands[1], low, shares[0][1] * shares[1][1])
    for joint, share in shares:
        np.add.at(bands[0], joint, share**2)
        np.add.at(right, joint, share[:, None] * misfit)
    return np.asarray(dpbsv(bands, right, lower=True)[1])


@cache
def _penalties(count: int) -> Floats:
    """Return the lower bands (3, N) of the normal equations without samples.

    The diagonal comes first.
    """
    bands = np.zeros((3, count))
    for difference, weight in (((1.0,), PLACE_WEIGHT), ((-1.0, 1.0), TURN_WEIGHT), ((1.0, -2.0, 1.0), 1.0)):
        for a, b in combinations_with_replacement(range(len(difference)), 2):
            bands[b - a, a : max(count - len(difference) + 1, 0) + a] += weight * difference[a] * difference[b]
    return bands


def covered(placed: Sequence[Placed], count: int, segment: float) -> Bools:
    """Return which of `count` joints of an object are covered by strands, (count,).

    segment : m, distance between joints.
    """
    seen = np.zeros(count, dtype=bool)
    near = np.rint(np.concatenate([np.zeros(0), *(item.arcs for item in placed)]) / segment).astype(int)
    seen[near[(near >= 0) & (near < count)]] = True
    holes = ~seen[1:-1] & seen[:-2] & seen[2:]  # between samples slightly more than a segment apart
    seen[1:-1] |= holes
    return seen


def relax_lengths(joints: Floats, segment: float, fixed: Bools) -> Floats:
    """Move joints (M + 1, 3) m until neighbors are `segment` m apart, to about 0.1 %.

    fixed : (M + 1,) bool, True for joints that move 50 times less than the others: LENGTH_ERROR for its value alone.
    """
    mobility = np.where(fixed, LENGTH_ERROR, 1.0)
    return equalize_lengths(np.ascontiguousarray(joints, dtype=float), segment, mobility, LENGTH_ROUNDS, LENGTH_TOLERANCE)


def exact_lengths(joints: Floats, segment: float) -> Floats:
    """Move joints (M + 1, D) m until neighbors are exactly `segment` m apart.

    Each step of Newton's method is the smallest one, in the sum of squares, that satisfies the lengths to first order. The
    remaining error is removed along the segments, about the mean of the joints.
    """
    for _ in range(LENGTH_ROUNDS):
        direction, length = _directions(joints)
        if np.abs(length - segment).max() < LENGTH_TOLERANCE * segment:
            break
        bands = np.full((2, len(length)), 2.0)  # of the constraint matrix: diagonal, and below it
        bands[1, :-1] = -np.einsum("ij,ij->i", direction[1:], direction[:-1])
        tension = dpbsv(bands, length - segment, lower=True)[1]
        move = np.diff(tension[:, None] * direction, axis=0, prepend=0.0, append=0.0)
        joints = joints + move * min(1.0, segment / np.linalg.norm(move, axis=1).max())
    exact = np.cumsum(np.concatenate((joints[:1], segment * _directions(joints)[0])), axis=0)
    return np.asarray(exact + (joints - exact).mean(axis=0))


def _directions(joints: Floats) -> tuple[Floats, Floats]:
    """Return the unit directions (M, D) and lengths (M,) of segments.

    Where two joints coincide, the direction is along the first axis.
    """
    offset = joints[1:] - joints[:-1]
    length = np.sqrt(np.einsum("ij,ij->i", offset, offset))
    offset[length == 0, 0] = 1.0
    return offset / np.where(length > 0, length, 1.0)[:, None], length
