"""Records of the decision at a contact of strands: the possible junction, and the data of the frame that decide.

Costs are in the units of merging: 1 per mm (1 per px in 2-D), 100 per radian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...config import MergeConfig
from ...geometry.curves import Curves
from ...types import Floats
from ...visibility import Visibility
from .. import FrameContext


@dataclass(frozen=True)
class Meeting:
    """A possible junction.

    Attributes
    ----------
    gain
        cost of the best other explanation minus that of a junction, cost units; a junction is likely if positive.
    position
        (D,) m (px in 2-D), where the axes meet.
    bodies
        (strand, arc length) of each strand that runs through the junction.
    end
        row in `FreeEnds` of the end that is attached to the strand; None if two strands pass each other.
    """

    gain: float
    position: Floats
    bodies: tuple[tuple[int, float], ...]
    end: int | None = None


@dataclass(frozen=True)
class JunctionContext:
    """The data of a frame by which junctions are decided.

    Attributes
    ----------
    visibility
        free space, hidden space and bare surface; None for a cloud without camera views.
    viewpoint
        (3,) m, position of the camera; None in 2-D, and where it is unknown.
    is_cloud
        whether the data are a cloud of surfaces without camera views.
    max_gap
        m (px in 2-D), longest distance from an end to a strand.
    curvature_persistence
        share of its curvature that an end is expected to keep, 0 to 1, as in merging.
    """

    visibility: Visibility | None
    viewpoint: Floats | None
    is_cloud: bool
    max_gap: float
    curvature_persistence: float

    @staticmethod
    def of(chains: Sequence[Floats], context: FrameContext, config: MergeConfig) -> JunctionContext:
        """Return the data of a frame; chains : joints of each chain, (N + 1, D), beside which the bare surface is measured."""
        visibility = context.visibility
        if visibility is not None:
            visibility = visibility.with_support(Curves.of(chains), context.radius, context.foreground)
        max_gap = config.max_gap * context.gap_unit
        persistence = config.bending.curvature_persistence
        return JunctionContext(visibility, context.foreground.viewpoint, context.shows_surface, max_gap, persistence)
