"""Build the hard families of scenes: clutter of the cable's hue, hairpins, cables without depth, thin cables."""

from dataclasses import replace

import cv2
import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from ...types import Floats
from .curves import STEP, resample_polyline, turned_curve
from .families import LENGTHS, RADII, Lying, Size
from .model import Color, Scene, Solid
from .placing import cables_on_table, planar_curve
from .studio import Studio, box, cable_color, make_studio

HAIRPIN_GAP_DIAMETERS = (0.15, 0.8)
"""Least and greatest gap between the surfaces of the two legs of a hairpin, in diameters of the cable."""

SHINY_LENGTHS = (0.015, 0.050)
"""Least and greatest length in m of a stretch of cable without depth."""

THIN_WIDTHS_PX = (2.0, 3.0)
"""Least and greatest width of a thin cable in the image, px."""

MAX_SOLIDS = 7
"""Greatest number of solids beside a cable."""


def clutter(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a cable with blobs and boxes of nearly its own hue beside it.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius, curve = Lying(at_most=1).draw(rng, size)
    if curve is None:
        return None
    color, tree = cable_color(rng), cKDTree(curve)
    solids: list[Solid] = []
    footprints: list[tuple[Floats, float]] = []
    for _ in range(60):
        half_width = rng.uniform(0.008, 0.022)
        center = (rng.random(2) - 0.5) * np.array(studio.usable_size())
        gap = float(tree.query(center)[0]) - 1.5 * half_width - radius
        free = all(np.linalg.norm(center - other) > 1.5 * (half_width + other_half) for other, other_half in footprints)
        if not 0.004 < gap < 0.05 or not free:
            continue
        footprints.append((center, half_width))
        solids.append((_blob, _block)[rng.integers(2)](rng, center, half_width, studio, _similar_color(rng, color)))
        if len(solids) == MAX_SOLIDS:
            break
    return cables_on_table(rng, studio, [curve], radius, tuple(solids), color) if len(solids) >= 3 else None


def _similar_color(rng: Generator, color: Color) -> Color:
    """Return a color of nearly the same hue, somewhat duller or darker."""
    hue, saturation, value = cv2.cvtColor(np.array([[color]], dtype=np.uint8), cv2.COLOR_RGB2HSV)[0, 0].astype(int)
    other = ((hue + rng.integers(-6, 7)) % 180, saturation * rng.uniform(0.75, 1.0), value * rng.uniform(0.7, 1.0))
    red, green, blue = cv2.cvtColor(np.array([[other]]).astype(np.uint8), cv2.COLOR_HSV2RGB)[0, 0].tolist()
    return int(red), int(green), int(blue)


def _block(rng: Generator, center: Floats, half_width: float, studio: Studio, color: Color) -> Solid:
    tall = rng.uniform(0.004, 0.02)
    edges = (2 * half_width, rng.uniform(0.8, 2.0) * half_width, tall)
    return box(np.array([*center, tall / 2]), edges, rng.uniform(0, np.pi), studio, color)


def _blob(rng: Generator, center: Floats, half_width: float, studio: Studio, color: Color) -> Solid:
    """Return an ellipsoid that lies on the table."""
    rows, columns = 12, 24
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, rows), np.arange(columns) * 2 * np.pi / columns, indexing="ij")
    ball = np.stack((np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)), axis=-1)
    tall = half_width * rng.uniform(0.3, 0.8)
    points = ball.reshape(-1, 3) * (half_width, half_width * rng.uniform(0.6, 1.0), tall) + (*center, tall)
    a = np.arange((rows - 1) * columns)
    b = a // columns * columns + (a + 1) % columns
    triangles = np.vstack((np.column_stack((a, a + columns, b)), np.column_stack((b, a + columns, b + columns))))
    return Solid(studio.to_camera(points), triangles.astype(np.int64), color)


