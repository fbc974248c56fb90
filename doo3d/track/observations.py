"""Record the detection of one frame with all its visible strands."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..chains.fill import fill
from ..chains.refine import estimate_centerline, lay_chains
from ..config import Config
from ..geometry.assembly import Assembly
from ..geometry.curves import runs
from ..geometry.polyline import unit
from ..pipeline import Stages
from ..scene.frame import FrameScene
from ..scene.scene import Scene
from ..types import Bools, Chain, ChainEnd, Detection, Floats, Ints
from .background import BackgroundView
from .strand_ends import MIN_STRAND_RADII, TIP, UNKNOWN, tip_confidence

MIN_JOINED_CONFIDENCE = 0.3
"""Smallest confidence of a connection within a strand, and of the chain of a whole object. A strand is cut at a connection
below it."""

LENGTH_ERROR = 0.02
"""Fraction of an object's length by which its measured lengths, and positions along it, differ from frame to frame. A given
length may be off by as much, a strand may overhang by as much, and a tip is off by half of it: lengths are measured to
about 1 %."""

JUNCTION_SEGMENTS = 1
"""Number of segments at a junction that may be hidden in a strand that ends at the junction."""


def no_sights() -> Floats:
    """Return the sights of a strand with measured depth, (0, 3)."""
    return np.zeros((0, 3))


@dataclass(frozen=True)
class ObservedStrand:
    """A stretch of an object in one frame, with hidden parts between visible ones.

    Attributes
    ----------
    points
        (K, 3) m, joints of the visible parts, in order.
    arcs
        (K,) m, arc length of each point from the start of the strand.
    length
        m, arc length of the whole strand.
    tips
        kind of the start and of the end, TIP, UNKNOWN or CUT_OFF of `strand_ends`.
    chain
        index in the detection of the chain that contains the strand; -1 for a strand of no chain.
    sight
        (K, 3) unit, direction from the camera to each point whose depth was not measured, along which its position is unknown;
        0 for measured points. (0, 3) if all are measured. The points of a strand without any depth are at a distance of 1 from
        the camera, and lengths are angles, rad.
    joined
        (K,) confidence that each point follows the one before on the object: that of the connection in between, else 1. (0,)
        if all are 1.
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
        """Whether the frame had no depth: all points are 1 from the camera."""
        camera = self.points - self.sight if len(self.sight) else self.points
        return len(self.sight) > 0 and bool((np.abs(camera - camera[0]) <= 1e-6).all())


@dataclass(frozen=True)
class Observation:
    """The detection of one frame by itself, with all visible strands.

    Attributes
    ----------
    detection
        the detection of the frame by itself.
    strands
        the chains, cut at doubtful connections, and the pieces that merging dropped.
    pose
        (4, 4) m, camera to world; None if unknown.
    background
        small view of the background of the objects; None for a cloud.
    is_given
        whether the caller specified the object or the number of objects: then no chain is left out for low confidence.
    object_given
        whether the caller specified the object, by a mask or its color: then strands are of an object from end to end.
    """

    detection: Detection
    strands: tuple[ObservedStrand, ...]
    pose: Floats | None = None
    background: BackgroundView | None = None
    is_given: bool = False
    object_given: bool = False


def observe(detection: Detection, stages: Stages, config: Config) -> Observation:
    """Return the observation of a frame: its detection and all visible strands.

    Parameters
    ----------
    detection
        the detection of the frame.
    stages
        the results of all stages for the frame.
    config
        the settings of the stages.
    """
    scene = stages.scene
    joined = {end for junction in detection.junctions for end in junction.ends}
    strands: list[ObservedStrand] = []
    for number, chain in enumerate(detection.chains):
        at_junctions = (ChainEnd(number, 0) in joined, ChainEnd(number, 1) in joined)
        strands += _strands(chain, number, scene, at_junctions)
    for chain in (*_dropped_chains(stages, config), *stages.verdict.unchosen):
        strands += _strands(chain, -1, scene)
    if not scene.object_given:  # a strand may go on along something else, and end with that
        strands = [replace(strand, tips=(min(strand.tips[0], UNKNOWN), min(strand.tips[1], UNKNOWN))) for strand in strands]
    return Observation(detection, tuple(strands), is_given=stages.is_given, object_given=scene.object_given)


