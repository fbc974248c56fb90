"""Build a right hand with a sleeve, to hide parts of a cable: rounded fingers, thumb, palm and forearm."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from ...types import Floats
from .model import Color, Solid
from .studio import Studio

SKIN: Color = (196, 148, 120)
SLEEVE: Color = (84, 92, 104)

SPHERE_POINTS = 400
"""Number of points on each sphere of a hull; facets of a finger are then 1 mm wide."""

KNUCKLES = ((-0.031, 0.048), (-0.010, 0.053), (0.011, 0.049), (0.031, 0.040))
"""Positions (x, y) in m of the four fingers' knuckles relative to the middle of the palm, index finger first."""

BONES = ((0.042, 0.025, 0.020), (0.046, 0.029, 0.021), (0.042, 0.027, 0.021), (0.033, 0.020, 0.018))
"""Lengths in m of the three bones of each finger of an adult."""

SPREAD_DEGREES, BENT_DEGREES = (9.0, 2.0, -5.0, -13.0), (12.0, 34.0, 55.0)
"""Direction of each finger, positive towards the thumb; angle of each of its three bones below the palm's plane."""

FINGER_RADII = (0.0100, 0.0092, 0.0085, 0.0076)
"""Radius of a finger in m at its knuckle, at its two joints and at its tip."""

Sphere = tuple[tuple[float, float, float], float]
"""Center and radius, m."""

PALM: tuple[Sphere, ...] = (
    ((-0.024, -0.045, 0.0), 0.017), ((0.022, -0.045, 0.0), 0.016), ((-0.030, 0.042, 0.0), 0.013), ((0.030, 0.036, 0.0), 0.011)
)  # fmt: skip
THUMB: tuple[Sphere, ...] = (
    ((-0.022, -0.030, -0.004), 0.016), ((-0.050, 0.004, -0.012), 0.0115), ((-0.060, 0.034, -0.018), 0.0095)
)  # fmt: skip
WRIST: tuple[Sphere, ...] = (
    ((-0.014, -0.045, 0.0), 0.020), ((0.012, -0.045, 0.0), 0.020), ((-0.014, -0.11, 0.004), 0.022), ((0.014, -0.11, 0.004), 0.022)
)  # fmt: skip
FOREARM: tuple[Sphere, ...] = (
    ((-0.016, -0.09, 0.004), 0.029), ((0.016, -0.09, 0.004), 0.029), ((-0.024, -0.6, 0.02), 0.040), ((0.024, -0.6, 0.02), 0.040)
)  # fmt: skip
"""Spheres whose convex hulls are the parts of the hand without the fingers; z points out of the back of the hand."""


def make_hand(studio: Studio, place: tuple[float, float, float], angle: float) -> tuple[Solid, ...]:
    """Return a right hand, its back up, as solids in the camera's optical frame.

    Parameters
    ----------
    studio
        the camera above the table.
    place
        (x, y, z) m of the middle of the palm, in the world frame (z up, table at z = 0).
    angle
        rotation about the world's z axis in radians, counter-clockwise seen from above; at 0 the fingers point along y.
    """
    parts: list[tuple[Sequence[Sphere], Color]] = [(PALM, SKIN), (WRIST, SKIN), (FOREARM, SLEEVE)]
    parts += [(pair, SKIN) for chain in (THUMB, *_fingers()) for pair in pairwise(chain)]
    turn = Rotation.from_euler("z", angle)
    solids = []
    for spheres, color in parts:
        vertices, triangles = _hull(spheres)
        solids.append(Solid(studio.to_camera(turn.apply(vertices) + place), triangles, color))
    return tuple(solids)


def _fingers() -> list[list[Sphere]]:
    """Return for each finger the spheres at its knuckle, its joints and its tip."""
    fingers = []
    for knuckle, bones, spread in zip(KNUCKLES, BONES, np.radians(SPREAD_DEGREES), strict=True):
        point = np.array([*knuckle, 0.0])
        points = [point]
        for length, bend in zip(bones, np.radians(BENT_DEGREES), strict=True):
            ahead = np.array([-np.sin(spread) * np.cos(bend), np.cos(spread) * np.cos(bend), -np.sin(bend)])
            points.append(points[-1] + length * ahead)
        fingers.append([((p[0], p[1], p[2]), radius) for p, radius in zip(points, FINGER_RADII, strict=True)])
    return fingers


def _hull(spheres: Sequence[Sphere]) -> tuple[Floats, np.ndarray]:
    """Return the convex hull of spheres: vertices (V, 3) m and triangles (T, 3)."""
    k = np.arange(SPHERE_POINTS) + 0.5
    z, turn = 1 - 2 * k / SPHERE_POINTS, np.pi * (1 + np.sqrt(5)) * k  # a Fibonacci lattice
    unit = np.column_stack((np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z))
    points = np.vstack([np.array(center) + radius * unit for center, radius in spheres])
    return points, ConvexHull(points).simplices.astype(np.int64)
