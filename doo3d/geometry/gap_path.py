"""Connect two ends by a tangent path: arc, line, arc (Dubins CSC path).

Keipour et al. (RA-L 2022, section III-G) close a gap in the plane with circles that touch the two end lines (the straight
continuations of the ends). The paths here cover their cases, and ends in space whose lines do not meet: arc, line, arc, of one
radius, each arc in the plane of its end's direction and the line. Where the end lines meet ahead of both ends, the radius is
that of the largest circle that touches both lines there, and in the plane one of the two arcs has no length. Elsewhere the
radius is free.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .. import kernels
from ..types import Floats

MAX_DEVIATION_DEG = 20.0
"""Largest angle between the line and the straight connection of the ends, degrees, when the radius of the arcs is chosen."""


@dataclass(frozen=True)
class GapPath:
    """The path across a gap: arc, line and arc; a line; or a line that was seen.

    Attributes
    ----------
    ends
        (2, D) m (px in 2-D), start and end of the path; (1, D) if they are at the same position; (P, D), the points of a line
        along which the object is seen.
    rows
        (2, 3 D + 2), one arc per row, at the first and at the second end. Each arc starts at its end and runs into the gap;
        the straight line joins the points where the two arcs end. Columns: start (D,), unit direction at the start (D,), unit
        normal from the start towards the center of the circle (D,), angle in radians, radius in m (px in 2-D). (0, 3 D + 2) if
        the path has no arcs.
    """

    ends: Floats
    rows: Floats

    @classmethod
    def along(cls, line: Floats) -> GapPath:
        """Return the path along a line (P, D), m (px in 2-D)."""
        return cls(line, np.zeros((0, 3 * line.shape[1] + 2)))

    def points(self, spacing: float) -> Floats:
        """Return points along the path from its first to its second end, both included.

        Parameters
        ----------
        spacing
            largest distance along the path between neighboring points, m (px in 2-D). It does not apply to a path without
            arcs.

        Returns
        -------
        (P, D) m (px in 2-D). A path without arcs has its ends only; one point if they are at the same position.
        """
        points: Floats = kernels.sample_gap(self.rows, float(spacing)) if len(self.rows) else self.ends
        return points


def gap_path(e1: Floats, d1: Floats, e2: Floats, d2: Floats, *, inside: bool = False, radius: float | None = None) -> GapPath:
    """Return the smooth path across the gap between two ends.

    It is an arc, a straight line and an arc, tangent to both ends. If the end lines (the straight continuations of the ends)
    meet ahead of both ends, the radius is that of the largest circle that touches both there; skew lines meet where they are
    closest. Otherwise it is `radius`. A radius that is too large for the gap is reduced until there is a path.

    Parameters
    ----------
    e1, e2
        (D,) m (px in 2-D), start and end of the path.
    d1, d2
        (D,) unit, direction of each end, pointing out of its chain.
    inside
        applies if both ends point away from each other: True leads the path through the inside of the gap, False around it.
    radius
        radius of the arcs if the end lines do not meet ahead of both ends, m (px in 2-D). None takes the largest one, up to
        half the gap, with which the straight line deviates from the direct connection of the ends by at most
        MAX_DEVIATION_DEG.

    Returns
    -------
    The path; a straight line if there is no path with arcs.
    """
    ends = np.array((e1, d1, e2, d2), dtype=float)
    touch, rows = kernels.solve_gap(ends, float(radius or 0.0), math.radians(MAX_DEVIATION_DEG), inside)
    return GapPath(ends[:1].copy() if touch else ends[:3:2].copy(), rows)
