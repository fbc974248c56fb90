"""Build scenes as hard as those of other generators: touching strands, cables in the air, a wall behind them.

Each builder draws one scene in the camera's optical frame from the given random numbers, or returns None if the draw cannot be
built; then call it again with the same generator.
"""

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from ...types import Floats
from .curves import STEP, oriented_curve, random_curves
from .families import Size
from .model import Scene, corners, cuboid
from .placing import planar_curve, sound_scene
from .settle import STEP as SETTLE_STEP
from .settle import settle
from .stacking import spline_axis
from .studio import GRIPPER_COLORS, Studio, make_studio, pick
from .wound_families import cables_beside

TURNS = (4.0, 5.6)
"""Least and greatest number of turns of a coil."""

WANDER = 0.09
"""Standard deviation of a turn's radius and center, as a fraction of the coil's mean radius."""

LEVEL_RADII = 3.6
"""Distance in height between two turns of a coil before it falls, in radii."""

THIN_PARTS = (0.38, 0.48)
"""Least and greatest radius of the thin cable, as a fraction of that of the thick cable that it touches."""

LIFTS = (0.045, 0.11)
"""Least and greatest height in m to which a gripper lifts a cable."""

HOOK_DEPTHS, NEAR_DEPTHS = (1.32, 1.42), (0.41, 0.48)
"""Distances in m from the camera to the peg, and to the near end of the cable that hangs on it."""

BEND_SIGMA = 50
"""Sigma, in axis points, of the smoothing of a hanging cable; it makes the cable stiff."""


