"""Build the common families of scenes: cables on a table, crossing, partly hidden, or in the air.

Each builder draws one scene from the given random numbers, or returns None if the draw cannot be built.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from ...types import Floats
from .curves import STEP, clear_crossings, oriented_curve
from .model import Scene, Solid
from .placing import at_height, cables_on_table, concatenate_curves, min_strand_distance, planar_curve, sound_scene
from .stacking import min_clearance, spline_axis
from .studio import GRIPPER_COLORS, Studio, box, make_studio, pick

Size = tuple[int, int]
"""Width and height of the image, px."""

RADII = (0.003, 0.006)
"""Least and greatest radius of a cable, m."""

LENGTHS = (0.5, 1.2)
"""Least and greatest length of a cable, m."""


@dataclass(frozen=True)
class Lying:
    """A family of scenes of one smoothly curved cable on a table; calling it draws a scene.

    Attributes
    ----------
    crossings
        least and greatest number of crossings of the cable with itself.
    at_most
        if given, a scene has a random number of crossings from 0 to this; None uses `crossings`.
    radii, lengths, distances
        least and greatest radius of the cable, length of the cable, and distance of the camera, m.
    strand_distance, strand_radii
        least distance between two passes of the cable away from crossings: in m, and in radii.
    min_angle
        least angle at a crossing, degrees.
    """

    crossings: tuple[int, int] = (0, 0)
    at_most: int | None = None
    radii: tuple[float, float] = RADII
    lengths: tuple[float, float] = LENGTHS
    distances: tuple[float, float] = (0.55, 0.85)
    strand_distance: float | None = None
    strand_radii: float = 5.0
    min_angle: float = 32.0

    def draw(self, rng: Generator, size: Size) -> tuple[Studio, float, Floats | None]:
        """Draw the camera, the radius in m and the curve (P, 2) m on the table; None if no curve fits."""
        studio, radius, length = make_studio(rng, size, self.distances), rng.uniform(*self.radii), rng.uniform(*self.lengths)
        crossings = self.crossings if self.at_most is None else (0, int(rng.integers(self.at_most + 1)))
        distance = self.strand_radii * radius if self.strand_distance is None else self.strand_distance
        return studio, radius, planar_curve(rng, studio, radius, length, crossings, distance, self.min_angle)

    def __call__(self, rng: Generator, size: Size) -> Scene | None:
        """Draw a scene in the camera's optical frame; `size` is (width, height) px of the image."""
        studio, radius, curve = self.draw(rng, size)
        return None if curve is None else cables_on_table(rng, studio, [curve], radius)


PLAIN: dict[str, Lying] = {
    "open": Lying(),
    "crossing": Lying((1, 1)),
    "crossings": Lying((2, 4)),
    "tangle": Lying((4, 10), radii=(RADII[0], 0.0045), lengths=(0.9, LENGTHS[1]), strand_radii=3.4, min_angle=26.0),
    "far": Lying(at_most=2, radii=(0.004, RADII[1]), lengths=(0.7, LENGTHS[1]), distances=(1.1, 1.5)),
    "wire": Lying(at_most=2, radii=(0.0005, 0.00075), lengths=(0.3, 0.8), distances=(0.32, 0.5), strand_distance=0.012),
    "hose": Lying(at_most=1, radii=(0.008, 0.015), lengths=(0.6, LENGTHS[1]), distances=(0.75, 1.1), strand_radii=3.2),
}
"""Families of one cable on a table: without a crossing, with one, with two to four, with four to ten; far from the camera; a wire
of 1 to 1.5 mm near the camera; and a hose of 16 to 30 mm."""


