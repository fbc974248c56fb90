"""Build scenes of handled cables: gripped, hanging from a hook, leaving the view, with plugs, touching each other.

Each builder draws one scene in the camera's optical frame, or returns None if the draw cannot be built.
"""

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from ...types import Floats
from .curves import STEP, headed_curve, random_curves
from .families import RADII, Lying, Size
from .model import Scene, Solid, Stripe, Table, Truth, corners, cuboid
from .placing import MIN_BEND_RADII, at_height, cables_on_table, is_sound, planar_curve, sound_scene
from .stacking import min_bend_radius, min_clearance, spline_axis
from .studio import CABLE_COLORS, GRIPPER_COLORS, MARGIN_FRACTION, Studio, box, cable_color, make_studio, pick

HOOK_DEPTHS, END_DEPTHS = (0.40, 0.55), (0.9, 1.5)
"""Distance in m from the camera to the hook, and to the ends of the cable that hangs from it."""

MIN_SINE = 0.25
"""Least sine of the angle between a hanging cable and the line of sight; below it, the cable would be seen end on."""

TOUCH_GAP_RADII = (0.02, 0.6)
"""Gap, in radii, between the tip of a cable and the side of the cable that it touches or nearly touches."""

MIN_TOUCH_ANGLE = np.radians(50.0)
"""Least angle in radians between a tip and the cable that it touches."""


