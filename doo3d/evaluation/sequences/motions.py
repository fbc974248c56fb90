"""Draw motions of one cable: captured from real cables, dragged over a table, and knots pulled tight."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from ...errors import InputError
from ...types import Camera, Floats
from ..scenes.curves import STEP, curve_crossings, random_curves, resample_polyline
from ..scenes.families import RADII
from ..scenes.harnesses.motion import load_array
from ..scenes.model import Table
from ..scenes.placing import MIN_BEND_RADII
from ..scenes.stacking import min_bend_radius, resting_heights, spline_axis
from ..scenes.studio import FOCAL_LENGTHS_PX, MARGIN_FRACTION, TABLE_COLORS, Studio, make_studio
from ..scenes.wound_families import KNOTS, alternating, planar_knot

FRAME_RATE = 30.0
"""Frames per second of a sequence."""

CAPTURE_RATE = 100.0
"""Sampling rate of the motion capture, positions per second."""

CAPTURED_RADII = (0.003, 0.006)
"""Least and greatest radius in m for captured motions, whose files do not hold the radius."""

MIN_DISTANCE = 0.45
"""Least distance from the camera to a moving cable, m."""

VIEW_DRAWS, MIN_SEEN_LENGTH = 30, 0.7
"""Number of random cameras that are tried; fraction of a cable's apparent length that nine of ten images must show."""

MAX_MARKER_STEP = 3.0
"""Greatest distance from one marker to the next, in median distances; above it, the markers are not in order along one cable."""

MAX_ATTEMPTS = 600
"""Greatest number of attempts to draw a motion; of the first nine seeds of a dragged cable, one needs 151."""

Size = tuple[int, int]


@dataclass(frozen=True)
class Motion:
    """The motion of one cable in front of a static camera, in the camera's optical frame.

    Attributes
    ----------
    axes
        center line of the cable in each of T frames, (P, 3) m, always starting at the same tip.
    radius
        radius of the cable, m.
    camera
        the intrinsics and the image size.
    table
        the plane below the cable; None for a cable in the air.
    light
        (3,) unit vector towards the light.
    """

    axes: tuple[Floats, ...]
    radius: float
    camera: Camera
    table: Table | None
    light: tuple[float, float, float] = (0.0, 0.0, -1.0)


def captured_motion(path: Path, rng: Generator, size: Size, frames: int) -> Motion | None:
    """Return the motion of a real cable from a file of motion capture, seen by a camera at a random place.

    The cable is a cubic spline through the markers.

    Parameters
    ----------
    path
        .npy file, (T, K, 3) float, m: positions of K markers along the cable from tip to tip, 100 per second, z up.
    rng
        draws the camera, the cable's radius and the start.
    size
        (width, height) px of the image.
    frames
        number of frames, 30 per second.

    Raises
    ------
    InputError : the file is no such array, holds fewer frames, or its markers do not follow each other along one cable.
    """
    markers = load_array(path)
    last = (frames - 1) * CAPTURE_RATE / FRAME_RATE
    if markers.ndim != 3 or markers.shape[1] < 4 or markers.shape[2] != 3 or len(markers) <= last + 1:
        raise InputError(
            f"{path}: shape {markers.shape}, expected (T, K, 3) with K >= 4 markers and T > {last + 1:.0f}", code="truth-invalid"
        )
    steps = np.linalg.norm(np.diff(markers, axis=1), axis=2)
    if not (steps.max() <= MAX_MARKER_STEP * np.median(steps)):
        marker = int(np.nan_to_num(steps, nan=np.inf).max(axis=0).argmax())
        raise InputError(
            f"{path}: marker {marker + 1} is too far from marker {marker}, so these are not markers along one cable in order, "
            "or some are missing: give the positions of one unbranched cable from tip to tip",
            code="truth-invalid",
        )
    start = rng.uniform(0, len(markers) - 1 - last)
    at = start + np.arange(frames) * CAPTURE_RATE / FRAME_RATE
    low = np.minimum(at.astype(int), len(markers) - 2)
    part = (at - low)[:, None, None]
    positions = markers[low].astype(float) * (1 - part) + markers[low + 1].astype(float) * part
    radius = rng.uniform(*CAPTURED_RADII)
    camera = _camera(rng, size)
    turned = _turned_to_camera(rng, positions, camera)
    axes = tuple(spline_axis(frame) for frame in turned)
    return Motion(axes, radius, camera, None)


def _camera(rng: Generator, size: Size) -> Camera:
    focal = round(FOCAL_LENGTHS_PX.get(size[0], 0.72 * size[0]) * rng.uniform(0.985, 1.015), 2)
    return Camera(focal, focal, size[0] / 2 + rng.uniform(-6, 6), size[1] / 2 + rng.uniform(-6, 6), *size)


def _turned_to_camera(rng: Generator, positions: Floats, camera: Camera) -> Floats:
    """Transform positions (T, K, 3) m, z up, to a random camera that looks at their middle and just holds them in its image.

    Cameras that look along the cable are rejected: the result is from the first of VIEW_DRAWS cameras that is not, else from the
    best.
    """
    best, most_seen = np.zeros(0), -1.0
    for _ in range(VIEW_DRAWS):
        turn = Rotation.from_euler("zx", [rng.uniform(0, 360), -90 - rng.uniform(-5, 60)], degrees=True)
        points = turn.apply(positions.reshape(-1, 3)).reshape(positions.shape)
        steps = np.diff(points, axis=1)
        shares = np.linalg.norm(steps[..., :2], axis=2).sum(axis=1) / np.linalg.norm(steps, axis=2).sum(axis=1)
        seen = float(np.percentile(shares, 10))
        if seen > most_seen:
            best, most_seen = points, seen
        if seen >= MIN_SEEN_LENGTH:
            break
    points = best.reshape(-1, 3)
    points = points - (points.max(axis=0) + points.min(axis=0)) / 2
    room = np.array([camera.width, camera.height]) * (0.5 - MARGIN_FRACTION) - 8
    distance = (np.abs(points[:, :2]) * camera.fx / room - points[:, 2:]).max()
    distance = max(distance, MIN_DISTANCE - points[:, 2].min())
    return np.asarray(points + np.array([0.0, 0.0, distance])).reshape(positions.shape)


