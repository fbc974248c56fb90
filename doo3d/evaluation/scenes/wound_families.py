"""Build scenes of wound, knotted or parallel cables: coils, rings, figures of eight, knots, bundles, two radii.

Each builder draws one scene in the camera's optical frame, or returns None if the draw cannot be built.
"""

from dataclasses import replace

import numpy as np
from numpy.polynomial.chebyshev import chebval
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from ...types import Bools, Floats
from .curves import (
    STEP,
    CurveCrossings,
    clear_crossings,
    curve_crossings,
    offset_curve,
    oriented_curve,
    random_curves,
    resample_polyline,
    turned_curve,
)
from .families import RADII, Size
from .model import Scene, Truth
from .placing import at_height, cables_on_table, is_sound, sound_scene
from .stacking import min_clearance, resting_heights, spline_axis
from .studio import Studio, cable_color, make_studio, pick

TURNS = (3.0, 6.0)
"""Least and greatest number of turns of a coil."""

MIN_CROSSING_ANGLE = np.radians(20.0)
"""Least angle in radians at which the strands of a figure of eight cross."""

BUNDLE = (3, 5)
"""Least and greatest number of cables in a bundle."""

KNOTS = {"overhand": (3, 4), "figure eight": (3, 5)}
"""Degrees a, b of knots as curves of Chebyshev polynomials T_a(t), T_b(t), crossed over and under in turn (Koseleff and
Pecker, "Chebyshev knots", 2011): (3, 4) has the trefoil's three crossings, (3, 5) the figure eight's four."""

KNOT_RADII = (0.0022, 0.0035)
"""Least and greatest radius of a knotted cable, m."""

AIR_THICKNESS_FACTOR = 2.5
"""Distance between the strands at a crossing of a knot in the air, in thicknesses of the cable."""


