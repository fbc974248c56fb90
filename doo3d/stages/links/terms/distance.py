"""The distance between two ends: equation 1 of Keipour et al. (RA-L 2022)."""

from __future__ import annotations

from ....types import Floats
from ... import FrameContext
from ..candidates import Candidates


def distance(candidates: Candidates, _: FrameContext) -> Floats:
    """Return the distance of each pair of ends times `merge.distance_weight`, (E, E) cost units."""
    return candidates.config.distance_weight * candidates.unit_cost * candidates.distance
