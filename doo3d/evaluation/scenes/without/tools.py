"""Tools on a table: pliers, screwdrivers, hammers, scissors, pens and wrenches."""

import numpy as np
from numpy.random import Generator

from ..model import Color, Scene
from ..studio import pick
from .places import Maker, free_studio, spread, surface
from .shapes import Shape, cuboid, flat, hoop, limb, shade, turned_profile

GRIPS: tuple[Color, ...] = ((200, 40, 34), (232, 170, 24), (30, 84, 170), (40, 44, 48), (40, 140, 70), (236, 110, 24))
"""Colors of handles, 8-bit RGB."""

STEEL: tuple[Color, ...] = ((150, 153, 158), (96, 99, 104), (188, 190, 192))
WOOD: tuple[Color, ...] = ((196, 150, 98), (160, 110, 66), (222, 186, 138))


def tools(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of two to eight tools on a table. `size` is (width, height) px of the image."""
    studio = free_studio(rng, size)
    things = spread(rng, studio, TOOLS, int(rng.integers(2, 9)))
    return studio.scene((), tuple(things), surface(rng, studio))


def pliers(rng: Generator) -> list[Shape]:
    """Draw a pair of pliers: two bent handles, two jaws and a pivot."""
    grip, steel = shade(rng, pick(rng, GRIPS)), shade(rng, pick(rng, STEEL))
    long, width, spread_out = rng.uniform(0.09, 0.14), rng.uniform(0.0045, 0.0075), rng.uniform(0.010, 0.030)
    t = np.linspace(0, 1, 24)
    bow = spread_out * np.sin(t * rng.uniform(0.6, 0.9) * np.pi)
    radii = width * (0.75 + 0.35 * np.sin(np.pi * t**0.7))
    shapes = [limb(flat(-0.018 - long * t, side * (0.006 + bow), 0.008), radii, grip) for side in (-1, 1)]
    t = np.linspace(0, 1, 8)
    jaw, gap = rng.uniform(0.030, 0.060), rng.uniform(0.0, 0.006)
    for side in (-1, 1):
        shapes.append(limb(flat(jaw * t - 0.01, side * (0.004 + gap * t), 0.008), 0.009 - 0.006 * t, steel, 0.7))
    return [*shapes, _disk(rng.uniform(0.010, 0.015), 0.0, 0.015, steel)]


def screwdriver(rng: Generator) -> list[Shape]:
    """Draw a screwdriver: a thick handle, a thin shaft and a flat tip."""
    thick, long, shaft = rng.uniform(0.010, 0.017), rng.uniform(0.07, 0.11), rng.uniform(0.06, 0.11)
    t = np.linspace(0, 1, 20)
    radii = thick * (0.86 + 0.14 * np.cos(4 * np.pi * t) - 0.25 * t**6)
    steel, rod = shade(rng, pick(rng, STEEL)), rng.uniform(0.002, 0.0035)
    drop = np.array([thick, max(rod, thick - shaft * thick / long)])
    return [
        limb(flat(-long * (1 - t), 0 * t, thick), radii, shade(rng, pick(rng, GRIPS))),
        limb(np.column_stack(((0.0, shaft), (0.0, 0.0), drop)), np.full(2, rod), steel),
        limb(flat(np.array([shaft, shaft + 0.012]), np.zeros(2), drop[1]), np.array([rod, 1.3 * rod]), steel, 0.4),
    ]


def hammer(rng: Generator) -> list[Shape]:
    """Draw a hammer: a handle that is thicker at its end, and a head across it."""
    long, thick, head = rng.uniform(0.20, 0.30), rng.uniform(0.011, 0.016), rng.uniform(0.08, 0.13)
    t = np.linspace(0, 1, 16)
    radii = thick * (1.1 - 0.55 * np.sin(np.pi * np.clip(t * 1.4 - 0.3, 0, 0.5)))
    square = rng.uniform(0.020, 0.032)
    color = shade(rng, pick(rng, WOOD if rng.random() < 0.6 else GRIPS))
    steel = shade(rng, pick(rng, STEEL))
    return [
        limb(flat(-long * (1 - t), 0 * t, square / 2), radii, color, 0.8),
        cuboid((square / 2, head / 6, square / 2), (square, head, square), steel),
        limb(flat(np.full(2, square / 2), np.array([head * 0.6, head]), square / 2), np.array([square / 2, 0.004]), steel),
    ]


def scissors(rng: Generator) -> list[Shape]:
    """Draw a pair of scissors: two blades that cross, and a ring for the fingers at each."""
    grip, steel = shade(rng, pick(rng, GRIPS)), shade(rng, pick(rng, STEEL))
    blade, handle, opening = rng.uniform(0.07, 0.11), rng.uniform(0.05, 0.07), rng.uniform(0.05, 0.5)
    ring, bar = rng.uniform(0.014, 0.020), rng.uniform(0.003, 0.005)
    t = np.linspace(0, 1, 8)
    shapes: list[Shape] = []
    for side in (-1.0, 1.0):
        half = [
            limb(flat(blade * t, 0.002 * side + 0 * t, 0.004), 0.007 * (1.02 - t), steel, 0.15),
            limb(flat(-handle * t, -side * 0.006 * t, 0.005), 0.006 - 0.002 * t, grip, 0.8),
            hoop(ring, bar, grip, rng.uniform(1.0, 1.5)).moved(-handle - ring, -side * 0.008, 0.005),
        ]
        shapes += [shape.turned("z", side * opening / 2) for shape in half]
    return [*shapes, _disk(0.004, 0.0, 0.008, steel)]


def pen(rng: Generator) -> list[Shape]:
    """Draw a pen or a pencil of 12 to 15 cm: a body, a tip that tapers, and a cap or an end of another color."""
    thick, long, cap = rng.uniform(0.0035, 0.0065), rng.uniform(0.12, 0.15), rng.uniform(0.01, 0.05)
    t = np.array([0.0, 0.8, 0.84, 0.97, 1.0])
    radii = thick * np.array([1.0, 1.0, 0.9, 0.3, 0.15])
    color = shade(rng, pick(rng, (*GRIPS, *WOOD, (240, 240, 238))))
    ends = np.array([0.0, cap])
    return [
        limb(flat(long * t, 0 * t, thick), radii, color, rounded=False),
        limb(flat(ends, np.zeros(2), thick), np.full(2, 1.15 * thick), shade(rng, pick(rng, GRIPS)), rounded=False),
        cuboid((0.02, 0.0, 2.2 * thick), (0.035, 0.003, 0.0015), shade(rng, pick(rng, STEEL))),
    ]


def wrench(rng: Generator) -> list[Shape]:
    """Draw a wrench: a flat bar with a ring at one end and an open jaw at the other."""
    long, width, steel = rng.uniform(0.10, 0.18), rng.uniform(0.006, 0.010), shade(rng, pick(rng, STEEL))
    head, t = rng.uniform(1.7, 2.2) * width, np.linspace(0, 1, 10)
    bar = limb(flat(long * t, 0 * t, 0.004), width * (1 - 0.25 * np.sin(np.pi * t)), steel, 0.45)
    jaws = [
        limb(
            flat(np.array([long, long + 1.6 * head]), side * np.array([0.4, 0.75]) * head, 0.005),
            np.full(2, 0.4 * head),
            steel,
            0.6,
        )
        for side in (-1, 1)
    ]
    return [bar, *jaws, hoop(0.8 * head, 0.35 * head, steel).moved(-0.9 * head, 0.0, 0.35 * head)]


TOOLS: tuple[Maker, ...] = (pliers, screwdriver, hammer, scissors, pen, wrench)
"""Functions that draw one tool each."""


def _disk(radius: float, bottom: float, top: float, color: Color) -> Shape:
    return turned_profile(np.array([(0, bottom), (radius, bottom), (radius, top), (0, top)]), color)
