"""Draw scenes of rooms: shelves seen from the front, and an office corner with desk, monitor and chair."""

from dataclasses import replace

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from ..model import Color, Scene
from ..studio import pick
from .places import free_studio
from .shapes import Shape, cuboid, shade, solids, wood
from .things import COLORS, THINGS

WALLS: tuple[Color, ...] = ((226, 224, 216), (200, 206, 210), (214, 200, 170), (160, 168, 160))
FURNITURE: tuple[Color, ...] = ((236, 234, 230), (180, 136, 92), (70, 60, 54), (150, 150, 152))
"""Colors of furniture, 8-bit RGB."""

SHELF_DISTANCES, DESK_DISTANCES = (1.0, 1.9), (1.4, 2.4)
"""Least and greatest distance in m from the camera to the wall behind a shelf, and to the front of a desk."""

VIEW_ANGLES = (12.0, 35.0)
"""Least and greatest angle in degrees by which the camera in an office looks down."""


def shelves(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of a shelf with books and boxes, seen from the front. `size` is (width, height) px of the image."""
    studio = replace(free_studio(rng, size), distance=float(rng.uniform(*SHELF_DISTANCES)))
    deep, thick, pitch = rng.uniform(0.18, 0.32), rng.uniform(0.012, 0.028), rng.uniform(0.22, 0.36)
    color, wide = shade(rng, pick(rng, FURNITURE)), rng.uniform(0.6, 1.2)
    start = rng.uniform(-0.5, 0.5) * pitch
    shapes = list[Shape]()
    for row in range(-4, 5):
        shapes.append(cuboid((0, start + row * pitch, deep / 2), (6, thick, deep), color))
        left = -2.0
        while left < 2.0:
            made = _books(rng, left, start + row * pitch + thick / 2, deep, pitch)
            shapes += made
            left = max((float(each.vertices[:, 0].max()) for each in made), default=left) + rng.uniform(0.0, 0.25)
    shapes += [cuboid((column * wide, 0, deep / 2), (thick, 6, deep), color) for column in range(-3, 4)]
    grain = wood(rng, studio) if rng.random() < 0.5 else None
    wall = replace(studio.table(), color=shade(rng, pick(rng, WALLS)))
    return studio.scene((), solids(shapes, studio, grain), wall)


def _books(rng: Generator, left: float, bottom: float, deep: float, pitch: float) -> list[Shape]:
    """Draw a row of books or a box on a shelf board, from x = `left` on, standing at y = `bottom` (m)."""
    if rng.random() < 0.3:
        wide, tall, far = rng.uniform(0.08, 0.3), rng.uniform(0.3, 0.8) * pitch, rng.uniform(0.5, 0.95) * deep
        return [cuboid((left + wide / 2, bottom + tall / 2, far / 2), (wide, tall, far), shade(rng, pick(rng, COLORS)))]
    shapes = list[Shape]()
    for _ in range(int(rng.integers(1, 12))):
        wide, tall, far = rng.uniform(0.008, 0.045), rng.uniform(0.5, 0.85) * pitch, rng.uniform(0.55, 0.9) * deep
        color = shade(rng, pick(rng, COLORS), 0.3)
        shapes.append(cuboid((left + wide / 2, bottom + tall / 2, far / 2), (wide - 0.001, tall, far), color))
        left += wide
    return shapes


def office(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of the corner of an office: walls, desk, monitor, keyboard, things, chair. `size` is (width, height) px."""
    down = np.radians(rng.uniform(*VIEW_ANGLES))
    sway = Rotation.from_euler("zxy", [rng.uniform(-0.08, 0.08), down - np.pi / 2, rng.uniform(-0.5, 0.5)])
    tilted = Rotation.from_euler("x", down - np.pi / 2) if rng.random() < 0.3 else sway
    rotation = tilted.as_matrix() @ np.diag([1.0, -1.0, -1.0])
    studio = replace(free_studio(rng, size), rotation=rotation, distance=float(rng.uniform(*DESK_DISTANCES)))
    slant = rotation @ np.array([rng.uniform(-0.6, 0.6), rng.uniform(-0.9, -0.3), 0.7])
    slant /= np.linalg.norm(slant)
    studio = replace(studio, light=(float(slant[0]), float(slant[1]), float(slant[2])))
    paint, side = shade(rng, pick(rng, WALLS)), rng.choice((-1.0, 1.0))
    back = rng.uniform(0.35, 0.7)
    walls = [
        cuboid((0, back + 0.05, 0.5), (8, 0.1, 4), paint),
        cuboid((side * rng.uniform(0.8, 1.4), 0, 0.5), (0.1, 8, 4), shade(rng, paint, 0.08)),
        cuboid((0, back - 0.005, -0.66), (8, 0.012, 0.1), (240, 240, 238)),
    ]
    shapes = [*walls, *_desk(rng, back), *_chair(rng), *_pictures(rng, back)]
    floor = replace(studio.table(-0.72), color=shade(rng, (120, 110, 100)), grain=wood(rng, studio))
    return studio.scene((), solids(shapes, studio), floor)


def _desk(rng: Generator, back: float) -> list[Shape]:
    """Draw a desk whose top is at z = 0, with a monitor, a keyboard and a few things on it."""
    top, half = shade(rng, pick(rng, FURNITURE)), rng.uniform(0.5, 0.75)
    shapes = [cuboid((0, back - 0.4, -0.012), (2 * half, 0.75, 0.024), top)]
    shapes += [
        cuboid((x, back - y, -0.37), (0.05, 0.05, 0.70), (90, 90, 94)) for x in (-half + 0.05, half - 0.05) for y in (0.1, 0.7)
    ]
    dark, x = shade(rng, (36, 37, 40)), rng.uniform(-0.3, 0.3)
    shapes += [
        cuboid((x, back - 0.2, 0.28), (rng.uniform(0.4, 0.6), 0.02, 0.32), dark),
        cuboid((x, back - 0.212, 0.285), (0.38, 0.004, 0.28), shade(rng, (90, 130, 180), 0.4)),
        cuboid((x, back - 0.17, 0.10), (0.04, 0.02, 0.2), dark),
        cuboid((x, back - 0.2, 0.006), (0.22, 0.16, 0.012), dark),
        cuboid((x, back - 0.5, 0.008), (0.42, 0.13, 0.016), shade(rng, (60, 62, 66), 0.4)),
    ]
    for _ in range(int(rng.integers(1, 5))):
        place = rng.uniform(-half + 0.1, half - 0.1), back - rng.uniform(0.1, 0.7)
        shapes += [shape.turned("z", rng.uniform(0, 6)).moved(*place, 0.0) for shape in pick(rng, THINGS)(rng)]
    return shapes


def _chair(rng: Generator) -> list[Shape]:
    """Draw a chair in front of the desk: a seat, four square legs of 25 to 40 mm and a back of two posts and slats."""
    leg, color = rng.uniform(0.025, 0.04), shade(rng, pick(rng, FURNITURE))
    shapes = [cuboid((0, 0, -0.28), (0.42, 0.42, 0.035), color)]
    shapes += [cuboid((x, y, -0.5), (leg, leg, 0.44), color) for x in (-0.19, 0.19) for y in (-0.19, 0.19)]
    shapes += [cuboid((x, -0.19, -0.05), (leg, leg, 0.5), color) for x in (-0.19, 0.19)]
    shapes += [cuboid((0, -0.19, z), (0.42, 0.018, 0.05), color) for z in (-0.05, 0.07, 0.18)]
    turn, x, y = rng.uniform(-0.8, 0.8), rng.uniform(-0.9, 0.9), rng.uniform(-0.5, -0.1)
    return [shape.turned("z", turn).moved(x, y, 0.0) for shape in shapes]


def _pictures(rng: Generator, back: float) -> list[Shape]:
    """Draw a picture in a frame, a board on the wall and a door frame."""
    x, wide, tall = rng.uniform(-0.8, 0.8), rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.4)
    frame = shade(rng, pick(rng, FURNITURE))
    shapes = [
        cuboid((x, back - 0.008, 0.65), (wide, 0.016, tall), frame),
        cuboid((x, back - 0.0175, 0.65), (wide - 0.03, 0.003, tall - 0.03), shade(rng, pick(rng, COLORS))),
        cuboid((rng.uniform(-0.8, 0.8), back - 0.1, rng.uniform(0.45, 0.6)), (rng.uniform(0.3, 0.9), 0.2, 0.02), frame),
    ]
    door = rng.uniform(0.7, 1.3) * rng.choice((-1.0, 1.0))
    return [*shapes, *(cuboid((door + dx, back - 0.01, 0.4), (0.06, 0.025, 2.4), (236, 234, 228)) for dx in (-0.4, 0.4))]
