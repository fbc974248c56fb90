"""What one frame alone shows of the objects: its detection, and every strand that was seen, with what its ends are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..config import Config
from ..pipeline import Stages
from ..stages import Assembly, FrameContext
from ..stages.fill import fill
from ..stages.refine import estimate_centerline, lay_chains
from ..types import Bools, Chain, ChainEnd, Detection, Floats, Foreground

MIN_STRAND_RADII = 6.0
"""Radii; shorter strands tell nothing about where along an object they belong."""

MIN_JOINED_CONFIDENCE = 0.3
"""Confidence of a connection below which the two sides of it count as two strands."""

LOOKAHEAD_RADII = (1.5, 2.0, 2.5, 3.0)
"""Radii beyond an end at which the frame is asked whether the object ends there."""

OCCLUDER_MARGIN_RADII, MIN_OCCLUDER_MARGIN = 0.6, 0.005
"""Radii, and m, by which what hides a continuation is nearer than it at least: more than the noise of depth on the table."""

JUNCTION_SEGMENTS = 1
"""Segments of a chain beside a junction that need not be seen for its strand to end there."""

TIP, UNKNOWN, CUT_OFF = 1.0, 0.5, 0.0
"""How surely the end of a strand is a tip of its object: in plain view; no depth around; hidden, or continued in the mask."""


@dataclass(frozen=True)
class ObservedStrand:
    """A stretch of an object as one frame shows it, perhaps with hidden parts that are bridged.

    Attributes
    ----------
    points
        (K, 3) m, joints on the seen parts, in order.
    arcs
        (K,) m, arc length from the strand's start to each of them.
    length
        m, from the strand's start to its end.
    tips
        how surely its start and its end are tips of the object: TIP, UNKNOWN or CUT_OFF.
    chain
        index of the chain of the detection that it is part of; -1 for a strand that merging dropped.
    """

    points: Floats
    arcs: Floats
    length: float
    tips: tuple[float, float]
    chain: int


@dataclass(frozen=True)
class Observation:
    """One frame as it is seen by itself.

    Attributes
    ----------
    detection
        the detection of the frame alone.
    strands
        all that was seen: the chains, parted where their connections are doubtful, and what merging dropped.
    """

    detection: Detection
    strands: tuple[ObservedStrand, ...]


def observe(detection: Detection, stages: Stages, config: Config) -> Observation:
    """Return what a frame alone shows.

    Parameters
    ----------
    detection
        the detection of the frame.
    stages
        what every stage made of it.
    config
        the settings of the stages.
    """
    context = stages.context
    joined = {end for junction in detection.junctions for end in junction.ends}
    strands: list[ObservedStrand] = []
    for number, chain in enumerate(detection.chains):
        at_junctions = (ChainEnd(number, 0) in joined, ChainEnd(number, 1) in joined)
        strands += _strands(chain, number, context, at_junctions)
    for chain in _dropped_chains(stages, config):
        strands += _strands(chain, -1, context)
    return Observation(detection, tuple(strands))


def _strands(
    chain: Chain, number: int, context: FrameContext, at_junctions: tuple[bool, bool] = (False, False)
) -> Iterator[ObservedStrand]:
    """Yield the strands of an open chain, parted at doubtful connections; too short ones are left out.

    Parameters
    ----------
    chain, number
        the chain, and its index in the detection.
    context
        the data of the frame.
    at_junctions
        whether its first and its last end are at junctions, where they are as sure as a tip.
    """
    if chain.closed:
        return
    count = len(chain.occluded)
    doubtful = [connection.segment for connection in chain.connections if connection.confidence < MIN_JOINED_CONFIDENCE]
    parted = ~chain.occluded
    for segment in doubtful:
        parted[segment] = False
    edges = [0]
    for segment in doubtful:
        gap = next(((first, end) for first, end in runs(~parted) if first <= segment < end), (segment, segment + 1))
        edges += list(gap)
    edges.append(count)
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        seen = _seen_joints(chain, first, end)
        if not seen.any():
            continue
        low, high = int(np.flatnonzero(seen)[0]), int(np.flatnonzero(seen)[-1])
        ends_there = at_junctions[0] and low <= JUNCTION_SEGMENTS, at_junctions[1] and high >= count - JUNCTION_SEGMENTS
        low, high = (0 if ends_there[0] else low), (count if ends_there[1] else high)
        length = (high - low) * chain.segment_length
        if length < MIN_STRAND_RADII * context.radius:
            continue
        at = np.flatnonzero(seen)
        line = chain.joints[low : high + 1]
        tips = TIP if ends_there[0] else _is_tip(line[::-1], context), TIP if ends_there[1] else _is_tip(line, context)
        yield ObservedStrand(chain.joints[at], (at - low) * chain.segment_length, length, tips, number)


def _seen_joints(chain: Chain, first: int, end: int) -> Bools:
    """Tell which joints of a chain bound a seen segment of those from `first` to before `end`: (N + 1,) bool."""
    seen = np.zeros(len(chain.joints), dtype=bool)
    segments = first + np.flatnonzero(~chain.depth_filled[first:end])
    seen[segments] = seen[segments + 1] = True
    return seen


def _is_tip(line: Floats, context: FrameContext) -> float:
    """Return how surely a line (K, 3) m of joints ends at a tip of the object."""
    foreground, radius = context.foreground, context.radius
    back = line[max(0, len(line) - 4)]
    direction = (line[-1] - back) / max(float(np.linalg.norm(line[-1] - back)), 1e-12)
    ahead = line[-1] + radius * np.array(LOOKAHEAD_RADII)[:, None] * direction
    return _tip_in_view(ahead, foreground, radius)


def _tip_in_view(ahead: Floats, foreground: Foreground, radius: float) -> float:
    """Return how surely positions (K, 3) m beyond an end are empty."""
    if foreground.camera is None or foreground.depth is None or foreground.mask is None:
        return UNKNOWN
    height, width = foreground.mask.shape
    pixels = np.rint(foreground.camera.project(ahead)).astype(np.int64)
    inside = ((pixels >= 0) & (pixels < (width, height))).all(axis=1)
    if not inside.all():
        return CUT_OFF
    u, v = pixels.T
    reading, masked = foreground.depth[v, u], foreground.mask[v, u]
    margin = max(OCCLUDER_MARGIN_RADII * radius, MIN_OCCLUDER_MARGIN)
    hides = (reading > 0) & (reading < ahead[:, 2] - margin) & ~masked  # the object's own surface hides nothing
    if hides.any() or masked[1:].all():
        return CUT_OFF
    return TIP if ((reading > 0) & ~masked).any() else UNKNOWN


def cut_strands(strands: Sequence[ObservedStrand], place: Floats, least: float, tolerance: float) -> list[ObservedStrand]:
    """Return strands, cut in two where they pass a junction: a frame may join two parts through one that it does not show.

    Parameters
    ----------
    strands
        what was seen.
    place
        (3,) m, of the junction.
    least
        m, length of a strand on both sides of the junction from which on it is cut.
    tolerance
        m, within which a strand passes the junction.
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
        before, after = slice(0, k + 1), slice(k, None)
        result.append(ObservedStrand(strand.points[before], strand.arcs[before], arc, (first, UNKNOWN), strand.chain))
        rest = strand.length - arc
        result.append(ObservedStrand(strand.points[after], strand.arcs[after] - arc, rest, (UNKNOWN, last), strand.chain))
    return result


def runs(values: Bools) -> list[tuple[int, int]]:
    """Return (first, end) of each run of True in (N,) bool: values[first:end] are True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], values, [False])).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def _dropped_chains(stages: Stages, config: Config) -> list[Chain]:
    """Return the pieces that merging dropped, laid along their axes as those of the chains are."""
    context = stages.context
    least = MIN_STRAND_RADII * context.radius
    dropped = [
        item.chain
        for item in stages.merged.dropped
        if item.chain.joints.shape[1] == 3 and (len(item.chain.joints) - 1) * item.chain.segment_length >= least
    ]
    if not dropped:
        return []
    paths = fill([Assembly((chain.joints,)) for chain in dropped], context)
    return lay_chains(estimate_centerline(paths, context, config.refine), paths, context, config.refine)