def gripper(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable that one or two grippers hold, each with two fingers beside it and a palm above.

    The cable lies on the table or is lifted. The result is None if the draw from `rng` cannot be built; then call again with the
    same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius, curve = Lying().draw(rng, size)
    if curve is None:
        return None
    along, z = np.arange(len(curve)) * STEP, np.full(len(curve), radius)
    centers = rng.uniform(0.15, 0.85, int(rng.integers(1, 3))) * along[-1]
    if len(centers) == 2 and abs(centers[0] - centers[1]) < 0.15:
        return None
    for center in centers:
        lift = rng.uniform(0, 0.08)
        z = np.maximum(z, radius + lift * np.exp(-(((along - center) / rng.uniform(0.06, 0.12)) ** 2)))
    axis = spline_axis(np.column_stack((curve, z)))
    if not is_sound(studio, [axis], radius, 0):
        return None
    solids: list[Solid] = []
    for center in centers:
        k = min(int(center / STEP), len(curve) - 2)
        solids += _gripper(rng, studio, np.array([*curve[k], z[k]]), curve[k + 1] - curve[k], radius)
    return sound_scene(rng, studio, [axis], radius, 1, tuple(solids), 0)


def _gripper(rng: Generator, studio: Studio, middle: Floats, tangent: Floats, radius: float) -> list[Solid]:
    """Return two fingers beside a cable at a point (3,) and a palm above it."""
    angle = float(np.arctan2(tangent[1], tangent[0]) + rng.uniform(-0.3, 0.3))
    across = np.array([-np.sin(angle), np.cos(angle), 0.0])
    width, thick, tall = rng.uniform(0.010, 0.022), rng.uniform(0.007, 0.014), rng.uniform(0.030, 0.060)
    opening = 2 * radius * rng.uniform(1.15, 2.5)
    color = pick(rng, GRIPPER_COLORS)
    bottom = max(float(middle[2]) - radius, 0.0)
    up = np.array([0.0, 0.0, bottom - float(middle[2]) + tall / 2])
    fingers = [
        box(middle + side * across * (opening + thick) / 2 + up, (width, thick, tall), angle, studio, color) for side in (-1, 1)
    ]
    palm = (rng.uniform(0.020, 0.035), opening + 2 * thick + rng.uniform(0.01, 0.04), 0.025)
    return [*fingers, box(middle + 2 * up + np.array([0, 0, 0.0125]), palm, angle, studio, color)]


def hook(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable that hangs over a hook; its ends are 0.9 to 1.5 m from the camera, the hook 0.4 to 0.55 m.

    The camera looks along the cable from above. The result is None if the draw from `rng` cannot be built; then call again with
    the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    camera, bend = studio.camera, rng.uniform(0.02, 0.04)
    top = np.array([*rng.uniform(-0.08, 0.08, 2), rng.uniform(*HOOK_DEPTHS)])
    turn = rng.uniform(0, 2 * np.pi)
    across = np.array([np.cos(turn), np.sin(turn), 0.0])
    sides = []
    for side in (-1, 1):
        depth = rng.uniform(*END_DEPTHS)
        reach = np.array([camera.width / camera.fx, camera.height / camera.fy]) * depth / 2 * (1 - 3 * MARGIN_FRACTION)
        end = np.array([*(rng.uniform(0.3, 1.0, 2) * reach * np.sign(side * across[:2] + 1e-9)), depth])
        start = top + side * bend * across + (0, 0, 0.6 * bend)
        t = np.array([0.25, 0.5, 0.75, 1.0])[:, None]
        slack = np.sin(np.pi * t) * rng.uniform(-0.03, 0.03, 3) * (1, 1, 0.5)
        sides.append(np.vstack((start, start + t**1.2 * (end - start) + slack)))
    axis = spline_axis(np.vstack((sides[0][::-1], top, sides[1])))
    pixels = camera.project(axis) / (camera.width, camera.height)
    looks = np.linalg.norm(np.diff(axis[::40, :2] / axis[::40, 2:], axis=0), axis=1) * axis[:-40:40, 2]
    if looks.min() < MIN_SINE * np.linalg.norm(axis[40] - axis[0]):
        return None
    inside = ((pixels > MARGIN_FRACTION) & (pixels < 1 - MARGIN_FRACTION)).all() and axis[:, 2].min() > 0.9 * HOOK_DEPTHS[0]
    if not inside or min_bend_radius(axis) < MIN_BEND_RADII * radius or min_clearance([axis], radius) < 1.5:
        return None
    thick = rng.uniform(0.006, 0.014)
    bar = corners((thick, rng.uniform(0.06, 0.12), thick))
    cosine, sine = across[:2]
    bar = bar @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]) + top + (0, 0, radius + thick / 2)
    solid = cuboid(bar, pick(rng, GRIPPER_COLORS))
    tilt = rng.uniform(-0.15, 0.15, 2)
    normal = np.array([*tilt, -1.0]) / np.sqrt(1 + tilt @ tilt)
    table = Table(np.array([0.0, 0.0, rng.uniform(1.7, 2.0)]), normal, studio.table().color)
    return studio.scene((Truth(axis, radius, color=cable_color(rng)),), (solid,), table)


