"""Where strands cross in the view, and which of the two is the upper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..config import CrossingsConfig
from ..geometry.curves import Curves
from ..geometry.intersections import Intersections, find_intersections
from ..geometry.projection import Projection
from ..scene.context import FrameContext
from ..scene.view import projection_of
from ..types import Chain, Crossing, Foreground, SegmentRef
from .upper_strand import upper_strand_log_odds


def find_crossings(chains: list[Chain], context: FrameContext, config: CrossingsConfig) -> tuple[Crossing, ...]:
    """Find every place where two strands (stretches of one chain or of two) cross in the view, and which one is on top.

    The view is the camera's. A cloud is viewed from its viewpoint or, if the viewpoint is unknown, from above, against its z
    axis. In 2-D only color tells which strand is upper. Where nothing tells, the strand that comes first in `chains` is named as
    the upper one, with confidence 0.

    Parameters
    ----------
    chains
        the chains of one frame, m (px in 2-D).
    context
        the data of the frame; depth, colors, camera and viewpoint of the foreground are used.
    config
        section `crossings` of the settings: whether colors count.

    Returns
    -------
    The crossings, each with upper and lower strand, point and confidence. They are sorted by whichever of their two segments
    comes first in `chains`. Empty if no strands cross.
    """
    return _find(chains, context.foreground, context.view, config) if chains else ()


def crossings_of_chains(chains: list[Chain], coordinates: str) -> tuple[Crossing, ...]:
    """Find every place where strands cross in the view, and which one is on top, from the shapes of the chains alone.

    Parameters
    ----------
    chains
        the chains of one frame, m.
    coordinates
        "camera" for chains in the camera's optical frame, which are viewed from there; others are viewed from above.
    """
    if not chains:
        return ()
    viewpoint = np.zeros(3) if coordinates == "camera" else None
    points = np.concatenate([chain.joints for chain in chains])
    foreground = Foreground(points=points, viewpoint=viewpoint)
    return _find(chains, foreground, projection_of(foreground), CrossingsConfig(use_color=False))


def _find(chains: list[Chain], foreground: Foreground, view: Projection, config: CrossingsConfig) -> tuple[Crossing, ...]:
    in_view = Curves.of([chain.joints for chain in chains], [chain.closed for chain in chains]).seen_in(view)
    intersections = find_intersections(in_view)
    if not len(intersections.angle):
        return ()
    radius = np.array([chain.radius for chain in chains])[intersections.chain]
    foreground = foreground if config.use_color else replace(foreground, color=None)
    log_odds = upper_strand_log_odds(intersections, in_view, radius, view, foreground)
    return tuple(_crossing(intersections, k, chains, float(value)) for k, value in enumerate(log_odds))


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
