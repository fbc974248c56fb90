"""Draw planar curves for cables in view of a camera, and build scenes of cables along them that do not intersect."""

import numpy as np
from numpy.random import Generator

from ...types import Bools, Floats, Ints
from .curves import clear_crossings, curve_crossings, oriented_curve, random_curves
from .model import Color, Scene, Solid, Truth
from .stacking import min_bend_radius, min_clearance, resting_heights, spline_axis
from .studio import Studio, cable_color

CANDIDATES = 60
"""Number of random curves among which a suitable one is sought."""

MIN_BEND_RADII = 4.0
"""Least bend radius of a cable, in radii of the cable."""


def min_strand_distance(radius: float) -> float:
    """Return the least distance in m between the axes of cables side by side: 5 times their radius (m)."""
    return 5 * radius


def at_height(curve: Floats, height: float) -> Floats:
    """Return the points of a planar curve (P, 2) m at one height in m above the table: (P, 3) m in the world frame (z up)."""
    return np.column_stack((curve, np.full(len(curve), height)))


def concatenate_curves(curves: list[Floats]) -> tuple[Floats, Ints]:
    """Join curves, (P, 2) m each, to one array.

    Returns
    -------
    points : (sum of P, 2) m, the points of all curves one after the other.
    strand : (sum of P,) int, index of the curve that each point belongs to.
    """
    return np.vstack(curves), np.repeat(np.arange(len(curves)), [len(curve) for curve in curves])


def planar_curve(
    rng: Generator,
    studio: Studio,
    radius: float,
    length: float,
    crossing_range: tuple[int, int],
    strand_distance: float | None = None,
    min_angle: float = 32.0,
) -> Floats | None:
    """Draw a curve on the table that is fully in view and whose number of crossings is within a range.

    Parameters
    ----------
    rng
        the random number generator to draw from.
    studio
        the camera above the table.
    radius, length
        radius and length of the cable that will lie along the curve, m.
    crossing_range
        (least, greatest) number of crossings of the curve with itself.
    strand_distance
        least distance between two passes of the curve away from crossings, m; None for 5 radii.
    min_angle
        least angle at a crossing, degrees.

    Returns
    -------
    (P, 2) m, x and y in the world frame (table plane) of P points 2 mm apart; None if none of 60 drawn curves meets the
    conditions.
    """
    usable = np.array(studio.usable_size())
    distance = min_strand_distance(radius) if strand_distance is None else strand_distance
    for candidate in random_curves(rng, CANDIDATES, length, max(6.5 * radius, 0.025)):
        curve = oriented_curve(candidate, rng.uniform(-0.35, 0.35))
        if (np.ptp(curve, axis=0) > usable).any():
            continue
        crossed = clear_crossings(*concatenate_curves([curve]), distance, np.radians(min_angle))
        if crossed is None or not crossing_range[0] <= len(crossed.first) <= crossing_range[1]:
            continue
        curve = curve + studio.shift_in_view(rng, curve)
        if studio.contains(at_height(curve, radius)):
            return np.asarray(curve)
    return None


def cables_on_table(
    rng: Generator,
    studio: Studio,
    curves: list[Floats],
    radius: float,
    occluders: tuple[Solid, ...] = (),
    color: Color | None = None,
    over: Bools | None = None,
) -> Scene | None:
    """Build the scene of cables that lie on a table along planar curves, on top of each other where they cross.

    Parameters
    ----------
    rng
        the random number generator, for colors and orders that are not given.
    studio
        the camera above the table.
    curves
        (P, 2) m each, x and y in the world frame (table plane), points 2 mm apart.
    radius
        radius of all cables, m.
    occluders
        other solids, in the camera's optical frame.
    color
        8-bit RGB of all cables; None draws a color from `rng`.
    over
        (C,) bool for the C crossings in the order of `curve_crossings`: True if the strand that comes first along the curves is
        on top; None draws the order from `rng`.

    Returns
    -------
    The scene in the camera's optical frame; None if the cables would intersect, bend too much or leave the image.
    """
    points, strand = concatenate_curves(curves)
    crossed = curve_crossings(points, strand)
    upper = rng.random(len(crossed.first)) < 0.5 if over is None else over
    z = resting_heights(points, strand, crossed, upper, radius)
    if z is None:
        return None
    axes = [spline_axis(np.column_stack((curve, z[strand == k]))) for k, curve in enumerate(curves)]
    return sound_scene(rng, studio, axes, radius, color or 1, occluders)


def is_sound(studio: Studio, axes: list[Floats], radii: Floats | float, clearance: float = 0.999) -> bool:
    """Return whether cables are in the image, and neither intersect nor bend too much.

    Parameters
    ----------
    studio
        the camera above the table.
    axes
        (P, 3) m in the world frame for each cable, P points 0.5 mm apart.
    radii
        m, the radius of each cable, or of all.
    clearance
        least distance of their axes in sums of their radii; 0 for any.
    """
    if not all(studio.contains(axis) for axis in axes) or (clearance and min_clearance(axes, radii) < clearance):
        return False
    own = zip(axes, np.broadcast_to(radii, len(axes)), strict=True)
    return all(min_bend_radius(axis) >= MIN_BEND_RADII * radius for axis, radius in own)


def sound_scene(
    rng: Generator,
    studio: Studio,
    axes: list[Floats],
    radii: Floats | float,
    colors: int | Color = 1,
    solids: tuple[Solid, ...] = (),
    clearance: float = 0.999,
) -> Scene | None:
    """Return the scene of cables above a table, or None if they are not sound (see `is_sound`).

    Parameters
    ----------
    rng
        the random number generator, for the colors.
    studio, axes, radii, clearance
        as for `is_sound`.
    colors
        number of colors of the cables, or the color of all.
    solids
        other objects, in the camera's optical frame.
    """
    if not is_sound(studio, axes, radii, clearance):
        return None
    drawn = [cable_color(rng) for _ in range(colors)] if isinstance(colors, int | np.integer) else [colors]
    cables = tuple(
        Truth(studio.to_camera(axis), radius, color=drawn[k % len(drawn)])
        for k, (axis, radius) in enumerate(zip(axes, np.broadcast_to(radii, len(axes)).tolist(), strict=True))
    )
    return studio.scene(cables, solids)
