"""Loose knots in one cable, on the table or in the air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.polynomial.chebyshev import chebval
from numpy.random import Generator

from ...types import Bools, Floats
from .curves import STEP, Crossings, find_crossings
from .families import Size, joined, lay
from .model import Scene, Truth
from .stacking import heights, least_bend, lowest_clearance, resampled
from .studio import Studio, cable_color, make_studio

# Knots as curves of Chebyshev polynomials T_a(t), T_b(t), crossed over and under in turn (Koseleff and Pecker,
# "Chebyshev knots", 2011): (3, 4) has the trefoil's three crossings, (3, 5) the figure eight's four.
KNOTS = {"overhand": (3, 4), "figure eight": (3, 5)}
RADII = (0.0022, 0.0035)  # m
WIDE = 2.5  # how many times as thick the cable is taken whose crossings are those of a knot in the air


def knots(rng: Generator, size: Size) -> Scene | None:
    """An overhand or a figure eight knot, loose, lying on the table or held in the air above it."""
    studio, radius = make_studio(rng, size, (0.6, 0.85)), rng.uniform(*RADII)
    curve = _knot(rng, studio, *KNOTS[list(KNOTS)[rng.integers(len(KNOTS))]])
    points, strand = joined([curve])
    crossed = find_crossings(points, strand)
    over = alternating(crossed) ^ (rng.random() < 0.5)
    if rng.random() < 0.5:
        return lay(rng, studio, [curve], radius, over=over)
    z = heights(points, strand, crossed, over, WIDE * radius)
    if z is None:
        return None
    axis = resampled(np.column_stack((curve, z + rng.uniform(0.02, 0.08))))
    if not studio.inside(axis) or least_bend(axis) < 4 * radius or lowest_clearance([axis], radius) < 1.5:
        return None
    cable = Truth(studio.to_camera(axis), radius, color=cable_color(rng))
    scene = Scene("", "", 0, studio.camera, (cable,), (), studio.table(), studio.light)
    return scene if rng.random() < 0.7 else replace(scene, table=None)


def _knot(rng: Generator, studio: Studio, a: int, b: int) -> Floats:
    """(P, 2) m, STEP apart: the knot's plane curve, warped a little, turned and mirrored at random."""
    t = np.linspace(-1, 1, 4001) * rng.uniform(1.02, 1.05)
    flat = np.column_stack((chebval(t, np.eye(b + 1)[b]), chebval(t, np.eye(a + 1)[a])))
    flat *= rng.choice((-1, 1), size=2)
    wave = rng.uniform(-0.08, 0.08, size=(2, 2))
    flat = flat + np.column_stack((np.sin(1.5 * flat[:, 1]), np.sin(1.5 * flat[:, 0]))) @ wave
    turn = rng.uniform(-0.2, 0.2)
    flat = flat @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    flat = flat - (flat.max(axis=0) + flat.min(axis=0)) / 2
    flat = flat / np.ptp(flat, axis=0) * np.array(studio.view()) * rng.uniform(0.28, 0.42, size=2)
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(flat, axis=0), axis=1))))
    at = np.arange(0, along[-1], STEP)
    return np.column_stack((np.interp(at, along, flat[:, 0]), np.interp(at, along, flat[:, 1])))


def alternating(crossings: Crossings) -> Bools:
    """(C,) bool: the first strand is the upper, such that the cable goes over and under in turn."""
    visits = np.argsort(np.argsort(np.concatenate((crossings.first, crossings.second))))
    return np.asarray(visits[: len(crossings.first)] % 2 == 0)
