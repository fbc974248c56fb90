"""The angle by which an end must bend toward the other: equation 3 of Keipour et al. (RA-L 2022)."""

from __future__ import annotations

import numpy as np

from ....geometry.polyline import TINY, angle
from ....types import Floats
from ... import FrameContext
from ..candidates import Candidates, by_rows


def curvature(candidates: Candidates, _: FrameContext) -> Floats:
    """Return the larger bend of each pair of ends times `merge.curvature_weight`, (E, E) cost units.

    The bend of an end is the angle between its tangent half way and the straight line to the other end; 0 for ends that coincide.
    """
    points, outward = candidates.points, candidates.expected_tangents

    def bend_of(rows: slice) -> Floats:
        gap = points[None] - points[rows, None]
        bend = angle(outward[rows], gap)
        bend[candidates.distance[rows] < TINY] = 0
        return bend

    bend = by_rows(bend_of, len(points))
    return np.asarray(candidates.bending.curvature_weight * np.maximum(bend, bend.T))
