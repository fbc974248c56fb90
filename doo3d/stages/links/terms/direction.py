"""The angle between the directions of two ends: equation 2 of Keipour et al. (RA-L 2022)."""

from __future__ import annotations

from ....types import Floats
from ... import FrameContext
from ..candidates import Candidates


def direction(candidates: Candidates, _: FrameContext) -> Floats:
    """Return the turn half way between each pair of ends times `merge.direction_weight`, (E, E) cost units."""
    return candidates.config.angle_weights[0] * candidates.pairs[1]
