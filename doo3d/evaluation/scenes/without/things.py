"""Draw scenes of objects with rims and edges: boxes, books, cups, rolls of tape and bottles; and of stones."""

import numpy as np
from numpy.random import Generator

from ..model import Color, Scene
from ..studio import pick
from .places import Maker, free_studio, spread, surface
from .shapes import Shape, cuboid, hoop, shade, solids, stone, turned_profile

COLORS: tuple[Color, ...] = (
    (190, 150, 104),
    (232, 230, 224),
    (44, 46, 52),
    (176, 40, 40),
    (34, 84, 150),
    (60, 130, 84),
    (224, 180, 60),
    (130, 134, 140),
)
"""Colors of cardboard, paper and china, 8-bit RGB."""

ROCKS: tuple[Color, ...] = ((130, 122, 112), (104, 98, 94), (154, 140, 120), (120, 84, 64))
"""Colors of stones and bricks, 8-bit RGB."""


def boxes(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of two to nine boxes, books, cups, rolls of tape and bottles. `size` is (width, height) px of the image."""
    studio = free_studio(rng, size)
    things = spread(rng, studio, THINGS, int(rng.integers(2, 10)))
    return studio.scene((), tuple(things), surface(rng, studio))


def rubble(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of 40 to 160 stones in heaps. `size` is (width, height) px of the image."""
    studio = free_studio(rng, size)
    half, color = np.array(studio.usable_size()) / 2, pick(rng, ROCKS)
    heaps = rng.uniform(-0.8, 0.8, (int(rng.integers(1, 5)), 2)) * half
    stones = []
    for _ in range(int(rng.integers(40, 161))):
        radius = float(np.exp(rng.uniform(np.log(0.006), np.log(0.07))))
        away = rng.normal(0, rng.uniform(0.05, 0.25), 2)
        height = radius * rng.uniform(0.2, 0.8) + 0.10 * np.exp(-(away @ away) / 0.02) * rng.random()
        x, y = map(float, heaps[rng.integers(len(heaps))] + away)
        stones.append(stone(rng, radius, shade(rng, color, 0.3)).moved(x, y, float(height)))
    return studio.scene((), solids(stones, studio), surface(rng, studio))


def carton(rng: Generator) -> list[Shape]:
    """Draw a closed box, or an open one with thin walls."""
    x, y, z = rng.uniform(0.04, 0.25), rng.uniform(0.04, 0.20), rng.uniform(0.015, 0.15)
    color = shade(rng, pick(rng, COLORS))
    if rng.random() < 0.6:
        return [cuboid((0, 0, z / 2), (x, y, z), color)]
    wall = rng.uniform(0.002, 0.006)
    ends = [cuboid((side * (x - wall) / 2, 0, z / 2), (wall, y, z), color) for side in (-1, 1)]
    sides = [cuboid((0, side * (y - wall) / 2, z / 2), (x, wall, z), color) for side in (-1, 1)]
    return [cuboid((0, 0, wall / 2), (x, y, wall), color), *ends, *sides]


def book(rng: Generator) -> list[Shape]:
    """Draw a book: two covers, and white pages a little smaller than the covers."""
    x, y, z = rng.uniform(0.15, 0.25), rng.uniform(0.11, 0.18), rng.uniform(0.01, 0.04)
    color = shade(rng, pick(rng, COLORS))
    covers = [cuboid((0, 0, height), (x, y, 0.003), color) for height in (0.0015, z + 0.0015)]
    spine = cuboid((0, -y / 2 + 0.0015, z / 2), (x, 0.003, z), color)
    return [*covers, spine, cuboid((0, 0.002, z / 2), (x - 0.008, y - 0.008, z - 0.003), (232, 228, 214))]


def cup(rng: Generator) -> list[Shape]:
    """Draw a cup with a rim and a handle."""
    radius, tall, wall = rng.uniform(0.03, 0.05), rng.uniform(0.06, 0.12), rng.uniform(0.002, 0.004)
    foot, color = radius * rng.uniform(0.7, 1.0), shade(rng, pick(rng, COLORS))
    profile = np.array([(0, 0), (foot, 0), (radius, tall), (radius - wall, tall), (foot - wall, wall), (0, wall)])
    handle = hoop(0.3 * tall, rng.uniform(0.004, 0.007), color).turned("x", np.pi / 2).moved(radius, 0.0, tall / 2)
    return [turned_profile(profile, color), handle]


def roll(rng: Generator) -> list[Shape]:
    """Draw a roll of tape, which lies flat."""
    inner, tall = rng.uniform(0.015, 0.038), rng.uniform(0.012, 0.05)
    outer = inner + rng.uniform(0.006, 0.02)
    profile = np.array([(inner, 0), (outer, 0), (outer, tall), (inner, tall), (inner, 0)])
    return [turned_profile(profile, shade(rng, pick(rng, COLORS)))]


def bottle(rng: Generator) -> list[Shape]:
    """Draw a bottle or a can that stands."""
    radius, tall = rng.uniform(0.025, 0.045), rng.uniform(0.10, 0.24)
    neck = radius * rng.uniform(0.35, 1.0)
    profile = np.array([(0, 0), (radius, 0), (radius, 0.65 * tall), (neck, 0.8 * tall), (neck, tall), (0, tall)])
    return [turned_profile(profile, shade(rng, pick(rng, COLORS)))]


THINGS: tuple[Maker, ...] = (carton, book, cup, roll, bottle)
"""Functions that draw one object each."""