def dragged_motion(rng: Generator, size: Size, frames: int) -> Motion | None:
    """Draw the motion of a looped cable that is dragged over a table by one end; each point follows the one before it."""
    studio, radius = make_studio(rng, size), rng.uniform(*RADII)
    length = rng.uniform(0.6, 0.9)
    curve = random_curves(rng, 1, length, 4 * MIN_BEND_RADII * radius)[0]
    curve = curve - (curve.max(axis=0) + curve.min(axis=0)) / 2
    speed, turn = rng.uniform(0.05, 0.15), float(np.arctan2(*(curve[0] - curve[4])[::-1]))
    curvature = rng.uniform(-6, 6)
    curves = [curve]
    for _ in range(frames - 1):
        head = curves[-1][0] + speed / FRAME_RATE * np.array([np.cos(turn), np.sin(turn)])
        turn += curvature * speed / FRAME_RATE
        curves.append(followed(curves[-1], head))
    return _on_table(rng, curves, studio, radius, None)


def followed(curve: Floats, head: Floats) -> Floats:
    """Return a curve (P, 2) m after its first point was pulled to `head` (2,) m; each point follows the one before it."""
    result = curve.copy()
    result[0] = head
    for k in range(1, len(curve)):
        back = result[k] - result[k - 1]
        distance = float(np.hypot(*back))
        if distance <= STEP:
            break
        result[k] = result[k - 1] + back * (STEP / distance)
    return result


def knot_motion(rng: Generator, size: Size, frames: int) -> Motion | None:
    """Draw the motion of a loose knot on a table whose ends are pulled apart, so that it shrinks."""
    studio, radius = make_studio(rng, size, (0.6, 0.85)), rng.uniform(0.0022, 0.0032)
    knot = planar_knot(rng, studio, *KNOTS[list(KNOTS)[rng.integers(len(KNOTS))]])
    length = len(knot) * STEP * rng.uniform(1.0, 1.1)
    over = bool(rng.random() < 0.5)
    curves = []
    for scale in np.linspace(1.0, rng.uniform(0.5, 0.7), frames):
        inner = resample_polyline(knot * scale, STEP)
        arm = max(0.0, (length - len(inner) * STEP) / 2)
        reach = np.arange(1, max(1, round(arm / STEP)) + 1)[:, None] * STEP
        first, last = inner[0] - inner[4], inner[-1] - inner[-5]
        curves.append(
            np.vstack(((inner[0] + reach * first / np.hypot(*first))[::-1], inner, inner[-1] + reach * last / np.hypot(*last)))
        )
    return _on_table(rng, curves, studio, radius, over)


def _on_table(rng: Generator, curves: list[Floats], studio: Studio, radius: float, first_over: bool | None) -> Motion | None:
    """Return the motion of a cable along planar curves on a table; None if it bends too much, leaves the image or cannot rest.

    first_over : for a knot, whether the first strand is on top at the first crossing; None puts the strand that comes first along
    the cable below at every crossing.
    """
    axes = []
    for curve in curves:
        crossed = curve_crossings(curve)
        over = np.zeros(len(crossed.first), dtype=bool) if first_over is None else alternating(crossed) ^ first_over
        z = resting_heights(curve, np.zeros(len(curve), dtype=np.int64), crossed, over, radius)
        if z is None:
            return None
        axis = spline_axis(np.column_stack((curve, z)))
        if not studio.contains(axis) or min_bend_radius(axis) < MIN_BEND_RADII * radius:
            return None
        axes.append(studio.to_camera(axis))
    return Motion(tuple(axes), radius, studio.camera, studio.table(), studio.light)


def motion_files(paths: Iterable[Path]) -> list[Path]:
    """Return the files of motion capture in paths: each file as given; for a folder, its *.npy files by name.

    Raises
    ------
    InputError : there is no such file or folder, or a folder has no such file.
    """
    files: list[Path] = []
    for path in paths:
        if not path.exists():
            raise InputError(f"{path}: there is no such file or folder", code="file-missing")
        found = sorted(path.glob("*.npy")) if path.is_dir() else [path]
        if not found:
            raise InputError(f"{path}: the folder has no motion capture: expected *.npy", code="file-missing")
        files += found
    return files


OWN_MOTIONS: dict[str, Callable[[Generator, Size, int], Motion | None]] = {"dragged": dragged_motion, "knot": knot_motion}
"""Motions that are simulated, without a file: name -> function that draws one."""


def table_below(motion: Motion, rng: Generator) -> Table:
    """Return a wall 0.2 to 0.5 m behind a cable in the air."""
    farthest = max(float(axis[:, 2].max()) for axis in motion.axes)
    tilt = rng.uniform(-0.15, 0.15, 2)
    normal = np.array([*tilt, -1.0]) / np.sqrt(1 + tilt @ tilt)
    color = TABLE_COLORS[rng.integers(len(TABLE_COLORS))]
    return Table(np.array([0.0, 0.0, farthest + rng.uniform(0.2, 0.5)]), normal, color)
