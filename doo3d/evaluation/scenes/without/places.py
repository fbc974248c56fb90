"""Draw the table, the light and the places of objects in scenes without a cable."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from ....types import Floats
from ..model import Color, Solid, Table
from ..studio import TABLE_COLORS, Studio, make_studio, pick
from .shapes import Shape, shade, solids, wood

Maker = Callable[[Generator], list[Shape]]
"""Function that draws an object standing on the table at the origin."""

SURFACES: tuple[Color, ...] = (
    *TABLE_COLORS,
    (168, 120, 76),
    (205, 165, 116),
    (110, 70, 44),
    (235, 234, 228),
    (46, 50, 56),
    (58, 92, 84),
    (96, 110, 150),
)
"""Colors of tables, 8-bit RGB: grays, woods, white, dark, cutting mats."""

DISTANCES = (0.5, 1.5)
"""Least and greatest distance from the camera to the table, m."""

MAX_TILT, TILT_AT_METRE = 32.0, 20.0
"""Greatest tilt of the camera from straight down in degrees: near the table, and at a distance of 1 m. The simulated D435 treats
a surface that falls by more than 2.5 mm over two pixels as an edge."""

LIGHT_SLANTS = (15.0, 62.0)
"""Least and greatest angle in degrees from the vertical to the light; a low light makes long shadows."""

MAX_PLACES = 200
"""Greatest number of random places that are tried for the objects of a scene."""


def free_studio(rng: Generator, size: tuple[int, int], slants: tuple[float, float] = LIGHT_SLANTS) -> Studio:
    """Draw a camera above a table, with distance, tilt, light and table from wide ranges."""
    distance = float(rng.uniform(*DISTANCES))
    studio = make_studio(rng, size, (distance, distance), min(MAX_TILT, TILT_AT_METRE / distance))
    slant, turn = np.radians(rng.uniform(*slants)), rng.uniform(0, 2 * np.pi)
    light = studio.rotation @ (np.sin(slant) * np.cos(turn), np.sin(slant) * np.sin(turn), np.cos(slant))
    color = shade(rng, pick(rng, SURFACES))
    return replace(studio, light=(float(light[0]), float(light[1]), float(light[2])), table_color=color)


def surface(rng: Generator, studio: Studio, height: float = 0.0) -> Table:
    """Return the table, of wood with a grain in half of the draws, at a height above z = 0 in m."""
    table = studio.table(height)
    return replace(table, grain=wood(rng, studio)) if rng.random() < 0.5 else table


def spread(
    rng: Generator, studio: Studio, makers: Sequence[Maker], count: int, taken: Sequence[tuple[Floats, float]] = ()
) -> list[Solid]:
    """Draw objects beside each other on the table, with random rotation.

    Parameters
    ----------
    rng
        the random number generator.
    studio
        the camera above the table.
    makers
        the kinds of objects, drawn with equal probability.
    count
        wanted number of objects; fewer are placed if the view is full.
    taken
        circles to keep free: center (2,) m, and radius in m.
    """
    placed, result = list(taken), list[Solid]()
    half = np.array(studio.usable_size()) / 2
    for _ in range(MAX_PLACES):
        if len(placed) - len(taken) == count:
            break
        shapes = pick(rng, makers)(rng)
        corners = np.vstack([shape.vertices for shape in shapes])[:, :2]
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        reach = float(np.linalg.norm(corners - middle, axis=1).max())
        center = rng.uniform(-1, 1, 2) * half
        if any(np.linalg.norm(center - other) < 0.75 * (reach + radius) for other, radius in placed):
            continue
        placed.append((center, reach))
        turn = float(rng.uniform(0, 2 * np.pi))
        lying = [shape.moved(*-middle, 0.0).turned("z", turn).moved(*center, 0.0) for shape in shapes]
        result += solids(lying, studio)
    return result
