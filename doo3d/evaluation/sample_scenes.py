"""Build hand-made scenes for the samples: a cable that is dragged while a hand passes, and a hose with a T-piece."""

import numpy as np
from scipy.spatial.transform import Rotation

from ..types import Camera, Floats
from .scenes.curves import STEP, curve_crossings
from .scenes.hand import make_hand
from .scenes.harnesses.heights import lay
from .scenes.harnesses.kinds import Kind
from .scenes.harnesses.plan import strand_on_table
from .scenes.model import Scene, Solid, Tree, Truth
from .scenes.stacking import resting_heights, spline_axis
from .scenes.studio import Studio, box
from .sequences.motions import followed

LIGHT = (-0.38, -0.30, -0.875)
"""Unit vector towards the light, in the camera's optical frame."""

HAND_FRAMES = 20
"""Number of frames of the dragged cable: two thirds of a second at 30 per second."""

DRAG_STEP, DRAG_TURN = 0.009, -0.035
"""Motion of the dragged end from frame to frame: m, and radians."""

DRAGGED_RADIUS, HOSE_RADIUS, CABLE_RADIUS = 0.0045, 0.0060, 0.0040
"""Radii of the dragged cable, of the hose, and of the cable that crosses the hose, m."""

DRAGGED = ((-0.15, 0.10), (-0.08, 0.115), (0.02, 0.05), (0.10, -0.04), (0.19, -0.07), (0.255, 0.0), (0.19, 0.085), (0.10, 0.05),
           (0.05, -0.04), (-0.04, -0.105), (-0.15, -0.10), (-0.26, -0.06))  # fmt: skip
"""Points (x, y) of the dragged cable on the table in the first frame, m, starting at the dragged end."""

HAND_FROM, HAND_TO, HAND_HEIGHT, HAND_REACH = (0.30, -0.30), (-0.04, -0.26), 0.075, 0.26
"""Passing hand, in m: middle of the palm in the first and the last frame, its height, and its greatest reach into the image."""

HOSE = ((-0.36, 0.03), (-0.22, 0.075), (-0.08, 0.05), (0.05, 0.015), (0.18, 0.03), (0.35, 0.09))
BRANCH = ((-0.08, 0.05), (-0.10, -0.03), (-0.07, -0.11), (0.0, -0.17))
CABLE = ((0.04, 0.19), (0.13, 0.12), (0.16, 0.03), (0.19, -0.07), (0.30, -0.13))
"""Points (x, y) in m of the hose, of the branch that leaves it at its third point, and of the cable that crosses it."""

YELLOW, GREEN, GRIPPER = (236, 196, 30), (40, 150, 62), (48, 49, 52)


def _studio(width: int, height: int, focal: float, distance: float, color: tuple[int, int, int]) -> Studio:
    """Return a slightly tilted camera above a table."""
    rotation = Rotation.from_euler("x", 8.0, degrees=True).as_matrix() @ np.diag([1.0, -1.0, -1.0])
    return Studio(Camera(focal, focal, width / 2, height / 2, width, height), rotation, distance, LIGHT, color)


def hand_scenes() -> list[Scene]:
    """Return the scenes of a looped cable that a gripper drags over a table while a hand passes above it."""
    studio = _studio(640, 360, 460.0, 0.58, (150, 152, 154))
    curve = spline_axis(np.array(DRAGGED), STEP)
    ahead = curve[0] - curve[4]
    heading, scenes = float(np.arctan2(ahead[1], ahead[0])), []
    for k in range(HAND_FRAMES):
        strand = np.zeros(len(curve), dtype=np.int64)
        crossings = curve_crossings(curve, strand)
        heights = resting_heights(curve, strand, crossings, np.zeros(len(crossings.first), dtype=bool), DRAGGED_RADIUS)
        assert heights is not None
        axis = studio.to_camera(spline_axis(np.column_stack((curve, heights))))
        solids = (*_gripper(studio, curve[0], heading), *_passing_hand(studio, k / (HAND_FRAMES - 1)))
        cable = Truth(axis, DRAGGED_RADIUS, color=YELLOW)
        scenes.append(Scene(f"{k:06d}", "hand", 0, studio.camera, (cable,), solids, studio.table(), LIGHT))
        heading += DRAG_TURN
        curve = followed(curve, curve[0] + DRAG_STEP * np.array([np.cos(heading), np.sin(heading)]))
    return scenes


def _gripper(studio: Studio, tip: Floats, heading: float) -> tuple[Solid, ...]:
    """Return a gripper at a cable's tip (2,) m: a jaw on each side, and the robot's hand and arm ahead of it."""
    ahead, aside = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    parts = [(0.005, side * (DRAGGED_RADIUS + 0.0045), (0.036, 0.008, 0.018)) for side in (-1, 1)]
    parts += [(0.045, 0.0, (0.045, 0.060, 0.030)), (0.30, 0.0, (0.48, 0.044, 0.044))]
    return tuple(
        box(np.array([*(tip + along * ahead + across * aside), 0.003 + size[2] / 2]), size, heading, studio, GRIPPER)
        for along, across, size in parts
    )


def _passing_hand(studio: Studio, time: float) -> tuple[Solid, ...]:
    """Return the hand at a time from 0 to 1; it enters from the lower edge, passes over the loop and leaves."""
    x, y = (1 - time) * np.array(HAND_FROM) + time * np.array(HAND_TO)
    return make_hand(studio, (x, y + HAND_REACH * np.sin(np.pi * time), HAND_HEIGHT), np.radians(18.0 - 30.0 * time))


def t_piece_scene() -> Scene:
    """Return the scene of a hose with a T-piece on a table, and of a cable of the same color that crosses it."""
    studio = _studio(1280, 720, 920.0, 0.72, (205, 204, 200))
    hose, at = spline_axis(np.array(HOSE), STEP), HOSE[2]
    middle = int(np.linalg.norm(hose - at, axis=1).argmin())
    branch, cable = spline_axis(np.array((hose[middle], *BRANCH[1:])), STEP), spline_axis(np.array(CABLE), STEP)
    strands = [
        strand_on_table(hose[: middle + 1], HOSE_RADIUS, (0, 1), HOSE_RADIUS, trunk=True),
        strand_on_table(hose[middle:], HOSE_RADIUS, (1, 2), HOSE_RADIUS, trunk=True),
        strand_on_table(branch, HOSE_RADIUS, (1, 3), HOSE_RADIUS),
        strand_on_table(cable, CABLE_RADIUS, (4, 5), CABLE_RADIUS),
    ]
    lay(np.random.default_rng(0), strands, HOSE_RADIUS, Kind())
    axes = [studio.to_camera(spline_axis(np.column_stack((strand.curve, strand.height)))) for strand in strands]
    cables = tuple(Truth(axis, strand.radius, color=GREEN) for axis, strand in zip(axes, strands, strict=True))
    tips = np.array([axes[0][0], axes[0][-1], axes[1][-1], axes[2][-1]])
    trees = (Tree(tips, ((0, 0, 1), (1, 1, 2), (2, 1, 3))), Tree(axes[3][[0, -1]], ((3, 0, 1),)))
    return Scene("000000", "t_piece", 0, studio.camera, cables, (), studio.table(), LIGHT, trees=trees)
