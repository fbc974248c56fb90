"""Draw the camera, table, light and colors of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from ...types import Camera, Floats
from .model import Color, Scene, Solid, Table, Truth, corners, cuboid

T = TypeVar("T")

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

FOCAL_LENGTHS_PX = {1280: 920.0, 640: 615.0}
"""Width of a D435's color image in px -> focal length in px."""

DISTANCE_FACTOR, MAX_DISTANCE = 1.05, 2.5
"""Factor of each step by which the camera is moved back until all cables are in view, and its greatest distance in m."""

MARGIN_FRACTION = 0.05
"""Fraction of the image on each side that is kept free of cables."""


@dataclass(frozen=True)
class Studio:
    """A camera above a table, and its light.

    In the world frame, the table is the plane z = 0, z points up, and the origin is where the optical axis meets the table.

    Attributes
    ----------
    camera
        the intrinsics and the image size.
    rotation
        (3, 3), from the world frame to the camera's optical frame: p_camera = rotation @ p_world + (0, 0, distance).
    distance
        distance from the camera to the table along the optical axis, m.
    light
        (3,) unit vector towards the light, in the camera's optical frame.
    table_color
        8-bit RGB.
    """

    camera: Camera
    rotation: Floats
    distance: float
    light: tuple[float, float, float]
    table_color: Color

    def to_camera(self, points: Floats) -> Floats:
        """Transform points (N, 3) m from the world frame (z up) to the camera's optical frame, (N, 3) m."""
        return np.asarray(points @ self.rotation.T + (0.0, 0.0, self.distance))

    def table(self, height: float = 0.0) -> Table:
        """Return the table: a horizontal plane at a height in m above the world's z = 0, in the camera's optical frame."""
        return Table(self.to_camera(np.array([[0.0, 0.0, height]]))[0], self.rotation[:, 2].copy(), self.table_color)

    def scene(self, cables: tuple[Truth, ...], solids: tuple[Solid, ...] = (), table: Table | None = None) -> Scene:
        """Return a scene, still without a name, of objects in the camera's optical frame; `table` None takes the studio's."""
        return Scene("", "", 0, self.camera, cables, solids, table or self.table(), self.light)

    def contains(self, points: Floats) -> bool:
        """Return whether all points (N, 3) m of the world frame are in the image, outside a margin of 5 % on each side."""
        pixels = self.camera.project(self.to_camera(points)) / (self.camera.width, self.camera.height)
        return bool(((pixels > MARGIN_FRACTION) & (pixels < 1 - MARGIN_FRACTION)).all())

    def backed_off(self, curves: Sequence[Floats]) -> Studio | None:
        """Move the camera back until all curves (P, 3) m are in view; None if it would be farther than MAX_DISTANCE."""
        studio = self
        while not all(studio.contains(curve) for curve in curves):
            studio = replace(studio, distance=DISTANCE_FACTOR * studio.distance)
            if studio.distance > MAX_DISTANCE:
                return None
        return studio

    def usable_size(self) -> tuple[float, float]:
        """Return the approximate size of the part of the table that cables may lie on: (x, y) m, along the axes of the world.

        It is the part in the image without a margin of 5 % on each side, for a camera that is not tilted.
        """
        scale = self.distance * (1 - 2 * MARGIN_FRACTION) / self.camera.fx
        return self.camera.width * scale, self.camera.height * scale

    def shift_in_view(self, rng: Generator, curve: Floats, share: float = 0.4) -> Floats:
        """Draw a random shift (2,) m that keeps a planar curve (P, 2) m approximately in view.

        The curve is centered at the origin. share : greatest shift as a fraction of the free space beside the curve.
        """
        slack = np.clip(np.array(self.usable_size()) - np.ptp(curve, axis=0), 0, None)
        return np.asarray(rng.uniform(-share, share, 2) * slack)


def make_studio(
    rng: Generator, size: tuple[int, int], distances: tuple[float, float] = (0.55, 0.85), max_tilt: float = 12.0
) -> Studio:
    """Draw a camera that looks down on a table, with random distance, tilt, light and table color.

    Parameters
    ----------
    rng
        the random number generator to draw from.
    size
        (width, height) px of the image.
    distances
        (least, greatest) distance from the camera to the table along the optical axis, m.
    max_tilt
        greatest tilt about the image's x axis in degrees, drawn from -max_tilt to max_tilt. The tilt about the image's y axis is
        at most 0.6 * max_tilt either way; the roll about the optical axis, at most 10 degrees.
    """
    width, height = size
    focal = round(FOCAL_LENGTHS_PX.get(width, 0.72 * width) * rng.uniform(0.985, 1.015), 2)
    center = (round(width / 2 + rng.uniform(-6, 6), 2), round(height / 2 + rng.uniform(-6, 6), 2))
    camera = Camera(fx=focal, fy=focal, cx=center[0], cy=center[1], width=width, height=height)
    angles = rng.uniform(-1, 1, size=3) * (max_tilt, 0.6 * max_tilt, 10.0)
    rotation = Rotation.from_euler("xyz", angles, degrees=True).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    slant, azimuth = np.radians(rng.uniform(15, 40)), rng.uniform(0, 2 * np.pi)
    light = rotation @ (np.sin(slant) * np.cos(azimuth), np.sin(slant) * np.sin(azimuth), np.cos(slant))
    color = pick(rng, TABLE_COLORS)
    return Studio(camera, rotation, float(rng.uniform(*distances)), (float(light[0]), float(light[1]), float(light[2])), color)


def pick(rng: Generator, choices: Sequence[T]) -> T:
    """Draw one of several items with equal probability."""
    return choices[int(rng.integers(len(choices)))]


def cable_color(rng: Generator) -> Color:
    """Draw one of seven cable colors, 8-bit RGB, all far more saturated than any table color."""
    return pick(rng, CABLE_COLORS)


def box(center: Floats, size: tuple[float, float, float], angle: float, studio: Studio, color: Color) -> Solid:
    """Return a box as a solid in the camera's optical frame.

    Parameters
    ----------
    center
        (3,) m, in the world frame (z up, table at z = 0).
    size
        edge lengths (x, y, z) in m, before the rotation.
    angle
        rotation about the world's z axis in radians, counter-clockwise seen from above.
    studio
        the camera above the table.
    color
        8-bit RGB.
    """
    return cuboid(studio.to_camera(Rotation.from_euler("z", angle).apply(corners(size)) + center), color)
