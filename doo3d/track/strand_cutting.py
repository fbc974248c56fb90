"""Cut strands whose parts do not follow each other on the object.

Where a hand hides a crossing, a single frame joins the strands at the edge of the hand, often without a gap and with high
confidence. The neighboring frames give the expected shape of the object. Each strand is compared with it point by point, and a
part that fits elsewhere on the object, or in the other direction, becomes a strand of its own.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..geometry.polyline import arc_length, resample
from ..kernels import nearest, strand_cuts
from ..types import Floats, Ints
from .observations import LENGTH_ERROR, ObservedStrand
from .registration import MISSING_COST, SHIFT_TOLERANCES, STEPS_PER_SEGMENT, on_unit_sphere
from .strand_ends import CUT_OFF, UNKNOWN

MISJOIN_RATE = 0.0013
"""Fraction of neighboring points of a strand that a frame joins wrongly without a gap in between: 254 of 195 thousand in
sequences of D435 and stereo cameras."""


def cut_strands(strands: Sequence[ObservedStrand], place: Floats, least: float, tolerance: float) -> list[ObservedStrand]:
    """Cut strands in two at a junction.

    A frame in which the junction is hidden may join two branches through it.

    Parameters
    ----------
    strands
        the strands of a frame.
    place
        (3,) m, position of the junction.
    least
        m, smallest length on both sides of the junction for a strand to be cut.
    tolerance
        m, largest distance of a strand from the junction for it to be cut.

    Returns
    -------
    The strands in the same order, with the two parts of a strand in its place.
    """
    result = []
    for strand in strands:
        distance = np.linalg.norm(strand.points - place, axis=1)
        k = int(np.argmin(distance))
        arc = float(strand.arcs[k])
        if distance[k] > tolerance or min(arc, strand.length - arc) <= least or not 0 < k < len(strand.points) - 1:
            result.append(strand)
            continue
        first, last = strand.tips
        result.append(_part_of(strand, slice(0, k + 1), 0.0, arc, (first, UNKNOWN)))
        result.append(_part_of(strand, slice(k, None), arc, strand.length - arc, (UNKNOWN, last)))
    return result


def cut_misjoined(
    strands: Sequence[ObservedStrand], expected: Floats, length: float, least: float, may_leave: bool = False
) -> list[ObservedStrand]:
    """Cut strands whose parts do not follow each other on the expected object.

    Parameters
    ----------
    strands
        the strands of a frame; strands without depth are compared with the object as seen by the camera.
    expected
        (M + 1, 3) m, expected joints of the object.
    length
        m, length of the object.
    least
        m, length of the shortest part that is kept.
    may_leave
        whether a strand may go on along something else, since the caller did not specify the object.

    Returns
    -------
    The strands in the same order, with the parts of a strand in its place.

    Notes
    -----
    A point costs its squared distance from its place on the object, in units of the error of places, LENGTH_ERROR,
    and at most MISSING_COST. A cut costs -2 ln p, with the probability p that the frame joined the points on both sides
    wrongly: one minus the confidence of the connection where a hidden part was bridged, MISJOIN_RATE elsewhere. The mean
    displacement of the strand has a tolerance of SHIFT_TOLERANCES times that error, since the object may have moved.
    """
    count = STEPS_PER_SEGMENT * (len(expected) - 1)
    if strands and all(strand.is_flat for strand in strands):
        expected = on_unit_sphere(expected, strands[0])
        angle = float(arc_length(expected)[-1])
        if not angle > 0:  # seen end on
            return list(strands)
        least, length = least * angle / length, angle
    places = resample(expected, np.linspace(0.0, arc_length(expected)[-1], count + 1))
    result: list[ObservedStrand] = []
    for strand in strands:
        result += _cut(strand, places, length / count, length, least, may_leave)
    return result


def _cut(
    strand: ObservedStrand, places: Floats, step: float, length: float, least: float, may_leave: bool
) -> Iterator[ObservedStrand]:
    """Yield the parts of a strand that are at least `least` m long.

    places : positions on the object, `step` m apart. length : of the object, m. Points without depth at a cut are in no part.
    """
    measured = np.arange(len(strand.points))
    if len(strand.sight) and not strand.is_flat:
        measured = np.flatnonzero(~strand.sight.any(axis=1))
    if not len(measured):
        yield strand
        return
    points, arcs = strand.points[measured], strand.arcs[measured]
    joined = strand.joined if len(strand.joined) else np.ones(len(strand.points))
    least_joined = np.minimum.reduceat(joined[: measured[-1] + 1], np.append(0, measured[:-1] + 1))
    costs = -2 * np.log(np.maximum(1 - least_joined, MISJOIN_RATE))
    error = LENGTH_ERROR * length
    cuts = strand_cuts(points, arcs, strand.length, places, step, error, MISSING_COST, SHIFT_TOLERANCES, costs)
    if may_leave:
        cuts = np.union1d(cuts, _leaving(points, places, least_joined, error)).astype(np.int64)
    end = len(strand.points) - 1
    firsts, lasts = [0, *measured[cuts].tolist()], [*measured[cuts - 1].tolist(), end]
    for first, last in zip(firsts, lasts, strict=True):
        low = float(strand.arcs[first]) if first else 0.0
        high = float(strand.arcs[last]) if last < end else strand.length
        if last > first and high - low >= least:
            tips = CUT_OFF if first else strand.tips[0], CUT_OFF if last < end else strand.tips[1]
            yield _part_of(strand, slice(first, last + 1), low, high - low, tips)


def _leaving(points: Floats, places: Floats, joined: Floats, error: float) -> Ints:
    """Return the bridged gaps of a strand beyond which its smaller part leaves the object, indices of the points after them.

    A part leaves the object if it is farther from its places (P, 3) m than half of the points (K, 3) m are, by more than an
    error, m. joined : (K,) confidence that each point follows the one before; below 1 at a bridged gap.
    """
    away = nearest(points, places, math.inf)[0]
    off = away - np.median(away) > error
    gaps = [gap for gap in np.flatnonzero(joined < 1).tolist() if gap > 0]
    leaving = (gap for gap in gaps if (off[:gap] if 2 * gap < len(off) else off[gap:]).mean() > 0.5)
    return np.fromiter(leaving, dtype=np.int64)


def _part_of(strand: ObservedStrand, part: slice, start: float, length: float, tips: tuple[float, float]) -> ObservedStrand:
    """Return a part of a strand as a strand of its own.

    Parameters
    ----------
    strand
        the strand.
    part
        range of its points.
    start, length
        m, arc length at which the part starts, and length of the part.
    tips
        classes of the two ends, as in `ObservedStrand`.
    """
    points, arcs, sight, joined = (values[part] for values in (strand.points, strand.arcs, strand.sight, strand.joined))
    return replace(strand, points=points, arcs=arcs - start, length=length, tips=tips, sight=sight, joined=joined)