def coil(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a flat coil of 3 to 6 turns, whose inner end leads out over or under all turns.

    The result is None if the draw from `rng` cannot be built; then call again with the same `rng`. `size` is (width, height) px
    of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(0.002, 0.004)
    inner, spacing = rng.uniform(0.025, 0.05), 2 * radius * rng.uniform(1.15, 2.6)
    turns = rng.uniform(*TURNS)
    angle = np.arange(0, 2 * np.pi * turns, 0.5 * STEP / inner)
    distance = inner + spacing * angle / (2 * np.pi)
    wobble = 1 + rng.uniform(0, 0.04) * np.sin(2 * angle + rng.uniform(0, 6)) * np.minimum(angle / 3, 1)
    spiral = np.column_stack((distance * np.sin(angle), -distance * np.cos(angle))) * wobble[:, None]
    tail = np.arange(distance[-1] + rng.uniform(0.03, 0.12), 0, -STEP)
    bow = rng.uniform(0, 0.15) * np.clip(tail - 0.03, 0, None) ** 2 / 0.1
    start = np.column_stack((-tail, -inner - bow))
    rest = np.arange(1, int(rng.uniform(0.02, 0.12) / STEP)) * STEP
    heading = (spiral[-1] - spiral[-2]) / np.linalg.norm(spiral[-1] - spiral[-2])
    points = np.vstack((start, spiral, spiral[-1] + rest[:, None] * heading))
    curve = resample_polyline(points * (1.0, rng.uniform(0.8, 1.0)) * rng.choice((-1, 1), 2), STEP)
    curve = turned_curve(curve, rng.uniform(0, 2 * np.pi)) + studio.shift_in_view(rng, curve)
    crossed = curve_crossings(curve)
    over = np.full(len(crossed.first), rng.random() < 0.7)
    return cables_on_table(rng, studio, [curve], radius, over=over) if len(crossed.first) >= int(turns) - 1 else None


def figure_eight(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable laid in a figure of eight, whose ends nearly meet in a lobe.

    The result is None if the draw from `rng` cannot be built; then call again with the same `rng`. `size` is (width, height) px
    of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(0.0022, 0.0045)
    wide, tall = rng.uniform(0.10, 0.2), rng.uniform(0.09, 0.17)
    start = rng.choice((-0.5, 0.5)) * np.pi + rng.uniform(-0.5, 0.5)
    t = start + np.linspace(0, 2 * np.pi * rng.uniform(0.88, 0.97), 2000)
    shrink = 1 - rng.uniform(0.15, 0.3) * (t - start) / (2 * np.pi)
    curve = np.column_stack((wide * np.sin(t), tall * np.sin(t) * np.cos(t))) * shrink[:, None]
    drift = rng.uniform(-0.04, 0.04, 2) * (1.0, 0.2) * np.linspace(0, 1, len(t))[:, None]
    curve = turned_curve(resample_polyline(curve + drift, STEP), rng.uniform(-0.5, 0.5))
    curve = np.asarray(curve + studio.shift_in_view(rng, curve))
    if clear_crossings(curve, np.zeros(len(curve), dtype=int), 2.3 * radius, MIN_CROSSING_ANGLE) is None:
        return None
    return cables_on_table(rng, studio, [curve], radius)


def ring(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one closed ring of cable, warped, on the table or tilted in the air.

    The result is None if the draw from `rng` cannot be built; then call again with the same `rng`. `size` is (width, height) px
    of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    t = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    distance: Floats = np.full(len(t), rng.uniform(0.05, 0.13))
    for k in (2, 3, 4):
        distance *= np.asarray(1 + rng.uniform(0, 0.5 / k) * np.cos(k * t + rng.uniform(0, 2 * np.pi)))
    planar = np.column_stack((distance * np.cos(t) * rng.uniform(1.0, 1.6), distance * np.sin(t)))
    planar = turned_curve(planar, rng.uniform(0, np.pi))
    points = at_height(planar + studio.shift_in_view(rng, planar), radius)
    if rng.random() < 0.5:
        tilted = Rotation.from_rotvec(rng.uniform(-0.7, 0.7, 3) * (1, 1, 0)).apply(points)
        points = tilted + np.array([0, 0, rng.uniform(0.01, 0.1) + radius - tilted[:, 2].min()])
    axis = spline_axis(points, closed=True)
    around = np.vstack((axis, axis[:20]))
    if not is_sound(studio, [around], radius, 0) or min_clearance([axis[:-40]], radius) < 1.2:
        return None
    return studio.scene((Truth(studio.to_camera(axis), radius, closed=True, color=cable_color(rng)),))


def bundle(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of three to five cables of one color that run side by side for a while and fan out at both ends.

    The result is None if the draw from `rng` cannot be built; then call again with the same `rng`. `size` is (width, height) px
    of the image.
    """
    studio, count = make_studio(rng, size), int(rng.integers(BUNDLE[0], BUNDLE[1] + 1))
    radius = rng.uniform(0.002, 0.004)
    gap, fan = 2 * radius * (1 + rng.uniform(0.05, 0.6)), 2 * radius * rng.uniform(2.0, 4.0)
    radii = np.full(count, radius)
    return _side_by_side(rng, studio, radii, np.arange(count) - (count - 1) / 2, (gap, fan), (fan, fan))


def two_radii(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a thick and a thin cable of one color that run side by side and part.

    The result is None if the draw from `rng` cannot be built; then call again with the same `rng`. `size` is (width, height) px
    of the image.
    """
    studio, thin = make_studio(rng, size), rng.uniform(0.0018, 0.003)
    thick = thin * rng.uniform(1.7, 2.8)
    gap = thin + thick + 2 * thin * rng.uniform(0.1, 1.0)
    fans = gap + 2 * thin * rng.uniform(0.0, 8.0, 2)
    order = rng.choice((-1.0, 1.0)) * np.array([-0.5, 0.5])
    return _side_by_side(rng, studio, np.array([thick, thin]), order, (gap, gap), (float(fans[0]), float(fans[1])))


def _side_by_side(
    rng: Generator, studio: Studio, radii: Floats, order: Floats, gap: tuple[float, float], fans: tuple[float, float]
) -> Scene | None:
    """Return the scene of cables along a common curve, at offsets `order` times a distance.

    The distance is drawn from the range `gap` in the middle of the curve, and from `fans` at its ends.
    """
    length, thickest = rng.uniform(0.45, 0.85), float(radii.max())
    middle = oriented_curve(random_curves(rng, 1, length, 0.08 + 8 * thickest)[0], rng.uniform(-0.4, 0.4))
    middle = middle + studio.shift_in_view(rng, middle)
    t = np.linspace(0, 1, len(middle))
    start, end = rng.uniform(0.15, 0.35), rng.uniform(0.65, 0.85)
    spread = gap[0] + (fans[0] - gap[0]) * _eased((start - t) / start) + (fans[1] - gap[0]) * _eased((t - end) / (1 - end))
    axes = cables_beside(rng, middle, [place * spread for place in order], radii, 20)
    return sound_scene(rng, studio, axes, radii)


def cables_beside(rng: Generator, middle: Floats, offsets: list[Floats], radii: Floats, most: int) -> list[Floats]:
    """Return the axes of cables on the table at offsets (P,) m from a planar curve, each end shortened by up to `most` steps."""
    axes = []
    for offset, radius in zip(offsets, radii, strict=True):
        first, last = rng.integers(0, most, 2)
        axes.append(spline_axis(at_height(offset_curve(middle, offset)[first : len(middle) - last], float(radius))))
    return axes


def _eased(t: Floats) -> Floats:
    """Return a smooth step function of t (R,): 0 for t <= 0, 1 for t >= 1."""
    t = np.clip(t, 0, 1)
    return np.asarray(t * t * (3 - 2 * t))


def knots(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable in a loose overhand or figure-eight knot.

    The knot lies on the table, or is held in the air.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius = make_studio(rng, size, (0.6, 0.85)), rng.uniform(*KNOT_RADII)
    curve = planar_knot(rng, studio, *KNOTS[pick(rng, list(KNOTS))])
    crossed = curve_crossings(curve)
    over = alternating(crossed) ^ (rng.random() < 0.5)
    if rng.random() < 0.5:
        return cables_on_table(rng, studio, [curve], radius, over=over)
    z = resting_heights(curve, np.zeros(len(curve), dtype=int), crossed, over, AIR_THICKNESS_FACTOR * radius)
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