def straight(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one nearly straight cable on a table.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    length = rng.uniform(LENGTHS[0], max(LENGTHS[0] + 0.01, 0.95 * studio.usable_size()[0]))
    along = np.arange(round(length / STEP) + 1) * STEP
    bow = rng.uniform(-0.02, 0.02) * np.sin(np.pi * along / length)
    curve = oriented_curve(np.column_stack((along, bow)), rng.uniform(-0.4, 0.4))
    return cables_on_table(rng, studio, [curve], radius)


def occluded(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable under one to three boxes.

    The boxes lie on the cable or are held above it, as grippers and hands are.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius, curve = Lying(at_most=1).draw(rng, size)
    if curve is None:
        return None
    boxes: list[Solid] = []
    centers: list[Floats] = []
    for _ in range(rng.integers(1, 4)):
        index = int(rng.uniform(0.15, 0.85) * len(curve))
        width, center = rng.uniform(0.025, 0.06), curve[index]
        to_tip = np.linalg.norm(curve[[0, -1]] - center, axis=1).min()
        to_box = min((float(np.linalg.norm(center - other)) for other in centers), default=1.0)
        if to_tip < 0.09 or to_box < 0.13:
            continue
        tangent = curve[index + 1] - curve[index]
        angle = np.arctan2(tangent[1], tangent[0]) + rng.uniform(-0.5, 0.5)
        bottom, tall = 2 * radius + (0.001 if rng.random() < 0.4 else rng.uniform(0.01, 0.06)), rng.uniform(0.012, 0.03)
        middle = np.array([*center, bottom + tall / 2])
        boxes.append(box(middle, (width, rng.uniform(0.05, 0.1), tall), angle, studio, pick(rng, GRIPPER_COLORS)))
        centers.append(center)
    return cables_on_table(rng, studio, [curve], radius, tuple(boxes)) if boxes else None


def several(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of two to four cables of one color, which may cross each other.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    curves: list[Floats] = []
    count = int(rng.integers(2, 5))
    for _ in range(25):
        curve = planar_curve(rng, studio, radius, rng.uniform(0.5, 0.8), (0, 0))
        if curve is None:
            continue
        moved = curve + rng.uniform(-0.5, 0.5, size=2) * (np.array(studio.usable_size()) - np.ptp(curve, axis=0))
        crossed = clear_crossings(*concatenate_curves([*curves, moved]), min_strand_distance(radius))
        if crossed is not None and len(crossed.first) <= 4 and studio.contains(at_height(moved, radius)):
            curves.append(moved)
        if len(curves) == count:
            return cables_on_table(rng, studio, curves, radius)
    return None


def air(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable in the air.

    The cable is a helix, a hanging curve, or a loop whose strands are far apart in height at the crossing; it touches nothing.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    shape = (_helix, _hanging, _high_loop)[rng.integers(3)](rng, studio, radius)
    if shape is None:
        return None
    axis = spline_axis(shape - (0, 0, shape[:, 2].mean()))
    table_height = axis[:, 2].min() - rng.uniform(0.05, 0.3)
    scene = sound_scene(rng, studio, [axis], radius, clearance=0)
    table = studio.table(float(table_height)) if scene is not None and rng.random() < 0.7 else None
    return None if scene is None else replace(scene, table=table)


def _helix(rng: Generator, studio: Studio, radius: float) -> Floats | None:
    coil_radius, pitch, turns = rng.uniform(0.03, 0.055), rng.uniform(0.05, 0.09), rng.uniform(1.6, 4.0)
    angle = np.linspace(0, 2 * np.pi * turns, 60 * int(turns + 1)) * rng.choice((-1, 1))
    x = pitch * np.abs(angle) / (2 * np.pi)
    points = np.column_stack((x - x.mean(), coil_radius * np.sin(angle), coil_radius * np.cos(angle)))
    yaw, roll = rng.uniform(-0.45, 0.45), rng.uniform(-0.3, 0.3)
    tilt = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    spin = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    points = points @ (spin @ tilt).T
    return points if min_clearance([spline_axis(points)], radius) > 1.9 else None


def _hanging(rng: Generator, studio: Studio, radius: float) -> Floats | None:
    half_width, sag = rng.uniform(0.17, 0.26), rng.uniform(0.08, 0.22)
    x = np.linspace(-half_width, half_width, 150)
    steepness = rng.uniform(1.2, 2.4)
    drop = sag * (np.cosh(steepness * x / half_width) - 1) / (np.cosh(steepness) - 1)
    slant = rng.uniform(0.3, 1.2)
    sway = rng.uniform(-0.02, 0.02) * np.sin(2 * np.pi * x / half_width + rng.uniform(0, 6))
    return np.column_stack((x, drop * np.cos(slant) - sag / 2 + sway, drop * np.sin(slant) + rng.uniform(-0.2, 0.2) * x))


def _high_loop(rng: Generator, studio: Studio, radius: float) -> Floats | None:
    curve = planar_curve(rng, studio, radius, rng.uniform(*LENGTHS), (1, 1))
    if curve is None:
        return None
    crossed = clear_crossings(*concatenate_curves([curve]), min_strand_distance(radius))
    if crossed is None:
        return None
    rise = max(0.15, 0.045 * len(curve) / float(crossed.second[0] - crossed.first[0]))
    return np.column_stack((curve, rise * np.linspace(-0.5, 0.5, len(curve)))) if rise < 0.25 else None
