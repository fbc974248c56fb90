"""Tough families of cables on a table: a coil whose turns cross and touch, two radii that touch, four cables side by side."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline

from ....types import Floats
from ..curves import oriented_curve, random_curves
from ..families import Size, at_height, sound_scene
from ..model import Scene
from ..stacking import spline_axis
from ..studio import Studio, make_studio
from .settle import STEP, settle

TURNS = (4.0, 5.6)
"""Turns of a coil."""

WANDER = 0.09
"""Standard deviation of the distance and of the center of a turn, in mean distances from the center of the coil."""

LEVEL_RADII = 3.6
"""Radii in height between two turns of a coil before it falls."""

THIN_PARTS = (0.38, 0.48)
"""Radius of the thin cable in radii of the thick one that it touches."""


def coil(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a cable in 3 to 6 turns that cross, overlap and touch in random order. `size` is (width, height) px."""
    studio, radius = make_studio(rng, size, (0.46, 0.66)), rng.uniform(0.0033, 0.0044)
    turns, mean = rng.uniform(*TURNS), rng.uniform(0.065, 0.09)
    angle = np.arange(0, 2 * np.pi * turns, STEP / mean)
    knots = np.linspace(0, angle[-1], round(2.5 * turns))
    distance, *center = WANDER * CubicSpline(knots, rng.normal(size=(len(knots), 3)))(angle).T
    flat = mean * (np.column_stack((np.cos(angle), np.sin(angle))) * (1 + distance)[:, None] + 0.7 * np.column_stack(center))
    knots = np.linspace(0, angle[-1], round(turns) + 1)
    level = LEVEL_RADII * radius * CubicSpline(knots, np.arange(len(knots)) + rng.uniform(-1, 1, len(knots)))(angle)
    tails = [np.arange(1, rng.uniform(0.02, 0.14) / STEP)[:, None] * STEP for _ in range(2)]
    headings = [(a - b) / np.linalg.norm(a - b) for a, b in ((flat[0], flat[4]), (flat[-1], flat[-5]))]
    planar = np.vstack((flat[0] + tails[0][::-1] * headings[0], flat, flat[-1] + tails[1] * headings[1]))
    heights = np.pad(level, [len(tail) for tail in tails], mode="edge") - level.min() + radius
    planar = planar - (planar.max(axis=0) + planar.min(axis=0)) / 2 + rng.uniform(-0.05, 0.05, 2)
    settled = settle(np.column_stack((planar, heights)), radius)
    return None if settled is None else sound_scene(rng, studio, [spline_axis(settled)], np.array([radius]))


def radii(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a thick and a thin cable that touch side by side and part at both ends. `size` is (width, height) px."""
    studio, thick = make_studio(rng, size, (0.55, 0.8), 20.0), rng.uniform(0.006, 0.009)
    thin = thick * rng.uniform(*THIN_PARTS)
    middle = _middle(rng, studio, rng.uniform(0.47, 0.62))
    beside = 2 * np.sqrt(thick * thin) * 1.01
    aside = beside + _fanned(rng, len(middle), rng.uniform(0.015, 0.06, 2))
    axes = _beside(rng, middle, [np.zeros(len(middle)), rng.choice((-1.0, 1.0)) * aside], np.array([thick, thin]))
    return sound_scene(rng, studio, axes, np.array([thick, thin]), int(rng.integers(1, 3)))


def bundle(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of four cables side by side, a third to a whole thickness apart. `size` is (width, height) px."""
    studio, radius = make_studio(rng, size, (0.52, 0.66)), rng.uniform(0.0029, 0.004)
    middle = _middle(rng, studio, rng.uniform(0.4, 0.46))
    gap = 2 * radius * rng.uniform(1.35, 2.0)
    spread = gap + _fanned(rng, len(middle), gap * rng.uniform(0.3, 1.2, 2))
    four = np.full(4, radius)
    return sound_scene(
        rng, studio, _beside(rng, middle, [k * spread for k in (-1.5, -0.5, 0.5, 1.5)], four), four, rng.choice((1, 4))
    )


def _middle(rng: Generator, studio: Studio, length: float) -> Floats:
    """Draw the planar curve that cables lie along, (P, 2) m."""
    curve = oriented_curve(random_curves(rng, 1, length, 0.1)[0], rng.uniform(-np.pi / 3, np.pi / 3))
    slack = np.clip(np.array(studio.usable_size()) - np.ptp(curve, axis=0), 0, None)
    return np.asarray(curve + rng.uniform(-0.35, 0.35, 2) * slack)


def _fanned(rng: Generator, count: int, fans: Floats) -> Floats:
    """Return how far cables part along a curve of `count` points, from 0 in its middle to `fans` (2,) m at its ends."""
    t, start, end = np.linspace(0, 1, count), *rng.uniform(0.2, 0.36, 2)
    return np.asarray(fans[0] * np.clip(1 - t / start, 0, 1) ** 2 + fans[1] * np.clip(1 - (1 - t) / end, 0, 1) ** 2)


def _beside(rng: Generator, middle: Floats, places: list[Floats], radii: Floats) -> list[Floats]:
    """Return the axes of cables on the table at distances (P,) m from a planar curve; their ends are up to 2 cm short."""
    tangent = np.gradient(middle, axis=0)
    normal = np.column_stack((-tangent[:, 1], tangent[:, 0])) / np.linalg.norm(tangent, axis=1, keepdims=True)
    axes = []
    for place, radius in zip(places, radii, strict=True):
        first, last = rng.integers(0, 10, 2)
        axes.append(spline_axis(at_height((middle + place[:, None] * normal)[first : len(middle) - last], float(radius))))
    return axes
