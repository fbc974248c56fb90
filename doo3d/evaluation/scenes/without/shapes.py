"""Build triangle meshes of objects that are not cables, in the world frame (z up, table at z = 0)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from ....types import Floats, Ints
from ..model import CUBOID_TRIANGLES, Color, Grain, Solid, corners
from ..studio import Studio

SIDES = 28
"""Number of sides of round shapes."""

CAP_RINGS = 4
"""Number of rings of the rounded end of a limb."""


@dataclass(frozen=True)
class Shape:
    """A closed surface of one color.

    Attributes
    ----------
    vertices
        (V, 3) m, in the world frame.
    triangles
        (T, 3) int, indices of vertices.
    color
        8-bit RGB.
    """

    vertices: Floats
    triangles: Ints
    color: Color

    def turned(self, axis: str, angle: float) -> Shape:
        """Return the shape turned about an axis of the world, "x", "y" or "z", by an angle in radians."""
        return replace(self, vertices=Rotation.from_euler(axis, angle).apply(self.vertices))

    def moved(self, *shift: float) -> Shape:
        """Return the shape moved by x, y, z in m."""
        return replace(self, vertices=self.vertices + np.array(shift))


def flat(x: Floats, y: Floats, height: float) -> Floats:
    """Return points (P, 3) m with coordinates x and y (P,) at one height, m."""
    return np.column_stack((x, y, np.full(len(x), height)))


def cuboid(center: tuple[float, float, float], size: tuple[float, float, float], color: Color) -> Shape:
    """Return a box with edges along the axes, given its center and edge lengths (x, y, z) in m."""
    return Shape(corners(size) + center, CUBOID_TRIANGLES, color)


def limb(points: Floats, radii: Floats, color: Color, flatness: float = 1.0, rounded: bool = True) -> Shape:
    """Return a thick line with round cross-sections and ends, such as a handle, a finger or a blade.

    Parameters
    ----------
    points
        (P, 3) m, its axis; it may not run straight up.
    radii
        (P,) m, half of its width at each point.
    color
        8-bit RGB.
    flatness
        ratio of its height to its width.
    rounded
        whether its ends are half spheres; otherwise they are flat disks.
    """
    points, radii = np.asarray(points, dtype=float), np.asarray(radii, dtype=float)
    forward = np.gradient(points, axis=0)
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    bend = np.linspace(np.pi / 2, 0, CAP_RINGS, endpoint=False) if rounded else np.array([np.pi / 2])
    shift = np.sin(bend) * (1.0 if rounded else 0.0)
    first = points[0] - forward[0] * (radii[0] * shift)[:, None]
    last = (points[-1] + forward[-1] * (radii[-1] * shift)[:, None])[::-1]
    size = np.concatenate((radii[0] * np.cos(bend), radii, radii[-1] * np.cos(bend[::-1])))
    center = np.vstack((first, points, last))
    forward = np.pad(forward, ((len(bend), len(bend)), (0, 0)), "edge")
    side = np.cross((0.0, 0.0, 1.0), forward)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = flatness * np.cross(forward, side)
    angle = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)[:, None, None]
    rings = center + size[:, None] * (np.cos(angle) * side + np.sin(angle) * up)
    return Shape(rings.transpose(1, 0, 2).reshape(-1, 3), _rings(len(center)), color)


def turned_profile(profile: Floats, color: Color) -> Shape:
    """Return the solid of revolution of a profile about the z axis, such as a cup; profile : (P, 2), radius and height, m."""
    angle = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    vertices = [np.column_stack((radius * circle, np.full(SIDES, height))) for radius, height in profile]
    return Shape(np.vstack(vertices), _rings(len(profile)), color)


def hoop(radius: float, thickness: float, color: Color, stretch: float = 1.0) -> Shape:
    """Return a flat ring about the z axis; radius, thickness : of the ring and of its bar, m. stretch : factor along x."""
    angle = np.linspace(0, 2 * np.pi, 49)
    axis = np.column_stack((stretch * radius * np.cos(angle), radius * np.sin(angle), np.zeros(len(angle))))
    return limb(axis, np.full(len(axis), thickness), color, rounded=False)


def ribbon(line: Floats, width: float, height: float, color: Color) -> Shape:
    """Return a band without thickness along a line (P, 2) m, such as ink; width, height : of the band, above z = 0, m."""
    step = np.gradient(line, axis=0)
    step /= np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12)
    normal = np.column_stack((-step[:, 1], step[:, 0])) * width / 2
    vertices = np.column_stack((np.vstack((line + normal, line - normal)), np.full(2 * len(line), height)))
    a = np.arange(len(line) - 1)
    b = a + len(line)
    return Shape(vertices, np.vstack((np.column_stack((a, a + 1, b)), np.column_stack((a + 1, b + 1, b)))), color)


def stone(rng: Generator, size: float, color: Color) -> Shape:
    """Draw a random convex stone at the origin; size : mean radius, m."""
    points = rng.normal(size=(16, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points *= size * rng.uniform(0.75, 1.2, (16, 1)) * rng.uniform(0.6, 1.3, 3)
    return Shape(points, ConvexHull(points).simplices.astype(np.int64), color)


def _rings(count: int) -> Ints:
    """Return the triangles (T, 3) between successive rings of SIDES vertices, two per side."""
    ring, side = np.arange(count - 1)[:, None] * SIDES, np.arange(SIDES)[None, :]
    following = (side + 1) % SIDES
    a, b = ring + side, ring + following
    pairs = np.stack((np.stack((a, a + SIDES, b), axis=-1), np.stack((b, a + SIDES, b + SIDES), axis=-1)))
    return np.asarray(pairs.reshape(-1, 3), dtype=np.int64)


def solids(shapes: Iterable[Shape], studio: Studio, grain: Grain | None = None) -> tuple[Solid, ...]:
    """Convert shapes to solids in the camera's optical frame, all with the same grain of wood or without."""
    return tuple(Solid(studio.to_camera(shape.vertices), shape.triangles, shape.color, grain) for shape in shapes)


def wood(rng: Generator, studio: Studio) -> Grain:
    """Draw the grain of an approximately level piece of wood below the camera."""
    heading, depth = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.5)
    point = studio.to_camera(np.array([[*rng.uniform(-0.3, 0.3, 2), -depth]]))[0]
    axis = studio.rotation @ np.array([np.cos(heading), np.sin(heading), rng.uniform(-0.08, 0.08)])
    pitch = float(rng.uniform(0.003, 0.012))
    return Grain(point, axis / np.linalg.norm(axis), pitch, float(rng.uniform(0.1, 0.45)), float(rng.uniform(0, 1) * pitch))


def shade(rng: Generator, color: Color, spread: float = 0.12) -> Color:
    """Draw a color near the given one: darker or lighter by up to the fraction `spread`, with a slightly different hue."""
    drawn = np.array(color) * (1 + rng.uniform(-spread, spread)) * (1 + rng.uniform(-spread, spread, 3) / 3)
    r, g, b = np.clip(drawn, 0, 255).astype(int).tolist()
    return r, g, b
