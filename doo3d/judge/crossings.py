"""Where strands cross in the view, and which of the two is the upper."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ..geometry.curves import Curves
from ..geometry.intersections import Intersections, find_intersections
from ..geometry.radii import NODE_RADII
from ..kernels import CrossingStrands
from ..scene.cloud import CloudScene
from ..scene.scene import Scene
from ..types import Chain, Crossing, Junction, SegmentRef
from ..types.stopwatch import timed

SAMPLE_DISTANCES = np.linspace(0.0, 5.0, 16)
"""Half-widths beyond the overlap, on both sides, of the samples along a strand."""

OVERLAP_MARGIN = 1.2
"""Half-lengths of the overlap that are left out of what counts as beyond it."""

MIN_ANGLE = 0.3
"""rad; strands that cross at less are taken to cross at this, or their overlap would have no end."""


@timed("crossings")
def find_crossings(chains: list[Chain], scene: Scene, junctions: Sequence[Junction] = ()) -> tuple[Crossing, ...]:
    """Find every place where two strands (stretches of one chain or of two) cross in the view, and which one is on top.

    The view is the camera's. A cloud is viewed from its viewpoint or, if the viewpoint is unknown, from above, against its z
    axis. In 2-D only color tells which strand is upper. Where nothing tells, the strand that comes first in `chains` is named as
    the upper one, with confidence 0.

    Parameters
    ----------
    chains
        the chains of one frame, m (px in 2-D).
    scene
        what was captured; depth and colors say which strand is on top.
    junctions
        where chains meet: chains do not cross there.

    Returns
    -------
    The crossings, each with upper and lower strand, point and confidence. They are sorted by whichever of their two segments
    comes first in `chains`. Empty if no strands cross.
    """
    if not chains:
        return ()
    view = scene.view
    in_view = Curves.of([chain.joints for chain in chains], [chain.closed for chain in chains]).seen_in(view)
    found = find_intersections(in_view)
    if not len(found.angle):
        return ()
    radius = np.array([chain.radius for chain in chains])[found.chain]
    half_width = radius * view.scale(in_view.interpolate(found.chain, found.segment + found.t)[..., 2])
    places = (found.chain, found.segment, found.t, found.angle, found.point)
    overlap = (SAMPLE_DISTANCES, OVERLAP_MARGIN, MIN_ANGLE)
    strands = CrossingStrands(in_view.points, in_view.bounds, in_view.closed, *places, radius, half_width, *overlap)
    log_odds = np.zeros(len(radius)) + scene.upper(strands, half_width)
    crossings = (_crossing(found, k, chains, float(value)) for k, value in enumerate(log_odds))
    return tuple(_without_junctions(crossings, junctions))


def _without_junctions(crossings: Iterable[Crossing], junctions: Sequence[Junction]) -> Iterator[Crossing]:
    """Yield the crossings except those at a junction of the two chains, which meet there and do not cross."""
    nodes = [
        ({end.chain for end in junction.ends}, junction.position, (NODE_RADII * float(junction.radii.max())) ** 2)
        for junction in junctions
    ]
    for crossing in crossings:
        both = {crossing.upper.chain, crossing.lower.chain}
        if not any(both <= chains and ((crossing.point - place) ** 2).sum() < limit for chains, place, limit in nodes):
            yield crossing


def crossings_of_chains(chains: list[Chain], coordinates: str, junctions: Sequence[Junction] = ()) -> tuple[Crossing, ...]:
    """Find every place where strands cross in the view, and which one is on top, from the shapes of the chains alone.

    Parameters
    ----------
    chains
        the chains of one frame, m.
    coordinates
        "camera" for chains in the camera's optical frame, which are viewed from there; others are viewed from above.
    junctions
        where chains meet: they do not cross there.
    """
    if not chains:
        return ()
    points = np.concatenate([chain.joints for chain in chains])
    sensor = np.zeros(3) if coordinates == "camera" else None
    return find_crossings(chains, CloudScene(points, filtered=points, sensor=sensor), junctions)


def _crossing(intersections: Intersections, k: int, chains: list[Chain], log_odds: float) -> Crossing:
    """Return crossing `k`, with log odds that its first strand is the upper."""
    strands = [
        SegmentRef(int(chain), int(segment))
        for chain, segment in zip(intersections.chain[k], intersections.segment[k], strict=True)
    ]
    upper = 0 if log_odds >= 0 else 1
    joints = chains[strands[upper].chain].joints[strands[upper].segment :][:2]
    t = float(intersections.t[k, upper])
    confidence = float(np.tanh(abs(log_odds) / 2))
    return Crossing(strands[upper], strands[1 - upper], joints[0] * (1 - t) + joints[1] * t, confidence)