def leaving(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable on the table that leaves the image at a border and comes back beside it.

    The scene includes the part outside the image; only the pieces inside are scored. The result is None if the draw from `rng`
    cannot be built; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    half = np.array(studio.usable_size()) / 2
    axis_of, sign = int(rng.integers(2)), rng.choice((-1.0, 1.0))
    edge, span = half[axis_of] / (1 - 2 * MARGIN_FRACTION), half[1 - axis_of]
    beyond, apart = rng.uniform(0.03, 0.09), rng.uniform(0.12, 0.9) * span
    middle = rng.uniform(-0.8, 0.8) * (span - apart / 2)
    depths = rng.uniform(-0.6, 0.2, 2) * edge
    inner = (depths + edge) / 2 + rng.uniform(-0.02, 0.02, 2)
    outward = [depths[0], inner[0], edge + 0.6 * beyond, edge + beyond, edge + 0.6 * beyond, inner[1], depths[1]]
    fan = rng.uniform(0.0, 0.08, 4)
    left, right = -apart / 2 - fan[0], apart / 2 + fan[2:]
    lateral = [left - fan[1], left, -apart / 2.6, 0, apart / 2.6, *right]
    points = np.zeros((7, 3))
    points[:, axis_of], points[:, 1 - axis_of], points[:, 2] = sign * np.array(outward), middle + np.array(lateral), radius
    axis = spline_axis(points)
    pixels = studio.camera.project(studio.to_camera(axis)) / (studio.camera.width, studio.camera.height)
    inside = ((pixels > 0) & (pixels < 1)).all(axis=1)
    tips = ((pixels[[0, -1]] > MARGIN_FRACTION) & (pixels[[0, -1]] < 1 - MARGIN_FRACTION)).all()
    if not tips or np.count_nonzero(np.diff(inside.astype(int))) != 2:
        return None
    if min_bend_radius(axis) < MIN_BEND_RADII * radius or min_clearance([axis], radius) < 1.2:
        return None
    return studio.scene((Truth(studio.to_camera(axis), radius, color=cable_color(rng)),))


def plugs(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable with a plug at one end or at both; a plug is not part of the cable and may have its color.

    The result is None if the draw from `rng` cannot be built; then call again with the same `rng`. `size` is (width, height) px
    of the image.
    """
    studio, radius, curve = Lying(at_most=1).draw(rng, size)
    if curve is None:
        return None
    color = cable_color(rng)
    solids = []
    for tip, before in ((0, 4), (-1, -5))[: int(rng.integers(1, 3))]:
        direction = curve[tip] - curve[before]
        direction = direction / np.linalg.norm(direction)
        long, wide, tall = rng.uniform(0.02, 0.045), radius * rng.uniform(2.4, 5.0), radius * rng.uniform(2.2, 4.0)
        middle = np.array([*(curve[tip] + direction * (long / 2 - 0.5 * radius)), tall / 2])
        shade = color if rng.random() < 0.4 else pick(rng, GRIPPER_COLORS)
        solids.append(box(middle, (long, wide, tall), float(np.arctan2(direction[1], direction[0])), studio, shade))
        if not studio.contains(at_height((middle[:2] + direction * long)[None], tall)):
            return None
    return cables_on_table(rng, studio, [curve], radius, tuple(solids), color)


def touch(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a cable whose side is touched by the tips of one or two others.

    The result is None if the draw from `rng` cannot be built; then call again with the same `rng`. `size` is (width, height) px
    of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    main = planar_curve(rng, studio, radius, rng.uniform(0.45, 0.9), (0, 0))
    if main is None:
        return None
    curves = [main]
    for _ in range(int(rng.integers(1, 3))):
        k = int(rng.uniform(0.2, 0.8) * len(main))
        tangent = main[k + 1] - main[k]
        side = rng.choice((-1.0, 1.0))
        normal = side * np.array([-tangent[1], tangent[0]]) / np.linalg.norm(tangent)
        start = main[k] + normal * radius * (2 + rng.uniform(*TOUCH_GAP_RADII))
        angle = np.arctan2(normal[1], normal[0]) + rng.uniform(-1, 1) * (np.pi / 2 - MIN_TOUCH_ANGLE)
        branch = random_curves(rng, 1, rng.uniform(0.15, 0.4), max(10 * radius, 0.06))[0]
        curves.append(headed_curve(branch, angle, 3) + start)
    axes = [spline_axis(at_height(curve, radius)) for curve in curves]
    return sound_scene(rng, studio, axes, radius)


def striped(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one rope with stripes of a second color around it, that crosses itself at most twice.

    The result is None if the draw from `rng` cannot be built; then call again with the same `rng`. `size` is (width, height) px
    of the image.
    """
    scene = Lying(at_most=2)(rng, size)
    if scene is None:
        return None
    cable = scene.cables[0]
    color = (236, 234, 228) if rng.random() < 0.5 else pick(rng, CABLE_COLORS)
    stripe = Stripe(color, float(rng.uniform(0.008, 0.05)), float(rng.uniform(0.2, 0.6)), int(rng.integers(-1, 3)))
    return replace(scene, cables=(replace(cable, stripe=stripe),))
