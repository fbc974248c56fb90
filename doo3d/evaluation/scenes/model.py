"""What a scene is made of: cables with their true axis, solids, a table, a camera. All in the camera's optical frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...types import Array, Bools, Camera, Floats, Ints

Color = tuple[int, int, int]


@dataclass(frozen=True)
class Truth:
    """One cable as it really is.

    axis : (P, 3) float64 m, camera optical frame, at most 0.5 mm apart (1 mm when read back from a file).
    radius : m. closed : a ring; its last point is followed by the first, which is not repeated. color : RGB.
    seen : (P,) bool, the camera sees the cable's surface there; None before rendering.
    shiny : (start, end) m of arc length each, where the sensor finds no depth on the cable.
    """

    axis: Floats
    radius: float
    closed: bool = False
    color: Color = (200, 40, 40)
    seen: Bools | None = None
    shiny: tuple[tuple[float, float], ...] = ()

    @property
    def arcs(self) -> Floats:
        """(P,) m, arc length of each axis point from the first."""
        steps = np.linalg.norm(np.diff(self.axis, axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(steps)))

    @property
    def length(self) -> float:
        """Arc length in m, round to the first point again where closed."""
        back = float(np.linalg.norm(self.axis[0] - self.axis[-1])) if self.closed else 0.0
        return float(self.arcs[-1]) + back

    @property
    def spacing(self) -> float:
        """m from one axis point to the next, on average."""
        return self.length / max(len(self.axis) - (0 if self.closed else 1), 1)


@dataclass(frozen=True)
class Solid:
    """Something that is not a cable: vertices (V, 3) m in the camera frame, triangles (T, 3) int, color RGB."""

    vertices: Floats
    triangles: Ints
    color: Color = (70, 70, 75)


@dataclass(frozen=True)
class Table:
    """A plane without end: a point (3,) m on it, its unit normal (3,) towards the camera, color RGB."""

    point: Floats
    normal: Floats
    color: Color = (150, 150, 150)


@dataclass(frozen=True)
class Scene:
    """Everything that the renderer needs; the same family, seed and options give the same scene.

    light : (3,) unit vector towards the light. background : RGB seen where nothing is.
    """

    name: str
    family: str
    seed: int
    camera: Camera
    cables: tuple[Truth, ...]
    occluders: tuple[Solid, ...] = ()
    table: Table | None = None
    light: Array | tuple[float, float, float] = (0.0, 0.0, -1.0)
    background: Color = (28, 30, 34)
