"""The arcs of gap paths, to look at where they begin and end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from doo3d.geometry.gap_path import GapPath
from doo3d.types import Array, Floats


@dataclass(frozen=True)
class Arc:
    """A circular arc in 2-D or 3-D.

    Its point at the angle t is start + radius (sin t direction + (1 - cos t) normal), 0 <= t <= angle.

    Attributes
    ----------
    start
        (D,) m (px in 2-D), where the arc begins.
    direction
        (D,) unit, tangent at the start, pointing along the arc.
    normal
        (D,) unit, from the start towards the center of the circle.
    angle
        radians from the start to the end of the arc, not negative.
    radius
        m (px in 2-D).
    """

    start: Floats
    direction: Floats
    normal: Floats
    angle: float
    radius: float

    @staticmethod
    def from_row(row: Floats) -> Arc:
        """Return the arc given by a row of 3 D + 2 numbers: start (D,), direction (D,), normal (D,), angle in radians, radius."""
        start, direction, normal = row[:-2].reshape(3, -1)
        return Arc(start, direction, normal, float(row[-2]), float(row[-1]))

    def at(self, angles: Array) -> Floats:
        """Return the points of the arc at given angles.

        angles : (S,) radians from the start of the arc. Returns (S, D) m (px in 2-D).
        """
        angles = np.asarray(angles)[:, None]
        along, across = np.sin(angles) * self.direction, (1 - np.cos(angles)) * self.normal
        return np.asarray(self.start + self.radius * (along + across))

    @property
    def end_direction(self) -> Floats:
        """The unit tangent (D,) at the end of the arc, pointing onwards."""
        return np.asarray(np.cos(self.angle) * self.direction + np.sin(self.angle) * self.normal)

    @property
    def end(self) -> Floats:
        """The point (D,) where the arc ends, m (px in 2-D)."""
        return np.asarray(self.at(np.array([self.angle]))[0])


def arcs_of(path: GapPath) -> tuple[Arc, Arc] | None:
    """Return the arcs at the first and the second end, each from its end into the gap; None of a path that is a straight line."""
    return (Arc.from_row(path.rows[0]), Arc.from_row(path.rows[1])) if len(path.rows) else None
