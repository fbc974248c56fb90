"""Record the detection of one frame by itself, with all strands seen and how likely their ends are tips."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..camera.background import BackgroundView
from ..chains.fill import fill
from ..chains.refine import estimate_centerline, lay_chains
from ..config import Config
from ..geometry.assembly import Assembly
from ..geometry.curves import runs
from ..geometry.polyline import unit
from ..pipeline import Stages, object_given
from ..scene.context import FrameContext
from ..types import Array, Bools, Chain, ChainEnd, Detection, Floats, Ints
from .depth_readings import readings_along
from .strand_ends import MIN_STRAND_RADII, TIP, tip_confidence

MIN_JOINED_CONFIDENCE = 0.3
"""Smallest confidence of a connection inside a strand; at a less certain one the strand is cut in two, and a chain that is less
certain is no whole object."""

LENGTH_ERROR = 0.02
"""Share of an object's length by which its measured lengths, and with these the positions along it, differ from frame to frame. A
given length may differ as much, a strand may overhang as much, and a tip lies half as far off: lengths are measured to about
1 %."""

JUNCTION_SEGMENTS = 1
"""Segments next to a junction that may be unseen in a strand that ends at the junction."""


def no_sights() -> Floats:
    """Return no sights, (0, 3)."""
    return np.zeros((0, 3))


@dataclass(frozen=True)
class ObservedStrand:
    """A stretch of an object seen in one frame, possibly with hidden parts between seen ones.

    Attributes
    ----------
    points
        (K, 3) m, joints on the seen parts, in order.
    arcs
        (K,) m, arc length of each point from the start of the strand.
    length
        m, arc length of the whole strand.
    tips
        whether the start and the end are tips of the object: TIP, UNKNOWN or CUT_OFF.
    chain
        index in the detection of the chain that the strand is part of; -1 for a strand that is in none.
    sight
        (K, 3) direction in which the place of each point is not known: from the camera where the image shows the strand and its
        depth was not measured, 0 where it was. None: all were measured. Of a strand without any depth the points lie at a
        distance of 1 along their sights, and lengths are angles, rad.
    joined
        (K,) confidence that each point follows the one before on the object: that of a connection in between, else 1. None: 1.
    """

    points: Floats
    arcs: Floats
    length: float
    tips: tuple[float, float]
    chain: int
    sight: Floats = field(default_factory=no_sights)
    joined: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def is_flat(self) -> bool:
        """Whether it was seen in a frame without any depth: its points are at a distance of 1 from a camera."""
        camera = self.points - self.sight if len(self.sight) else self.points
        return len(self.sight) > 0 and bool((np.abs(camera - camera[0]) <= 1e-6).all())


@dataclass(frozen=True)
class Observation:
    """The detection of one frame by itself, with all strands seen.

    Attributes
    ----------
    detection
        the detection of the frame by itself.
    strands
        the chains, cut at doubtful connections, and the pieces that merging dropped.
    pose
        (4, 4) m, camera to world; None if unknown.
    background
        what surrounds the objects: it tells how the camera moves; None for a cloud.
    readings
        for each chain of the detection the depth along it as it was read, from `readings_along`; empty if unknown.
    is_given
        whether the user said what the object is, or how many there are: no chain is left out for its confidence then.
    """

    detection: Detection
    strands: tuple[ObservedStrand, ...]
    pose: Floats | None = None
    background: BackgroundView | None = None
    readings: tuple[Array | None, ...] = ()
    is_given: bool = False


def observe(detection: Detection, stages: Stages, config: Config) -> Observation:
    """Return the observation of a frame: its detection, and all strands seen.

    Parameters
    ----------
    detection
        the detection of the frame.
    stages
        the product of every stage for that frame.
    config
        the settings of the stages.
    """
    context = stages.context
    joined = {end for junction in detection.junctions for end in junction.ends}
    strands: list[ObservedStrand] = []
    readings = []
    for number, chain in enumerate(detection.chains):
        at_junctions = (ChainEnd(number, 0) in joined, ChainEnd(number, 1) in joined)
        own = list(_strands(chain, number, context, at_junctions))
        tips = (own[0].tips[0] == TIP, own[-1].tips[1] == TIP) if own else (False, False)
        readings.append(readings_along(chain, context.foreground, tips))
        strands += own
    for chain in (*_dropped_chains(stages, config), *stages.unchosen):
        strands += _strands(chain, -1, context)
    is_given = config.sequence.chains is not None or object_given(stages, config)
    return Observation(detection, tuple(strands), readings=tuple(readings), is_given=is_given)


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
        seen = bounds(~chain.depth_filled, first, end)
        if not seen.any():
            continue
        low, high = int(np.flatnonzero(seen)[0]), int(np.flatnonzero(seen)[-1])
        ends_there = at_junctions[0] and low <= JUNCTION_SEGMENTS, at_junctions[1] and high >= count - JUNCTION_SEGMENTS
        if first == 0 and (ends_there[0] or not chain.occluded[:low].any()):
            low = 0
        if end == count and (ends_there[1] or not chain.occluded[high:].any()):
            high = count
        length = (high - low) * chain.segment_length
        if length < MIN_STRAND_RADII * context.radius:
            continue
        center = np.zeros((0 if context.foreground.camera is None else 1, 3))
        shown, sight = visible_joints(chain, first, end, low, high, center)
        line = chain.joints[low : high + 1]
        foreground, radius = context.foreground, context.radius
        tips = (
            TIP if ends_there[0] else tip_confidence(line[::-1], foreground, radius),
            TIP if ends_there[1] else tip_confidence(line, foreground, radius),
        )
        arcs = (shown - low) * chain.segment_length
        yield ObservedStrand(chain.joints[shown], arcs, length, tips, number, sight, _joined(chain, shown))


def _joined(chain: Chain, shown: Ints) -> Floats:
    """Return how surely each of some joints (K,) of a chain follows the one before, as of `ObservedStrand`."""
    result = np.ones(len(shown))
    for connection in chain.connections:
        after = int(np.searchsorted(shown, connection.segment, side="right"))
        if 0 < after < len(shown):
            result[after] = min(result[after], connection.confidence)
    return result if (result < 1).any() else np.zeros(0)


def visible_joints(chain: Chain, first: int, end: int, low: int, high: int, center: Floats) -> tuple[Ints, Floats]:
    """Return the joints of a chain that bound a visible segment, and their sights, as of `ObservedStrand`.

    Parameters
    ----------
    chain
        the chain.
    first, end
        range of the segments.
    low, high
        range of the joints, the last included.
    center
        (3,) m, place of the camera; None if no camera saw the chain, or several did: only measured joints are visible then.
    """
    measured, visible = bounds(~chain.depth_filled, first, end), bounds(~chain.occluded, first, end)
    at = np.flatnonzero(measured | visible if len(center) else measured)
    at = at[(at >= low) & (at <= high)]
    if measured[at].all():
        return at, no_sights()
    return at, np.where(measured[at, None], 0.0, unit(chain.joints[at] - center))


def bounds(chosen: Bools, first: int = 0, end: int | None = None) -> Bools:
    """Tell which joints bound one of the chosen segments (N,) from `first` to before `end`: (N + 1,) bool."""
    joints = np.zeros(len(chosen) + 1, dtype=bool)
    segments = first + np.flatnonzero(chosen[first:end])
    joints[segments] = joints[segments + 1] = True
    return joints


def _dropped_chains(stages: Stages, config: Config) -> list[Chain]:
    """Return the pieces that merging dropped, laid along their axes as those of the chains are."""
    context = stages.context
    least = MIN_STRAND_RADII * context.radius
    dropped = [Assembly((item.joints,)) for item in stages.merged.dropped if item.joints.shape[1] == 3 and item.length >= least]
    if not dropped:
        return []
    paths = fill(dropped, context)
    return lay_chains(estimate_centerline(paths, context, config.refine), paths, context, config.refine)
