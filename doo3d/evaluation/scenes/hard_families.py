"""The hard kinds of scene: look-alikes beside the cable, tangles, hairpins, cables without depth, thin and far ones."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from ...types import Floats
from .curves import STEP
from .families import LENGTHS, RADII, Size, lay, planar_curve
from .model import Color, Scene, Solid
from .studio import Studio, box, cable_color, make_studio

HAIRPIN_GAP = (0.15, 0.8)  # diameters between the surfaces of the two legs
SHINY = (0.015, 0.050)  # m of cable without depth
THIN = (2.0, 3.0)  # px across


def clutter(rng: Generator, size: Size) -> Scene | None:
    """A cable with blobs and boxes of nearly its own hue beside it."""
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    curve = planar_curve(rng, studio, radius, rng.uniform(*LENGTHS), (0, int(rng.integers(2))))
    if curve is None:
        return None
    color, tree = cable_color(rng), cKDTree(curve)
    solids: list[Solid] = []
    places: list[tuple[Floats, float]] = []
    for _ in range(60):
        half = rng.uniform(0.008, 0.022)
        place = (rng.random(2) - 0.5) * np.array(studio.view())
        gap = float(tree.query(place)[0]) - 1.5 * half - radius
        free = all(np.linalg.norm(place - other) > 1.5 * (half + size_) for other, size_ in places)
        if not 0.004 < gap < 0.05 or not free:
            continue
        places.append((place, half))
        solids.append((_blob, _block)[rng.integers(2)](rng, place, half, studio, _alike(rng, color)))
        if len(solids) == 7:
            break
    return lay(rng, studio, [curve], radius, tuple(solids), color) if len(solids) >= 3 else None


def _alike(rng: Generator, color: Color) -> Color:
    """A colour of nearly the same hue, somewhat duller or darker."""
    hue, saturation, value = cv2.cvtColor(np.array([[color]], dtype=np.uint8), cv2.COLOR_RGB2HSV)[0, 0].astype(int)
    other = ((hue + rng.integers(-6, 7)) % 180, saturation * rng.uniform(0.75, 1.0), value * rng.uniform(0.7, 1.0))
    red, green, blue = cv2.cvtColor(np.array([[other]]).astype(np.uint8), cv2.COLOR_HSV2RGB)[0, 0].tolist()
    return int(red), int(green), int(blue)


def _block(rng: Generator, place: Floats, half: float, studio: Studio, color: Color) -> Solid:
    tall = rng.uniform(0.004, 0.02)
    edges = (2 * half, rng.uniform(0.8, 2.0) * half, tall)
    return box(np.array([*place, tall / 2]), edges, rng.uniform(0, np.pi), studio, color)


def _blob(rng: Generator, place: Floats, half: float, studio: Studio, color: Color) -> Solid:
    """An ellipsoid that lies on the table."""
    rows, columns = 12, 24
    polar, around = np.meshgrid(np.linspace(0, np.pi, rows), np.arange(columns) * 2 * np.pi / columns, indexing="ij")
    ball = np.stack((np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), axis=-1)
    tall = half * rng.uniform(0.3, 0.8)
    points = ball.reshape(-1, 3) * (half, half * rng.uniform(0.6, 1.0), tall) + (*place, tall)
    a = np.arange((rows - 1) * columns)
    b = a // columns * columns + (a + 1) % columns
    triangles = np.vstack((np.column_stack((a, a + columns, b)), np.column_stack((b, a + columns, b + columns))))
    return Solid(studio.to_camera(points), triangles.astype(np.int64), color)


def tangle(rng: Generator, size: Size) -> Scene | None:
    """One cable that crosses itself four to ten times."""
    studio, radius = make_studio(rng, size), rng.uniform(RADII[0], 0.0045)
    curve = planar_curve(rng, studio, radius, rng.uniform(0.9, LENGTHS[1]), (4, 10), 3.4 * radius, 26.0)
    return None if curve is None else lay(rng, studio, [curve], radius)


def hairpin(rng: Generator, size: Size) -> Scene | None:
    """One cable that turns back and runs along itself with a gap of less than its thickness."""
    studio, radius = make_studio(rng, size, (0.55, 0.75)), rng.uniform(*RADII)
    apart = radius * (2 + 2 * rng.uniform(*HAIRPIN_GAP))
    bulb = _bulb(apart, rng.uniform(6.0, 9.0) * radius)
    leg, step = rng.uniform(0.1, 0.22), STEP
    along = np.arange(0, leg, step)
    first = np.column_stack((along, np.full(len(along), apart / 2)))
    second = np.column_stack((along[::-1], np.full(len(along), -apart / 2)))
    tails = [_flare(rng, apart / 2, rng.uniform(0.12, 0.25)), _flare(rng, apart / 2, rng.uniform(0.06, 0.25))]
    if rng.random() < 0.4:
        second = second[: int(rng.uniform(0.5, 0.9) * len(second))]  # one tip lies beside the other leg
        tails[1] = tails[1][:0]
    straight = np.vstack((tails[0][::-1], first, bulb + np.array([leg, 0.0]), second, tails[1] * (1, -1)))
    curve = _even(_bent(straight, rng.uniform(-4.0, 4.0)))
    turn = rng.uniform(-0.4, 0.4) + np.pi * rng.integers(2)
    curve = curve @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    curve = curve - (curve.max(axis=0) + curve.min(axis=0)) / 2
    return lay(rng, studio, [curve], radius)


def _bulb(apart: float, bend: float) -> Floats:
    """(P, 2) m: from (0, apart / 2) heading along x round to (0, -apart / 2), outwards first so as not to bend tighter."""
    up = apart / 2 + bend
    out = np.arccos(up / (2 * bend))
    reach = np.sqrt(4 * bend**2 - up**2)
    first = np.linspace(0, out, max(3, int(bend * out / STEP)))[1:]
    start = np.column_stack((bend * np.sin(first), up - bend * np.cos(first)))
    angle = np.linspace(np.pi / 2 + out, -np.pi / 2 - out, int(bend * (np.pi + 2 * out) / STEP))[1:-1]
    middle = np.column_stack((reach + bend * np.cos(angle), bend * np.sin(angle)))
    return np.vstack((start, middle, start[::-1] * (1, -1)))


def _flare(rng: Generator, side: float, length: float) -> Floats:
    """(P, 2) m: a tail that starts at (0, side), runs towards negative x and turns away."""
    along = np.arange(1, int(length / STEP)) * STEP
    bend = rng.uniform(0.06, 0.15)
    heading = np.minimum(along / bend, rng.uniform(0.5, 1.3))
    return np.column_stack((-np.cumsum(np.cos(heading)), np.cumsum(np.sin(heading)))) * STEP + (0.0, side)


def _bent(points: Floats, curvature: float) -> Floats:
    """The plane's x axis rolled onto a circle of this curvature in 1/m; distances across stay."""
    if abs(curvature) < 1e-3:
        return points
    angle, radius = points[:, 0] * curvature, 1 / curvature - points[:, 1]
    return np.column_stack((radius * np.sin(angle), 1 / curvature - radius * np.cos(angle)))