def _strands(
    chain: Chain, number: int, scene: Scene, at_junctions: tuple[bool, bool] = (False, False)
) -> Iterator[ObservedStrand]:
    """Yield the strands of an open chain, cut at doubtful connections.

    Strands shorter than MIN_STRAND_RADII are left out.

    Parameters
    ----------
    chain, number
        the chain, and its index in the detection.
    scene
        what was captured.
    at_junctions
        whether its first and its last end are at junctions, where they are as certain as a tip.
    """
    if chain.closed:
        return
    count = len(chain.occluded)
    doubtful = [connection.segment for connection in chain.connections if connection.confidence < MIN_JOINED_CONFIDENCE]
    parted = ~chain.occluded
    parted[doubtful] = False
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
        if length < MIN_STRAND_RADII * scene.radius:
            continue
        center = np.zeros((int(isinstance(scene, FrameScene)), 3))
        shown, sight = visible_joints(chain, first, end, low, high, center)
        line = chain.joints[low : high + 1]
        tips = (
            TIP if ends_there[0] else tip_confidence(line[::-1], scene, scene.radius),
            TIP if ends_there[1] else tip_confidence(line, scene, scene.radius),
        )
        arcs = (shown - low) * chain.segment_length
        yield ObservedStrand(chain.joints[shown], arcs, length, tips, number, sight, _joined(chain, shown))


def _joined(chain: Chain, shown: Ints) -> Floats:
    """Return the confidence that each joint follows the one before, (K,).

    shown : (K,) indices of the joints, ascending. Returns (0,) if all are 1.
    """
    result = np.ones(len(shown))
    for connection in chain.connections:
        after = int(np.searchsorted(shown, connection.segment, side="right"))
        if 0 < after < len(shown):
            result[after] = min(result[after], connection.confidence)
    return result if (result < 1).any() else np.zeros(0)


def visible_joints(chain: Chain, first: int, end: int, low: int, high: int, center: Floats) -> tuple[Ints, Floats]:
    """Return the joints at visible segments of a chain, and their sights.

    Parameters
    ----------
    chain
        the chain.
    first, end
        range of the segments.
    low, high
        range of the joints, the last one included.
    center
        (1, 3) m, position of the camera; (0, 3) if no camera saw the chain, or several did: then only measured joints are
        visible.

    Returns
    -------
    indices : (K,) of the joints, ascending.
    sights : (K, 3), or (0, 3) if all are measured, as in `ObservedStrand`.
    """
    measured, visible = bounds(~chain.depth_filled, first, end), bounds(~chain.occluded, first, end)
    at = np.flatnonzero(measured | visible if len(center) else measured)
    at = at[(at >= low) & (at <= high)]
    if measured[at].all():
        return at, no_sights()
    return at, np.where(measured[at, None], 0.0, unit(chain.joints[at] - center))


def bounds(chosen: Bools, first: int = 0, end: int | None = None) -> Bools:
    """Return which joints bound a chosen segment, (N + 1,) bool.

    chosen : (N,) bool, of N segments. first, end : range of the segments that count, the last one excluded.
    """
    joints = np.zeros(len(chosen) + 1, dtype=bool)
    segments = first + np.flatnonzero(chosen[first:end])
    joints[segments] = joints[segments + 1] = True
    return joints


def _dropped_chains(stages: Stages, config: Config) -> list[Chain]:
    """Return the pieces that merging dropped, as chains along their axes."""
    if not stages.merged.dropped:
        return []
    scene, length = stages.scene, config.fit.length
    least = MIN_STRAND_RADII * scene.radius
    dropped = [Assembly((item.joints,)) for item in stages.merged.dropped if item.joints.shape[1] == 3 and item.length >= least]
    if not dropped:
        return []
    paths = fill(dropped, length)
    samples = estimate_centerline(paths, scene, length, config.refine)
    return lay_chains(samples, paths, stages.graph.grid.centroids, scene, config.refine)
