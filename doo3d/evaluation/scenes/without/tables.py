"""Draw scenes of tables with lines: long shadows, seams and grooves between boards, edges, and print on paper."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.random import Generator

from ....types import Floats
from ..model import Color, Scene, Solid
from ..studio import pick
from .places import SURFACES, free_studio, spread, surface
from .shapes import Shape, cuboid, limb, ribbon, shade, solids, wood
from .things import THINGS
from .tools import TOOLS

SHADOW_SLANTS = (50.0, 68.0)
"""Least and greatest angle in degrees from the vertical to a light that makes long shadows."""

INKS: tuple[Color, ...] = ((24, 24, 28), (24, 24, 28), (180, 30, 30), (30, 60, 160), (110, 110, 114))
"""Colors of print, 8-bit RGB."""

PAPER_THICKNESS, INK_HEIGHT = 0.0002, 0.0003
"""Height of paper and of ink above the table, m."""

PLANK_GRAINS = 3
"""Number of different grains in a table of boards."""

FLOOR_DEPTHS = (0.3, 0.8)
"""Least and greatest height of the table above the floor, m."""


def shadows(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of one to four long shadows of bars outside the view, straight or bent, on a table with a few things."""
    studio = free_studio(rng, size, SHADOW_SLANTS)
    light = studio.rotation.T @ np.array(studio.light)
    half = np.array(studio.usable_size()) / 2
    bars = list[Shape]()
    for _ in range(int(rng.integers(1, 5))):
        heading, radius = rng.uniform(0, 2 * np.pi), float(np.exp(rng.uniform(np.log(0.003), np.log(0.03))))
        along = np.linspace(-1, 1, 30) * rng.uniform(0.15, 0.8)
        bow = rng.choice((0.0, 0.3)) * along**2 * rng.uniform(-1, 1)
        ground = np.column_stack(
            (along * np.cos(heading) - bow * np.sin(heading), along * np.sin(heading) + bow * np.cos(heading))
        )
        ground += rng.uniform(-0.7, 0.7, 2) * half
        # far up along the way to the light, where the camera does not see the bar
        up = (studio.distance + 0.5) / light[2]
        bars.append(limb(np.column_stack((ground, np.zeros(30))) + up * light, np.full(30, radius), (90, 90, 90)))
    hidden = solids(bars, studio)
    if any((bar.vertices[:, 2] > 0).any() for bar in hidden):
        hidden = tuple(bar for bar in hidden if not (bar.vertices[:, 2] > 0).any())
    things = spread(rng, studio, (*TOOLS, *THINGS), int(rng.integers(0, 4)))
    return studio.scene((), (*hidden, *things), surface(rng, studio))