def _even(points: Floats) -> Floats:
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    at = np.arange(0, along[-1], STEP)
    return np.column_stack((np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])))


def shiny(rng: Generator, size: Size) -> Scene | None:
    """One cable with runs of which the sensor gives colour but no depth."""
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    curve = planar_curve(rng, studio, radius, rng.uniform(*LENGTHS), (0, int(rng.integers(2))))
    scene = None if curve is None else lay(rng, studio, [curve], radius)
    if scene is None:
        return None
    cable, spans = scene.cables[0], list[tuple[float, float]]()
    for start in np.sort(rng.uniform(0.06, cable.length - 0.12, size=int(rng.integers(1, 4)))):
        if not spans or start > spans[-1][1] + 0.05:
            spans.append((float(start), float(start + rng.uniform(*SHINY))))
    return replace(scene, cables=(replace(cable, shiny=tuple(spans)),))


def thin(rng: Generator, size: Size) -> Scene | None:
    """One cable of two to three pixels."""
    studio = make_studio(rng, size)
    radius = rng.uniform(*THIN) * studio.distance / studio.camera.fx / 2
    curve = planar_curve(rng, studio, radius, rng.uniform(*LENGTHS), (0, int(rng.integers(2))), 0.015)
    return None if curve is None else lay(rng, studio, [curve], radius)


def far(rng: Generator, size: Size) -> Scene | None:
    """One cable at 1.1 to 1.5 m."""
    studio, radius = make_studio(rng, size, (1.1, 1.5)), rng.uniform(0.004, RADII[1])
    curve = planar_curve(rng, studio, radius, rng.uniform(0.7, LENGTHS[1]), (0, int(rng.integers(3))))
    return None if curve is None else lay(rng, studio, [curve], radius)
