"""What may meet where strands come together, and what decides between the readings of such a place.

Costs are in the units of merging: 1 per mm (1 per px in 2-D), 100 per radian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...config import MergeConfig
from ...types import Floats
from ...visibility import Visibility
from .. import FrameContext
from .clouds import Surface


@dataclass(frozen=True)
class Meeting:
    """A place that may be a junction, and by how much that reading is cheaper than the best other.

    Attributes
    ----------
    gain
        cost units; over 0 for a junction.
    position
        (D,) m (px in 2-D), where the axes would meet.
    bodies
        (strand, arc length) of each strand that runs through the place.
    end
        row in `FreeEnds` of the end that meets the strand there; None if two bodies meet.
    """

    gain: float
    position: Floats
    bodies: tuple[tuple[int, float], ...]
    end: int | None = None


@dataclass(frozen=True)
class JunctionContext:
    """What a frame tells beside its chains.

    Attributes
    ----------
    visibility
        tells free from hidden space, and bare surface; None for a cloud without camera views.
    viewpoint
        (3,) m, where the camera is; None in 2-D, and where it is unknown.
    surface
        of a cloud without camera views; None for other data.
    max_gap
        m (px in 2-D), longest way from an end to a strand.
    """

    visibility: Visibility | None
    viewpoint: Floats | None
    surface: Surface | None
    max_gap: float

    @staticmethod
    def of(chains: Sequence[Floats], context: FrameContext, config: MergeConfig) -> JunctionContext:
        """Return the context of a frame; chains : the joints of each, beside which the bare surface is looked at."""
        visibility = context.visibility
        if visibility is not None:
            visibility = visibility.with_bare_surface(chains, context.radius, context.foreground)
        max_gap = config.max_gap * context.gap_unit
        return JunctionContext(visibility, context.foreground.viewpoint, Surface.of(context), max_gap)