def hairpin(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable that turns back and runs along itself.

    The gap between the two legs is less than the cable's thickness.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius = make_studio(rng, size, (0.55, 0.75)), rng.uniform(*RADII)
    leg_distance = radius * (2 + 2 * rng.uniform(*HAIRPIN_GAP_DIAMETERS))
    bulb = _bulb(leg_distance, rng.uniform(6.0, 9.0) * radius)
    leg, step = rng.uniform(0.1, 0.22), STEP
    along = np.arange(0, leg, step)
    first = np.column_stack((along, np.full(len(along), leg_distance / 2)))
    second = np.column_stack((along[::-1], np.full(len(along), -leg_distance / 2)))
    tails = [_tail(rng, leg_distance / 2, rng.uniform(low, 0.25)) for low in (0.12, 0.06)]
    if rng.random() < 0.4:
        second = second[: int(rng.uniform(0.5, 0.9) * len(second))]  # one tip lies beside the other leg
        tails[1] = tails[1][:0]
    straight = np.vstack((tails[0][::-1], first, bulb + np.array([leg, 0.0]), second, tails[1] * (1, -1)))
    curve = resample_polyline(_bent(straight, rng.uniform(-4.0, 4.0)), STEP)
    angle = rng.uniform(-0.4, 0.4) + np.pi * rng.integers(2)
    return cables_on_table(rng, studio, [turned_curve(curve, angle)], radius)


def _bulb(leg_distance: float, bend_radius: float) -> Floats:
    """Return the turn of a hairpin, (P, 2) m, from (0, d / 2) along x and back to (0, -d / 2), d being the leg distance.

    The curve bends outwards first, so that its bend radius is nowhere less than `bend_radius` (m).
    """
    center_y = leg_distance / 2 + bend_radius
    outward = np.arccos(center_y / (2 * bend_radius))
    center_x = np.sqrt(4 * bend_radius**2 - center_y**2)
    first = np.linspace(0, outward, max(3, int(bend_radius * outward / STEP)))[1:]
    start = np.column_stack((bend_radius * np.sin(first), center_y - bend_radius * np.cos(first)))
    angle = np.linspace(np.pi / 2 + outward, -np.pi / 2 - outward, int(bend_radius * (np.pi + 2 * outward) / STEP))[1:-1]
    middle = np.column_stack((center_x + bend_radius * np.cos(angle), bend_radius * np.sin(angle)))
    return np.vstack((start, middle, start[::-1] * (1, -1)))


def _tail(rng: Generator, y: float, length: float) -> Floats:
    """Return a tail that starts at (0, y), runs towards negative x and turns away: (P, 2) m."""
    along = np.arange(1, int(length / STEP)) * STEP
    bend_radius = rng.uniform(0.06, 0.15)
    angle = np.minimum(along / bend_radius, rng.uniform(0.5, 1.3))
    return np.column_stack((-np.cumsum(np.cos(angle)), np.cumsum(np.sin(angle)))) * STEP + (0.0, y)


def _bent(points: Floats, curvature: float) -> Floats:
    """Bend points (P, 2) m so that the x axis becomes a circle of a given curvature (1/m); distances from it are kept."""
    if abs(curvature) < 1e-3:
        return points
    angle, radius = points[:, 0] * curvature, 1 / curvature - points[:, 1]
    return np.column_stack((radius * np.sin(angle), 1 / curvature - radius * np.cos(angle)))


def shiny(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable with stretches where the sensor gives color but no depth.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio, radius, curve = Lying(at_most=1).draw(rng, size)
    scene = None if curve is None else cables_on_table(rng, studio, [curve], radius)
    if scene is None:
        return None
    cable, spans = scene.cables[0], list[tuple[float, float]]()
    for start in np.sort(rng.uniform(0.06, cable.length - 0.12, size=int(rng.integers(1, 4)))):
        if not spans or start > spans[-1][1] + 0.05:
            spans.append((float(start), float(start + rng.uniform(*SHINY_LENGTHS))))
    return replace(scene, cables=(replace(cable, shiny=tuple(spans)),))


def thin(rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one cable that is two to three pixels wide in the image.

    The scene is in the camera's optical frame. The result is None if the draw from `rng` cannot be built, for example because a
    cable leaves the image; then call again with the same `rng`. `size` is (width, height) px of the image.
    """
    studio = make_studio(rng, size)
    radius = rng.uniform(*THIN_WIDTHS_PX) * studio.distance / studio.camera.fx / 2
    curve = planar_curve(rng, studio, radius, rng.uniform(*LENGTHS), (0, int(rng.integers(2))), 0.015)
    return None if curve is None else cables_on_table(rng, studio, [curve], radius)
