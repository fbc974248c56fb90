"""The angle by which an end must bend toward the other: equation 3 of Keipour et al. (RA-L 2022)."""

from __future__ import annotations

from ....types import Floats
from ... import FrameContext
from ..candidates import Candidates


def curvature(candidates: Candidates, _: FrameContext) -> Floats:
    """Return the larger bend of each pair of ends times `merge.curvature_weight`, (E, E) cost units.

    The bend of an end is the angle between its tangent half way and the straight line to the other end; 0 for ends that coincide.
    """
    return candidates.config.angle_weights[1] * candidates.pairs[2]
