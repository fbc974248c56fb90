"""Cut strands where one frame joined parts that do not follow each other on the object.

Where a hand hides a crossing, a frame by itself joins the strands that meet at the edge of the hand, often without a gap and with
confidence. The frames around know the object. So each strand is compared point by point with where the object is expected, and a
part that lies elsewhere on the object, or runs the other way, becomes a strand of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..geometry.polyline import arc_length, resample
from ..kernels import strand_cuts
from ..types import Floats
from .observations import CUT_OFF, LENGTH_ERROR, ObservedStrand
from .registration import MISSING_COST, STEPS_PER_SEGMENT


def cut_misjoined(strands: Sequence[ObservedStrand], expected: Floats, length: float, least: float) -> list[ObservedStrand]:
    """Cut strands where their parts do not follow each other on the object as it is expected.

    Parameters
    ----------
    strands
        the strands of a frame; those without any depth stay whole.
    expected
        (M + 1, 3) m, expected joints of the object.
    length
        m, length of the object.
    least
        m, length of the shortest part that is kept.

    Returns
    -------
    The strands in the same order; the parts of a strand take its place.

    Notes
    -----
    A point costs its squared distance from its place on the object, in units of the error of places, LENGTH_ERROR, and at most
    MISSING_COST. A cut costs as much as one point that lies nowhere: with half as much, the noise of stereo cameras cuts strands,
    with twice as much, short parts stay joined (11 sequences by stereo cameras, 8 of knots).
    """
    count = STEPS_PER_SEGMENT * (len(expected) - 1)
    places = resample(expected, np.linspace(0.0, arc_length(expected)[-1], count + 1))
    result: list[ObservedStrand] = []
    for strand in strands:
        result += [strand] if strand.is_flat else _cut(strand, places, length / count, length, least)
    return result


def _cut(strand: ObservedStrand, places: Floats, step: float, length: float, least: float) -> Iterator[ObservedStrand]:
    """Yield the parts of a strand, of at least `least` m; points without depth beside a cut are in no part."""
    measured = np.arange(len(strand.points)) if strand.sight is None else np.flatnonzero(~strand.sight.any(axis=1))
    points, arcs = strand.points[measured], strand.arcs[measured]
    cuts = strand_cuts(points, arcs, strand.length, places, step, LENGTH_ERROR * length, MISSING_COST, MISSING_COST)
    end = len(strand.points) - 1
    firsts, lasts = [0, *measured[cuts].tolist()], [*measured[cuts - 1].tolist(), end]
    for first, last in zip(firsts, lasts, strict=True):
        low = float(strand.arcs[first]) if first else 0.0
        high = float(strand.arcs[last]) if last < end else strand.length
        if last > first and high - low >= least:
            tips = CUT_OFF if first else strand.tips[0], CUT_OFF if last < end else strand.tips[1]
            part = slice(first, last + 1)
            sight = None if strand.sight is None else strand.sight[part]
            yield replace(
                strand, points=strand.points[part], arcs=strand.arcs[part] - low, length=high - low, tips=tips, sight=sight
            )