def coil(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a cable in 3 to 6 turns that cross, overlap and touch in random order. `size` is (width, height) px."""
    studio, radius = make_studio(rng, size, (0.46, 0.66)), rng.uniform(0.0033, 0.0044)
    turns, mean = rng.uniform(*TURNS), rng.uniform(0.065, 0.09)
    angle = np.arange(0, 2 * np.pi * turns, SETTLE_STEP / mean)
    knots = np.linspace(0, angle[-1], round(2.5 * turns))
    distance, *center = WANDER * CubicSpline(knots, rng.normal(size=(len(knots), 3)))(angle).T
    flat = mean * (np.column_stack((np.cos(angle), np.sin(angle))) * (1 + distance)[:, None] + 0.7 * np.column_stack(center))
    knots = np.linspace(0, angle[-1], round(turns) + 1)
    level = LEVEL_RADII * radius * CubicSpline(knots, np.arange(len(knots)) + rng.uniform(-1, 1, len(knots)))(angle)
    tails = [np.arange(1, rng.uniform(0.02, 0.14) / SETTLE_STEP)[:, None] * SETTLE_STEP for _ in range(2)]
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
    both = np.array([thick, thin])
    axes = cables_beside(rng, middle, [np.zeros(len(middle)), rng.choice((-1.0, 1.0)) * aside], both, 10)
    return sound_scene(rng, studio, axes, both, int(rng.integers(1, 3)))


def bundle(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of four cables side by side, a third to a whole thickness apart. `size` is (width, height) px."""
    studio, radius = make_studio(rng, size, (0.52, 0.66)), rng.uniform(0.0029, 0.004)
    middle = _middle(rng, studio, rng.uniform(0.4, 0.46))
    gap = 2 * radius * rng.uniform(1.35, 2.0)
    spread = gap + _fanned(rng, len(middle), gap * rng.uniform(0.3, 1.2, 2))
    four = np.full(4, radius)
    axes = cables_beside(rng, middle, [k * spread for k in (-1.5, -0.5, 0.5, 1.5)], four, 10)
    return sound_scene(rng, studio, axes, four, rng.choice((1, 4)))


def _middle(rng: Generator, studio: Studio, length: float) -> Floats:
    """Draw the planar curve that cables lie along, (P, 2) m."""
    curve = oriented_curve(random_curves(rng, 1, length, 0.1)[0], rng.uniform(-np.pi / 3, np.pi / 3))
    return np.asarray(curve + studio.shift_in_view(rng, curve, 0.35))


def _fanned(rng: Generator, count: int, fans: Floats) -> Floats:
    """Return the extra distance between cables along a curve of `count` points: 0 in the middle, `fans` (2,) m at the ends."""
    t, start, end = np.linspace(0, 1, count), *rng.uniform(0.2, 0.36, 2)
    return np.asarray(fans[0] * np.clip(1 - t / start, 0, 1) ** 2 + fans[1] * np.clip(1 - (1 - t) / end, 0, 1) ** 2)


def wire(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a wire of 2 to 3 mm, on the table or up to 7 cm above it. `size` is (width, height) px of the image."""
    studio, radius = make_studio(rng, size, (0.48, 0.8), 20.0), rng.uniform(0.0011, 0.0015)
    curve = planar_curve(rng, studio, radius, rng.uniform(0.6, 0.85), (0, int(rng.integers(2))), 0.015)
    if curve is None:
        return None
    t, floor = np.linspace(0, 1, len(curve)), rng.choice((0.0, 0.02))
    high = floor + rng.choice((0.0, 1.0, 1.0)) * rng.uniform(0.015, 0.045) * np.cos(np.pi * (t - rng.uniform(0, 1))) ** 2
    axis = spline_axis(np.column_stack((curve, radius + high)))
    return sound_scene(rng, studio, [axis], np.array([radius]))


def gripper(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a cable that two fingers of a gripper lift off the table and hide. `size` is (width, height) px."""
    studio, radius = make_studio(rng, size, (0.6, 0.84), 16.0), rng.uniform(0.0034, 0.005)
    curve = planar_curve(rng, studio, radius, rng.uniform(0.78, 0.95), (0, int(rng.integers(2))), 4 * radius)
    if curve is None:
        return None
    arc, held = np.arange(len(curve)) * STEP, int(rng.uniform(0.2, 0.8) * len(curve))
    lift = rng.uniform(*LIFTS) * np.exp(-(((arc - arc[held]) / rng.uniform(0.09, 0.16)) ** 2))
    points = np.column_stack((curve, radius + lift))
    axis = spline_axis(points)
    frame = _gripper_frame(rng, points[held + 1] - points[held - 1])
    wide, long, thick, palm = rng.uniform(0.020, 0.03), rng.uniform(0.06, 0.08), 0.012, rng.uniform(0.045, 0.055)
    apart = 1.05 * radius + thick / 2
    boxes = [((0, 0.4 * long, side * apart), (wide, long, thick)) for side in (-1, 1)]
    boxes.append(((0, 0.9 * long + palm / 2, 0), (palm, palm, palm)))
    solids, color = [], pick(rng, GRIPPER_COLORS)
    for place, edges in boxes:
        inside = np.abs((axis - points[held]) @ frame.T - place) < np.array(edges) / 2 + radius
        vertices = (corners(edges) + place) @ frame + points[held]
        if inside.all(axis=1).any() or vertices[:, 2].min() < 0:
            return None
        solids.append(cuboid(studio.to_camera(vertices), color))
    return sound_scene(rng, studio, [axis], np.array([radius]), 1, tuple(solids))


def _gripper_frame(rng: Generator, along: Floats) -> Floats:
    """Draw the axes (3, 3) of a gripper that holds a cable of direction (3,).

    The axes point across the fingers, from the fingertips back, and from finger to finger.
    """
    turn = np.arctan2(along[1], along[0]) + rng.choice((-1, 1)) * np.pi / 2 + rng.uniform(-0.35, 0.35)
    rise = rng.uniform(0.2, 0.9)
    back = np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
    between = np.cross(back, along)
    between /= np.linalg.norm(between)
    return np.array([np.cross(between, back), back, between])


def hook(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a cable that hangs on a peg of a wall and comes 1 m towards the camera. `size` is (width, height) px."""
    studio, radius = make_studio(rng, size, (1.5, 1.6), 6.0), rng.uniform(0.0044, 0.006)
    camera, side, bend = studio.camera, rng.choice((-1.0, 1.0)), rng.uniform(0.035, 0.05)
    half = np.array([camera.width / camera.fx, camera.height / camera.fy, 2.0]) / 2
    depth, near = rng.uniform(*HOOK_DEPTHS), rng.uniform(*NEAR_DEPTHS)
    top = depth * half * (side * rng.uniform(-0.2, 0.35), rng.uniform(-0.75, -0.5), 1)
    tail = top + np.array([-side * rng.uniform(0.03, 0.09), rng.uniform(0.24, 0.34), rng.uniform(-0.03, 0.02)])
    down = [top + np.array([each * side * bend, 0.8 * bend, 0]) for each in (-1, 1)]
    low = half * (side * rng.uniform(0.05, 0.5), rng.uniform(0.3, 0.65), 1)
    end = half * (side * rng.uniform(-0.8, -0.3), rng.uniform(-0.4, 0.3), 1)
    row = 0.6 * (0.3 * low + 0.7 * end) + np.array([rng.uniform(-0.05, 0.05), rng.uniform(0, 0.08), 0])
    slack = np.array([0, 0.02, 0])
    control = np.vstack((tail, down[0], top, down[1], 0.55 * down[1] + 0.45 * 0.85 * low + slack, 0.85 * low, row, near * end))
    soft = gaussian_filter1d(spline_axis(control), BEND_SIGMA, axis=0, mode="nearest")
    axis = spline_axis(soft[::40])
    top = axis[int(np.argmin(axis[:, 1] + 10 * (axis[:, 2] < 1.2)))]
    under = np.array([0, radius + 0.006, -0.01])
    peg = cuboid(top + under + corners((0.01, 0.01, 1.7 - depth), (0.5, 0.5, 0)), GRIPPER_COLORS[0])
    world = (axis - (0, 0, studio.distance)) @ studio.rotation
    return sound_scene(rng, studio, [world], np.array([radius]), 1, (peg,))


TOUGH = {f"tough_{builder.__name__}": builder for builder in (coil, radii, hook, gripper, wire, bundle)}
"""Families of tough scenes: name -> builder."""
