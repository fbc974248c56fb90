"""Draw scenes of hands above a table: palm, fingers, forearm and sleeve."""

import numpy as np
from numpy.random import Generator

from ....types import Floats
from ..model import Color, Scene
from ..studio import pick
from .places import free_studio, spread, surface
from .shapes import Shape, flat, limb, shade, solids
from .things import COLORS, THINGS
from .tools import TOOLS

SKINS: tuple[Color, ...] = ((236, 196, 172), (214, 164, 132), (176, 122, 90), (120, 80, 58), (84, 56, 42))
"""Colors of skin, 8-bit RGB."""

FINGERS = (
    # place across the palm, length, radius, m
    (-0.033, 0.072, 0.0080),
    (-0.011, 0.080, 0.0085),
    (0.011, 0.074, 0.0080),
    (0.032, 0.058, 0.0070),
)
"""Fingers of an adult's hand, index finger first: position of the knuckle across the palm, length and radius, m."""


def hands(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of one or two hands that reach into the view, beside a few things. `size` is (width, height) px."""
    studio = free_studio(rng, size)
    half = np.array(studio.usable_size()) / 2
    shapes, taken = list[Shape](), list[tuple[Floats, float]]()
    side = int(rng.integers(4))
    for k in range(int(rng.integers(1, 3))):
        heading = (side + k) * np.pi / 2 + rng.uniform(-0.5, 0.5)
        palm = rng.uniform(-0.5, 0.5, 2) * half
        taken.append((palm, 0.10))
        turned = (shape.turned("z", heading) for shape in hand(rng, mirrored=rng.random() < 0.5))
        shapes += [shape.moved(*palm, float(rng.uniform(0.0, 0.12))) for shape in turned]
    things = spread(rng, studio, (*TOOLS, *THINGS), int(rng.integers(0, 4)), taken)
    return studio.scene((), (*solids(shapes, studio), *things), surface(rng, studio))


def hand(rng: Generator, mirrored: bool) -> list[Shape]:
    """Draw a hand whose fingers point along x and whose palm is at the origin, with a long forearm."""
    skin, mirror = shade(rng, pick(rng, SKINS)), -1.0 if mirrored else 1.0
    curl, fan = rng.uniform(0.1, 1.0), rng.uniform(0.0, 0.25)
    rise = 0.03 + 0.05 * curl
    t = np.linspace(0, 1, 9)
    palm = limb(flat(-0.045 + 0.08 * t, 0 * t, rise), 0.030 + 0.013 * np.sin(0.6 * np.pi * t), skin, 0.38)
    shapes = [palm]
    for across, long, radius in FINGERS:
        bend = curl * rng.uniform(0.7, 1.3) * np.array([0.3, 0.9, 1.5])
        heading = mirror * fan * across / 0.03 + rng.uniform(-0.05, 0.05)
        steps = (
            long
            * np.array([0.45, 0.3, 0.25])[:, None]
            * np.column_stack((np.cos(bend) * np.cos(heading), np.cos(bend) * np.sin(heading), -np.sin(bend)))
        )
        joints = np.cumsum(np.vstack((np.zeros(3), steps)), axis=0) + np.array((0.040, mirror * across, rise))
        joints[:, 2] = np.maximum(joints[:, 2], radius)
        shapes.append(limb(_smooth(joints), radius * np.linspace(1.05, 0.85, 13), skin))
    thumb = np.array([(-0.03, -0.035, 0.0), (0.005, -0.060, -0.008), (0.035, -0.065 + 0.02 * curl, -0.016)])
    shapes.append(limb(_smooth(thumb * (1, mirror, 1) + (0, 0, rise)), np.linspace(0.013, 0.009, 9), skin))
    cuff = rng.uniform(0.10, 0.45)
    arm = np.array([-0.04, -0.08, -cuff])
    shapes.append(limb(flat(arm, np.zeros(3), rise), np.array([0.026, 0.026, 0.036]), skin, 0.8))
    sleeve = shade(rng, pick(rng, COLORS))
    shapes.append(limb(flat(np.array([-cuff, -1.5]), np.zeros(2), rise), np.array([0.042, 0.06]), sleeve, rounded=False))
    return shapes


def _smooth(joints: Floats) -> Floats:
    """Smooth a line of J joints (J, 3) m to round corners: (4 J - 3, 3) m, four steps between joints."""
    old = np.arange(len(joints))
    new = np.linspace(0, len(joints) - 1, 4 * len(joints) - 3)
    line = np.column_stack([np.interp(new, old, axis) for axis in joints.T])
    line[1:-1] = (line[:-2] + 2 * line[1:-1] + line[2:]) / 4
    return np.asarray(line)
