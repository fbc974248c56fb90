"""Tough families of cables in the air: hung on a peg, held by a gripper, and thin ones."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from scipy.ndimage import gaussian_filter1d

from ....types import Floats
from ..curves import STEP
from ..families import Size, planar_curve, sound_scene
from ..model import Scene, Solid, cuboid_triangles
from ..stacking import spline_axis
from ..studio import GRIPPER_COLORS, make_studio, pick

LIFTS = (0.045, 0.11)
"""m to which a gripper lifts a cable."""

HOOK_DEPTHS, NEAR_DEPTHS = (1.32, 1.42), (0.41, 0.48)
"""m from the camera to the peg and to the near end of the cable that hangs on it."""

BEND_SIGMA = 50
"""Points of an axis over which a hung cable is smoothed: its stiffness."""


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
        corners = ((np.array(list(np.ndindex(2, 2, 2))) - 0.5) * edges + place) @ frame + points[held]
        if inside.all(axis=1).any() or corners[:, 2].min() < 0:
            return None
        solids.append(Solid(studio.to_camera(corners), cuboid_triangles(), color))
    return sound_scene(rng, studio, [axis], np.array([radius]), 1, tuple(solids))


def _gripper_frame(rng: Generator, along: Floats) -> Floats:
    """Draw the axes (3, 3) of a gripper that holds a cable along (3,): across its fingers, back from the tips, between them."""
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
    corners = (np.array(list(np.ndindex(2, 2, 2))) - (0.5, 0.5, 0)) * (0.01, 0.01, 1.7 - depth)
    under = np.array([0, radius + 0.006, -0.01])
    peg = Solid(top + under + corners, cuboid_triangles(), GRIPPER_COLORS[0])
    world = (axis - (0, 0, studio.distance)) @ studio.rotation
    return sound_scene(rng, studio, [world], np.array([radius]), 1, (peg,))
