"""The parts of a scene: cables with their true axis, solids, a table, a camera; all in the camera's optical frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...types import Array, Bools, Camera, Floats, Ints

Color = tuple[int, int, int]
"""8-bit RGB."""


@dataclass(frozen=True)
class Truth:
    """One true cable.

    axis : (P, 3) float64 m, camera optical frame, at most 0.5 mm apart (1 mm when read back from a file).
    radius : m. closed : a ring; its last point is followed by the first, which is not repeated. color : RGB.
    seen : (P,) bool, the camera sees the cable's surface there; None before rendering.
    shiny : (start, end) m of arc length each, where the sensor measures no depth on the cable.
    """

    axis: Floats
    radius: float
    closed: bool = False
    color: Color = (200, 40, 40)
    seen: Bools | None = None
    shiny: tuple[tuple[float, float], ...] = ()

    @property
    def arcs(self) -> Floats:
        """The arc length of each axis point from the first, (P,) m."""
        steps = np.linalg.norm(np.diff(self.axis, axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(steps)))

    @property
    def length(self) -> float:
        """The arc length in m; back to the first point if closed."""
        back = float(np.linalg.norm(self.axis[0] - self.axis[-1])) if self.closed else 0.0
        return float(self.arcs[-1]) + back

    @property
    def spacing(self) -> float:
        """The mean distance in m of successive axis points."""
        return self.length / max(len(self.axis) - (0 if self.closed else 1), 1)


@dataclass(frozen=True)
class Solid:
    """An object that is not a cable: vertices (V, 3) m in the camera frame, triangles (T, 3) int, color RGB."""

    vertices: Floats
    triangles: Ints
    color: Color = (70, 70, 75)


@dataclass(frozen=True)
class Table:
    """An infinite plane: a point (3,) m on it, its unit normal (3,) towards the camera, color RGB."""

    point: Floats
    normal: Floats
    color: Color = (150, 150, 150)


@dataclass(frozen=True)
class Scene:
    """All that the renderer needs; the same family, seed and options give the same scene.

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


def cuboid_triangles() -> Ints:
    """Return the triangles (12, 3) of a cuboid whose corners are in the order of `np.ndindex(2, 2, 2)`."""
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    return np.array([*faces, (1, 5, 7), (1, 7, 3)], dtype=np.int64)


def moved_scene(scene: Scene, move_points: Callable[[Floats], Floats], rotate: Callable[[Floats], Floats], name: str) -> Scene:
    """Return the scene after a rigid motion of all of it relative to the camera.

    Parameters
    ----------
    scene
        in the camera's optical frame.
    move_points
        maps points (N, 3) m.
    rotate
        maps a direction (3,).
    name
        of the result.
    """
    table = scene.table
    return replace(
        scene,
        name=name,
        cables=tuple(replace(cable, axis=np.asarray(move_points(cable.axis))) for cable in scene.cables),
        occluders=tuple(replace(solid, vertices=np.asarray(move_points(solid.vertices))) for solid in scene.occluders),
        table=None if table is None else Table(move_points(table.point[None])[0], rotate(table.normal), table.color),
        light=tuple(rotate(np.asarray(scene.light)).tolist()),
    )