def boards(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of a table of boards or tiles with seams or grooves between them, which may end in the view."""
    studio = free_studio(rng, size)
    width, gap = rng.uniform(0.06, 0.22), float(rng.choice((0.0008, rng.uniform(0.001, 0.004), rng.uniform(0.004, 0.012))))
    long = float(rng.choice((6.0, rng.uniform(0.3, 0.9))))
    start = rng.uniform(-0.5, 0.2) if rng.random() < 0.4 else -3.0
    heading, color = rng.uniform(0, np.pi), shade(rng, pick(rng, SURFACES))
    first, grained, spread_of_color = wood(rng, studio), rng.random() < 0.7, rng.choice((0.0, 0.12, 0.3))
    grains = [replace(first, point=first.point + rng.uniform(-0.2, 0.2, 3)) if grained else None for _ in range(PLANK_GRAINS)]
    planks = list[Solid]()
    for row in range(int((2.0 - start) / width)):
        shift = rng.uniform(0, long) if rng.random() < 0.5 else 0.0
        for column in range(-int(2 / long) - 1, int(2 / long) + 1):
            center = ((column + 0.5) * long + shift, start + (row + 0.5) * width, -0.01)
            plank = cuboid(center, (long - gap, width - gap, 0.02), shade(rng, color, spread_of_color))
            planks += solids([plank.turned("z", heading)], studio, grains[len(planks) % PLANK_GRAINS])
    floor = surface(rng, studio, -float(rng.uniform(*FLOOR_DEPTHS)) if start > -3 else -0.02)
    things = spread(rng, studio, (*TOOLS, *THINGS), int(rng.integers(0, 4))) if start == -3.0 else []
    return studio.scene((), (*planks, *things), replace(floor, color=shade(rng, (110, 104, 98))))


def prints(rng: Generator, size: tuple[int, int]) -> Scene:
    """Draw a scene of sheets of paper with text, tables, frames and plots, and strips of tape, on a table."""
    studio = free_studio(rng, size)
    half = np.array(studio.usable_size()) / 2
    shapes = list[Shape]()
    for layer in range(int(rng.integers(1, 6))):
        angle, place = float(rng.uniform(0, 2 * np.pi)), rng.uniform(-0.8, 0.8, 2) * half
        made = _strip(rng) if rng.random() < 0.25 else _sheet(rng)
        shapes += [shape.turned("z", angle).moved(*place, layer * 2 * INK_HEIGHT) for shape in made]
    things = spread(rng, studio, (*TOOLS, *THINGS), int(rng.integers(0, 3)))
    return studio.scene((), (*solids(shapes, studio), *things), surface(rng, studio))


def _sheet(rng: Generator) -> list[Shape]:
    """Draw a sheet of paper with one kind of print: text, table, frame or plot."""
    x, y = ((0.297, 0.21), (0.21, 0.148), (0.42, 0.297))[rng.integers(3)]
    paper = shade(rng, (240, 239, 234), 0.04)
    ink, width = pick(rng, INKS), float(rng.uniform(0.0004, 0.0035))
    lines = (_text, _grid, _plot)[rng.integers(3)](rng, x - 0.04, y - 0.04)
    sheet = cuboid((0, 0, PAPER_THICKNESS / 2), (x, y, PAPER_THICKNESS), paper)
    return [sheet, *(ribbon(line, width, INK_HEIGHT, ink) for line in lines)]


def _text(rng: Generator, x: float, y: float) -> list[Floats]:
    """Return rows of words, as dashes."""
    result = list[Floats]()
    for row in np.arange(-y / 2, y / 2, rng.uniform(0.006, 0.014)):
        stops = -x / 2 + np.cumsum(rng.uniform(0.004, 0.02, 60))
        stops = stops[stops < x / 2 * rng.choice((0.4, 1.0, 1.0))]
        result += [np.array([(a + 0.002, row), (b, row)]) for a, b in pairwise(stops)]
    return result


def _grid(rng: Generator, x: float, y: float) -> list[Floats]:
    """Return the lines of a table."""
    columns, rows = np.linspace(-x / 2, x / 2, int(rng.integers(2, 9))), np.linspace(-y / 2, y / 2, int(rng.integers(2, 12)))
    across = [np.array([(-x / 2, row), (x / 2, row)]) for row in rows]
    return across + [np.array([(column, -y / 2), (column, y / 2)]) for column in columns]


def _plot(rng: Generator, x: float, y: float) -> list[Floats]:
    """Return two axes and one to three curves."""
    axes = [np.array([(-x / 2, -y / 2), (x / 2, -y / 2)]), np.array([(-x / 2, -y / 2), (-x / 2, y / 2)])]
    along = np.linspace(-x / 2, x / 2, 80)
    for _ in range(int(rng.integers(1, 4))):
        wave = sum(rng.normal(0, 1 / k) * np.sin(k * np.pi * along / x + rng.uniform(0, 6)) for k in (1, 2, 3))
        axes.append(np.column_stack((along, np.clip(0.2 * y * wave, -y / 2, y / 2))))
    return axes


def _strip(rng: Generator) -> list[Shape]:
    """Draw a strip of tape of 10 to 50 mm, stuck to the table."""
    long, wide = rng.uniform(0.05, 0.6), rng.uniform(0.010, 0.05)
    color = shade(rng, ((220, 200, 150), (40, 40, 44), (230, 190, 20), (40, 80, 160), (232, 232, 230))[rng.integers(5)])
    return [cuboid((0, 0, PAPER_THICKNESS / 2), (long, wide, PAPER_THICKNESS), color)]
