"""The common kinds of scene: cables that lie on a table, cross themselves or each other, are partly hidden, hang in the air.

Each builder draws one scene from the random numbers given, or returns None when the draw does not work out.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ...types import Bools, Floats, Ints
from .curves import STEP, find_crossings, random_curves, tidy, turned_flat
from .model import Color, Scene, Solid, Truth
from .stacking import heights, least_bend, lowest_clearance, resampled
from .studio import GRIPPER_COLORS, Studio, box, cable_color, make_studio

Size = tuple[int, int]
CANDIDATES = 60  # curves drawn at once
RADII = (0.003, 0.006)  # m
LENGTHS = (0.5, 1.2)  # m


def straight(rng: Generator, size: Size) -> Scene | None:
    """One cable, nearly straight."""
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    length = rng.uniform(LENGTHS[0], max(LENGTHS[0] + 0.01, 0.95 * studio.view()[0]))
    along = np.arange(round(length / STEP) + 1) * STEP
    bow = rng.uniform(-0.02, 0.02) * np.sin(np.pi * along / length)
    curve = turned_flat(np.column_stack((along, bow)), rng.uniform(-0.4, 0.4))
    return lay(rng, studio, [curve], radius)


def open_curve(rng: Generator, size: Size) -> Scene | None:
    """One smooth curve without a crossing."""
    return _one_on_table(rng, size, (0, 0))


def crossing(rng: Generator, size: Size) -> Scene | None:
    """One cable that crosses itself once."""
    return _one_on_table(rng, size, (1, 1))


def crossings(rng: Generator, size: Size) -> Scene | None:
    """One cable that crosses itself two to four times."""
    return _one_on_table(rng, size, (2, 4))


def _one_on_table(rng: Generator, size: Size, count: tuple[int, int]) -> Scene | None:
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    curve = planar_curve(rng, studio, radius, rng.uniform(*LENGTHS), count)
    return None if curve is None else lay(rng, studio, [curve], radius)


def occluded(rng: Generator, size: Size) -> Scene | None:
    """One cable under one to three boxes, lying over it or held above it, as grippers and hands are."""
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    curve = planar_curve(rng, studio, radius, rng.uniform(*LENGTHS), (0, int(rng.integers(2))))
    if curve is None:
        return None
    boxes: list[Solid] = []
    middles: list[Floats] = []
    for _ in range(rng.integers(1, 4)):
        index = int(rng.uniform(0.15, 0.85) * len(curve))
        wide, middle = rng.uniform(0.025, 0.06), curve[index]
        tips = np.linalg.norm(curve[[0, -1]] - middle, axis=1).min()
        others = min((float(np.linalg.norm(middle - other)) for other in middles), default=1.0)
        if tips < 0.09 or others < 0.13:
            continue
        tangent = curve[index + 1] - curve[index]
        angle = np.arctan2(tangent[1], tangent[0]) + rng.uniform(-0.5, 0.5)
        bottom, tall = 2 * radius + (0.001 if rng.random() < 0.4 else rng.uniform(0.01, 0.06)), rng.uniform(0.012, 0.03)
        center = np.array([*middle, bottom + tall / 2])
        boxes.append(
            box(center, (wide, rng.uniform(0.05, 0.1), tall), angle, studio, GRIPPER_COLORS[rng.integers(len(GRIPPER_COLORS))])
        )
        middles.append(middle)
    return lay(rng, studio, [curve], radius, tuple(boxes)) if boxes else None


def several(rng: Generator, size: Size) -> Scene | None:
    """Two to four cables of one colour, which may cross each other."""
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    curves: list[Floats] = []
    wanted = int(rng.integers(2, 5))
    for _ in range(25):
        curve = planar_curve(rng, studio, radius, rng.uniform(0.5, 0.8), (0, 0))
        if curve is None:
            continue
        moved = curve + rng.uniform(-0.5, 0.5, size=2) * (np.array(studio.view()) - np.ptp(curve, axis=0))
        found = tidy(*joined([*curves, moved]), clearance(radius))
        if found is not None and len(found.first) <= 4 and studio.inside(lifted(moved, radius)):
            curves.append(moved)
        if len(curves) == wanted:
            return lay(rng, studio, curves, radius)
    return None


def air(rng: Generator, size: Size) -> Scene | None:
    """A helix, a hanging curve, or a loop with clear height at its crossing: nothing touches anything."""
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    shape = (_helix, _hanging, _high_loop)[rng.integers(3)](rng, studio, radius)
    if shape is None:
        return None
    axis = resampled(shape - (0, 0, shape[:, 2].mean()))
    below = axis[:, 2].min() - rng.uniform(0.05, 0.3)
    if not studio.inside(axis) or least_bend(axis) < 4 * radius:
        return None
    cable = Truth(studio.to_camera(axis), radius, color=cable_color(rng))
    table = studio.table(float(below)) if rng.random() < 0.7 else None
    return Scene("", "", 0, studio.camera, (cable,), (), table, studio.light)


def _helix(rng: Generator, studio: Studio, radius: float) -> Floats | None:
    around, pitch, turns = rng.uniform(0.03, 0.055), rng.uniform(0.05, 0.09), rng.uniform(1.6, 4.0)
    angle = np.linspace(0, 2 * np.pi * turns, 60 * int(turns + 1)) * rng.choice((-1, 1))
    x = pitch * np.abs(angle) / (2 * np.pi)
    points = np.column_stack((x - x.mean(), around * np.sin(angle), around * np.cos(angle)))
    yaw, roll = rng.uniform(-0.45, 0.45), rng.uniform(-0.3, 0.3)
    tilt = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    spin = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    points = points @ (spin @ tilt).T
    gap = lowest_clearance([resampled(points)], radius)
    return points if gap > 1.9 else None


def _hanging(rng: Generator, studio: Studio, radius: float) -> Floats | None:
    half, sag = rng.uniform(0.17, 0.26), rng.uniform(0.08, 0.22)
    x = np.linspace(-half, half, 150)
    steep = rng.uniform(1.2, 2.4)
    drop = sag * (np.cosh(steep * x / half) - 1) / (np.cosh(steep) - 1)
    slant = rng.uniform(0.3, 1.2)
    sway = rng.uniform(-0.02, 0.02) * np.sin(2 * np.pi * x / half + rng.uniform(0, 6))
    return np.column_stack((x, drop * np.cos(slant) - sag / 2 + sway, drop * np.sin(slant) + rng.uniform(-0.2, 0.2) * x))


def _high_loop(rng: Generator, studio: Studio, radius: float) -> Floats | None:
    curve = planar_curve(rng, studio, radius, rng.uniform(*LENGTHS), (1, 1))
    if curve is None:
        return None
    found = tidy(*joined([curve]), clearance(radius))
    if found is None:
        return None
    rise = max(0.15, 0.045 * len(curve) / float(found.second[0] - found.first[0]))
    return np.column_stack((curve, rise * np.linspace(-0.5, 0.5, len(curve)))) if rise < 0.25 else None


def clearance(radius: float) -> float:
    """m between the axes of strands that do not cross: a gap of one and a half diameters."""
    return 5 * radius


def lifted(curve: Floats, height: float) -> Floats:
    """(P, 3): a planar curve at one height in m."""
    return np.column_stack((curve, np.full(len(curve), height)))


def joined(curves: list[Floats]) -> tuple[Floats, Ints]:
    """The points of all curves (P, 2), and which curve each is of (P,)."""
    return np.vstack(curves), np.repeat(np.arange(len(curves)), [len(curve) for curve in curves])


def planar_curve(
    rng: Generator,
    studio: Studio,
    radius: float,
    length: float,
    count: tuple[int, int],
    space: float | None = None,
    min_angle: float = 32.0,
) -> Floats | None:
    """(P, 2) m: a curve in view that crosses itself between count[0] and count[1] times and keeps clear elsewhere.

    space : m between the axes of strands that do not cross; None: `clearance`. min_angle : degrees between crossing strands.
    """
    view = np.array(studio.view())
    for curve in random_curves(rng, CANDIDATES, length, max(6.5 * radius, 0.025)):
        flat = turned_flat(curve, rng.uniform(-0.35, 0.35))
        slack = view - np.ptp(flat, axis=0)
        if (slack < 0).any():
            continue
        found = tidy(*joined([flat]), clearance(radius) if space is None else space, np.radians(min_angle))
        if found is None or not count[0] <= len(found.first) <= count[1]:
            continue
        flat = flat + rng.uniform(-0.4, 0.4, size=2) * slack
        if studio.inside(lifted(flat, radius)):
            return np.asarray(flat)
    return None


def lay(
    rng: Generator,
    studio: Studio,
    curves: list[Floats],
    radius: float,
    occluders: tuple[Solid, ...] = (),
    color: Color | None = None,
    over: Bools | None = None,
) -> Scene | None:
    """The scene of cables that lie on the table along planar curves; None when they cannot, or would touch through.

    over : (C,) bool, crossings in the order along the curves; the strand that comes first is the upper; None: drawn.
    """
    points, strand = joined(curves)
    crossed = find_crossings(points, strand)
    upper = rng.random(len(crossed.first)) < 0.5 if over is None else over
    z = heights(points, strand, crossed, upper, radius)
    if z is None:
        return None
    axes = [resampled(np.column_stack((curve, z[strand == k]))) for k, curve in enumerate(curves)]
    if lowest_clearance(axes, radius) < 0.999 or min(least_bend(axis) for axis in axes) < 4 * radius:
        return None
    if not all(studio.inside(axis) for axis in axes):
        return None
    shade = cable_color(rng) if color is None else color
    cables = tuple(Truth(studio.to_camera(axis), radius, color=shade) for axis in axes)
    return Scene("", "", 0, studio.camera, cables, occluders, studio.table(), studio.light)
