"""Draw loose knots in one cable, on the table or in the air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.polynomial.chebyshev import chebval
from numpy.random import Generator

from ...types import Bools, Floats
from .curves import STEP, CurveCrossings, curve_crossings, resample_polyline, turned_curve
from .families import Size, cables_on_table, concatenate_curves, sound_scene
from .model import Scene
from .stacking import resting_heights, spline_axis
from .studio import Studio, make_studio, pick

KNOTS = {"overhand": (3, 4), "figure eight": (3, 5)}
"""Degrees a, b of knots as curves of Chebyshev polynomials T_a(t), T_b(t), crossed over and under in turn (Koseleff and
Pecker, "Chebyshev knots", 2011): (3, 4) has the trefoil's three crossings, (3, 5) the figure eight's four."""

RADII = (0.0022, 0.0035)
"""m, least and greatest radius of a cable."""

AIR_THICKNESS_FACTOR = 2.5
"""Times the cable's own thickness at which the strands of a knot in the air cross."""


def knots(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable in a loose overhand or figure-eight knot.

    The knot lies on the table, or is held in the air.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius = make_studio(rng, size, (0.6, 0.85)), rng.uniform(*RADII)
    curve = planar_knot(rng, studio, *KNOTS[pick(rng, list(KNOTS))])
    points, strand = concatenate_curves([curve])
    crossed = curve_crossings(points, strand)
    over = alternating(crossed) ^ (rng.random() < 0.5)
    if rng.random() < 0.5:
        return cables_on_table(rng, studio, [curve], radius, over=over)
    z = resting_heights(points, strand, crossed, over, AIR_THICKNESS_FACTOR * radius)
    if z is None:
        return None
    axis = spline_axis(np.column_stack((curve, z + rng.uniform(0.02, 0.08))))
    scene = sound_scene(rng, studio, [axis], radius, clearance=1.5)
    return scene if scene is None or rng.random() < 0.7 else replace(scene, table=None)


def planar_knot(rng: Generator, studio: Studio, a: int, b: int) -> Floats:
    """Return the knot's planar curve, slightly warped, rotated and mirrored at random: (P, 2) m, STEP apart."""
    t = np.linspace(-1, 1, 4001) * rng.uniform(1.02, 1.05)
    curve = np.column_stack((chebval(t, np.eye(b + 1)[b]), chebval(t, np.eye(a + 1)[a])))
    curve *= rng.choice((-1, 1), size=2)
    wave = rng.uniform(-0.08, 0.08, size=(2, 2))
    curve = curve + np.column_stack((np.sin(1.5 * curve[:, 1]), np.sin(1.5 * curve[:, 0]))) @ wave
    curve = turned_curve(curve, rng.uniform(-0.2, 0.2))
    curve = curve / np.ptp(curve, axis=0) * np.array(studio.usable_size()) * rng.uniform(0.28, 0.42, size=2)
    return resample_polyline(curve, STEP)


def alternating(crossings: CurveCrossings) -> Bools:
    """Choose the upper strand at each of the C crossings of one curve, so that the curve passes over and under in turn.

    The first pass along the curve is over.

    Parameters
    ----------
    crossings
        the crossings of the curve with itself, from `curve_crossings`.

    Returns
    -------
    (C,) bool: True where the pass that comes first along the curve is on top.
    """
    visits = np.argsort(np.argsort(np.concatenate((crossings.first, crossings.second))))
    return np.asarray(visits[: len(crossings.first)] % 2 == 0)
