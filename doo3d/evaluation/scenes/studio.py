"""Where the camera, the table and the light of a scene are, and the colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from ...types import Camera, Floats
from .model import Color, Solid, Table

CABLE_COLORS: tuple[Color, ...] = (
    (205, 38, 34),
    (228, 112, 18),
    (236, 196, 30),
    (40, 150, 62),
    (28, 92, 196),
    (20, 150, 176),
    (196, 44, 140),
)
TABLE_COLORS: tuple[Color, ...] = ((205, 204, 200), (150, 152, 154), (92, 95, 98), (178, 172, 164), (120, 124, 130))
GRIPPER_COLORS: tuple[Color, ...] = ((48, 49, 52), (225, 226, 228), (96, 100, 108))
FOCAL = {1280: 920.0, 640: 615.0}  # px, of a D435's colour stream at these widths
MARGIN = 0.05  # of the image on each side, kept free of cables


@dataclass(frozen=True)
class Studio:
    """A camera above a table. World: table plane z = 0, z up, origin where the optical axis meets the table.

    turn : (3, 3) and distance in m: camera frame = turn @ world + (0, 0, distance). light : (3,) in the camera frame.
    """

    camera: Camera
    turn: Floats
    distance: float
    light: tuple[float, float, float]
    table_color: Color

    def to_camera(self, points: Floats) -> Floats:
        """(N, 3) m in the world -> (N, 3) m in the camera frame."""
        return np.asarray(points @ self.turn.T + (0.0, 0.0, self.distance))

    def table(self, height: float = 0.0) -> Table:
        """The plane at a height in m in the world."""
        return Table(self.to_camera(np.array([[0.0, 0.0, height]]))[0], self.turn[:, 2].copy(), self.table_color)

    def inside(self, points: Floats) -> bool:
        """All (N, 3) world points are in the image, MARGIN off its edge."""
        pixels = self.camera.project(self.to_camera(points)) / (self.camera.width, self.camera.height)
        return bool(((pixels > MARGIN) & (pixels < 1 - MARGIN)).all())

    def view(self) -> tuple[float, float]:
        """Width and height in m of what can be used of the table, about."""
        scale = self.distance * (1 - 2 * MARGIN) / self.camera.fx
        return self.camera.width * scale, self.camera.height * scale


def make_studio(
    rng: Generator, size: tuple[int, int], distances: tuple[float, float] = (0.55, 0.85), tilt: float = 12.0
) -> Studio:
    """A studio with a camera of `size` (width, height) px, at a random distance in m, tilted by up to `tilt` degrees."""
    width, height = size
    focal = round(FOCAL.get(width, 0.72 * width) * rng.uniform(0.985, 1.015), 2)
    centre = (round(width / 2 + rng.uniform(-6, 6), 2), round(height / 2 + rng.uniform(-6, 6), 2))
    camera = Camera(fx=focal, fy=focal, cx=centre[0], cy=centre[1], width=width, height=height)
    angles = rng.uniform(-1, 1, size=3) * (tilt, 0.6 * tilt, 10.0)
    turn = Rotation.from_euler("xyz", angles, degrees=True).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    slant, around = np.radians(rng.uniform(15, 40)), rng.uniform(0, 2 * np.pi)
    light = turn @ (np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.cos(slant))
    color = TABLE_COLORS[rng.integers(len(TABLE_COLORS))]
    return Studio(camera, turn, float(rng.uniform(*distances)), (float(light[0]), float(light[1]), float(light[2])), color)


def cable_color(rng: Generator) -> Color:
    """One of the cable colours, all of them far more saturated than any table."""
    return CABLE_COLORS[rng.integers(len(CABLE_COLORS))]


def box(center: Floats, size: tuple[float, float, float], angle: float, studio: Studio, color: Color) -> Solid:
    """A box in the camera frame: centre (3,) and edges in m in the world, turned by `angle` radians about z."""
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * size
    spun = Rotation.from_euler("z", angle).apply(corners) + center
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    faces += [(1, 5, 7), (1, 7, 3)]
    return Solid(studio.to_camera(spun), np.array(faces, dtype=np.int64), color)
