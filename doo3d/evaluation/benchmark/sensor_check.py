"""Compare the depth errors along a thin cable: simulated stereo sensor against real frames of a rope.

    python -m doo3d.evaluation.benchmark.sensor_check [FOLDER]

FOLDER holds real frames, `*_depth.png` (uint16, 0 outside the rope) and `camera.json` (intrinsics and depth_scale).
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ...geometry.polyline import densify
from ...pipeline import detect
from ...types import Bools, Camera, Floats, Frame
from ..metrics.record import Record, number
from ..rendering.renderer import Rendered, render
from ..scenes.model import Scene, Table, Truth, corners, cuboid
from ..scenes.stacking import AXIS_SPACING, spline_axis
from .run import print_lines
from .tables import format_table

ROPE_RADIUS, ROPE_DEPTH = 0.0029, 0.47
"""Radius of the simulated cable and its distance from the camera, m."""

ROPE_ALBEDO_COLOR = (40, 90, 190)
"""8-bit RGB of the cable."""

SLICE, WINDOW, STEP_HEIGHT = 0.002, 0.040, 0.060
"""Lengths in m: a slice of the cable; the window in which ripple is measured; height of the raised cable above the table."""

MIDDLE, EDGE = (0.0, 0.3), (0.75, 0.95)
"""Ranges of the offset from the axis, in radii, that count as the middle and as the edge of a cable."""

MIN_PIXELS = 4
"""Least number of readings in a slice for its spread to be measured."""

CHECKED_SEEDS = 2
"""Number of frames measured for each direction of the cable."""

OUTLIER = 0.015
"""Distance in m from the axis beyond which a reading belongs to the background and not to the cable."""


COLUMNS = (
    number(("", "spread"), 8, "spread", 2, np.mean),
    number(("", "edge-mid"), 8, "edge_minus_middle", 2, np.mean),
    number(("", "ripple"), 8, "ripple", 2, np.mean),
    number(("", "holes"), 8, "hole_fraction", 2, np.mean),
    number(("", "per m"), 8, "holes_per_metre", 2, np.mean),
    number(("", "longest"), 8, "longest_hole", 2, np.mean),
)
"""The columns of the table; see `measure_cable`."""


def measure_cable(depth: Floats, camera: Camera, axis: Floats, radius: float) -> Record:
    """Measure the noise, shape and holes of the depth along a cable.

    Parameters
    ----------
    depth
        (H, W) m, 0 where there is no reading and outside the cable's mask.
    camera
        the intrinsics.
    axis
        (P, 3) m, the center line in the camera's optical frame; its depth need not be exact.
    radius
        m.

    Returns
    -------
    Record
        spread: standard deviation of the depth within a slice of 2 mm, mm. edge_minus_middle: mean depth at the edges minus that
        in the middle, mm; 1.4 for a cylinder of radius 2.9 mm. ripple: RMS deviation of the middle's depth from a parabola over
        40 mm of cable, mm. hole_fraction: fraction of the axis without a reading within half a radius. holes_per_metre: number of
        such runs of 3 mm or more per metre. longest_hole: mm. The first three are medians over slices or windows.
    """
    line = densify(axis, AXIS_SPACING)
    arcs = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))))
    v, u = np.nonzero(depth > 0)
    z, (_, nearest) = depth[v, u], cKDTree(camera.project(line)).query(np.column_stack((u, v)))
    offset = np.linalg.norm(np.column_stack((u, v)) - camera.project(line)[nearest], axis=1) * z / camera.fx / radius
    on = (np.abs(z - line[nearest, 2]) < OUTLIER) & (offset < 1.3)
    z, arc, offset = z[on], arcs[nearest[on]], offset[on]
    slices = (arc / SLICE).astype(int)
    count = int(arcs[-1] / SLICE) + 1
    middles, spreads, edges = np.full(count, np.nan), [], []
    for k in range(count):
        here = np.flatnonzero(slices == k)
        middle, edge = (here[(offset[here] >= a) & (offset[here] < b)] for a, b in (MIDDLE, EDGE))
        if len(middle):
            middles[k] = np.median(z[middle])
        if len(here) >= MIN_PIXELS:
            spreads.append(z[here].std())
        if len(middle) and len(edge):
            edges.append(z[edge].mean() - z[middle].mean())
    holes = _hole_runs(arc[offset < 0.5], float(arcs[-1]))
    return Record(
        spread=1e3 * _median(spreads),
        edge_minus_middle=1e3 * float(np.mean(edges)) if edges else float("nan"),
        ripple=1e3 * _median(_ripples(middles)),
        hole_fraction=float(holes.sum() / arcs[-1]),
        holes_per_metre=float((holes >= 0.003).sum() / arcs[-1]),
        longest_hole=1e3 * float(holes.max(initial=0.0)),
    )


def _hole_runs(arc: Floats, length: float) -> Floats:
    """Return the lengths in m of the runs of an axis without a reading; runs up to 1 mm are gaps between pixels, and left out."""
    gaps = np.diff(np.sort(np.concatenate(([0.0], arc, [length]))))
    return np.asarray(gaps[gaps > 0.0012])


def _ripples(middles: Floats) -> list[float]:
    """Return the RMS deviation in m from a parabola for each window of slices, half overlapping; NaN is ignored."""
    size, result = round(WINDOW / SLICE), []
    for start in range(0, len(middles) - size + 1, size // 2):
        part = middles[start : start + size]
        ok = np.isfinite(part)
        if ok.sum() > 0.7 * size:
            x = np.flatnonzero(ok)
            result.append(float(np.std(part[ok] - np.polyval(np.polyfit(x, part[ok], 2), x))))
    return result


def _median(values: list[float]) -> float:
    return float(np.median(values)) if values else float("nan")


def cable_scene(seed: int, height: float = 0.0, angle: float = 30.0, size: tuple[int, int] = (1280, 720)) -> Scene:
    """Return a scene of one straight cable of radius 2.9 mm at 0.47 m from the camera, above a table that faces the camera.

    Parameters
    ----------
    seed
        seed of texture, pattern and noise.
    height
        distance from the table to the lowest point of the cable, m.
    angle
        angle between the cable and the image's x axis, degrees.
    size
        (width, height) px of the image.
    """
    scale = size[0] / 1280
    camera = Camera(918.0 * scale, 918.0 * scale, size[0] / 2, size[1] / 2, *size)
    points = np.column_stack((np.linspace(-0.16, 0.16, 81), np.zeros(81), np.zeros(81)))
    axis = spline_axis(Rotation.from_euler("z", angle, degrees=True).apply(points)) + np.array([0.0, 0.0, ROPE_DEPTH])
    table = Table(np.array([0.0, 0.0, ROPE_DEPTH + ROPE_RADIUS + height]), np.array([0.0, 0.0, -1.0]))
    return Scene("sensor", "sensor", seed, camera, (Truth(axis, ROPE_RADIUS, color=ROPE_ALBEDO_COLOR),), (), table)


def slab_scene(seed: int, size: tuple[int, int] = (1280, 720)) -> Scene:
    """Return a scene of a bar 40 mm wide at 0.47 m from the camera, STEP_HEIGHT above a table that faces the camera.

    seed : seed of texture, pattern and noise. size : (width, height) px of the image.
    """
    scene = cable_scene(seed, STEP_HEIGHT, size=size)
    return replace(scene, cables=(), occluders=(cuboid(corners((0.04, 0.2, 0.005)) + np.array([0, 0, ROPE_DEPTH])),))


def measure_edges(cables: list[Rendered], slabs: list[Rendered]) -> Record:
    """Measure the apparent width and height of objects in the depth image.

    cables : rendered frames of a cable on the table, from `cable_scene`. slabs : those of a bar in the air, from `slab_scene`.

    Returns
    -------
    Record
        too_wide: apparent minus true width of the bar, px of the color image. height, width: apparent height and width of the
        cable, divided by the true ones.
    """
    wide = _median([_widened(frame) for frame in slabs])
    height, width = np.median([_apparent_size(frame) for frame in cables], axis=0).tolist()
    return Record(too_wide=wide, height=height, width=width)


def _widened(frame: Rendered) -> float:
    """Return the apparent minus the true width of the bar of `slab_scene`, px."""
    middle = ROPE_DEPTH + STEP_HEIGHT / 2
    rows = slice(int(0.4 * frame.exact.shape[0]), int(0.6 * frame.exact.shape[0]))
    seen, true = ((image[rows] > 0) & (image[rows] < middle) for image in (frame.frame.depth, frame.exact))
    return float(seen.sum(axis=1).mean() - true.sum(axis=1).mean())


def _apparent_size(frame: Rendered) -> tuple[float, float]:
    """Return the apparent height and width of a cable on the table, divided by the true ones; width is at half height."""
    u, v = np.round(frame.frame.camera.project(frame.truths[0].axis)).astype(int).T
    depth = np.asarray(frame.frame.depth, dtype=float)
    above = float(frame.exact[~frame.mask].max()) - depth
    top = float(np.median(above[v, u][depth[v, u] > 0]))
    near = cv2.dilate(frame.mask.astype(np.uint8), np.ones((41, 41), np.uint8)) > 0
    raised = (depth > 0) & near & (above > 0.5 * top)
    return top / (2 * ROPE_RADIUS), float(raised.sum() / frame.mask.sum())


def rope_frames(folder: Path) -> list[tuple[str, Frame, Bools]]:
    """Read real frames: (name, frame without color, mask) each.

    folder : folder with `*_depth.png` and `camera.json`.
    """
    values = json.loads((folder / "camera.json").read_text(encoding="utf-8"))
    camera = Camera(**{key: values[key] for key in ("fx", "fy", "cx", "cy", "width", "height")})
    frames = []
    for path in sorted(folder.glob("*_depth.png")):
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) * values["depth_scale"]
        frame = Frame(None, depth.astype(np.float32), camera, path.name.partition("_")[0])
        frames.append((frame.name, frame, depth > 0))
    return frames


def measure_rope(frame: Frame, mask: Bools) -> Record:
    """Measure the depth along the first cable, of radius 2.9 mm, that is detected in a frame with a mask (H, W)."""
    chain = detect(frame, mask=mask).chains[0]
    return measure_cable(np.where(mask, frame.depth, 0.0), frame.camera, chain.joints, ROPE_RADIUS)


def simulated_frames(height: float, seeds: range = range(3), size: tuple[int, int] = (1280, 720)) -> list[Rendered]:
    """Render the straight cable of `cable_scene` in four directions with the simulated stereo sensor.

    Parameters
    ----------
    height
        height of the cable above the table, m.
    seeds
        one frame is rendered for each seed and each of the directions 0, 30, 60 and 90 degrees.
    size
        (width, height) px of the image.
    """
    return [render(cable_scene(seed, height, angle, size), "stereo") for seed in seeds for angle in (0.0, 30.0, 60.0, 90.0)]


def measure_simulated(height: float, seeds: range = range(3), size: tuple[int, int] = (1280, 720)) -> list[Record]:
    """Measure the depth along the cable in each frame of `simulated_frames`, whose parameters these are."""
    return [
        measure_cable(np.where(frame.mask, frame.frame.depth, 0.0), frame.frame.camera, frame.truths[0].axis, ROPE_RADIUS)
        for frame in simulated_frames(height, seeds, size)
    ]


def table(folder: Annotated[Path | None, typer.Argument()] = None) -> Iterator[str]:
    """Yield the lines of a table: the simulated sensor, and the real frames of a folder if one is given."""
    rows, lines = list[Record](), list[str]()
    for name, frame, mask in rope_frames(folder) if folder else ():
        rows.append(Record(measure_rope(frame, mask) | {"family": f"real {name}"}))
    seeds = range(CHECKED_SEEDS)
    for size in ((1280, 720), (848, 480)):
        for height in (0.0, STEP_HEIGHT):
            family = {"family": f"{size[0]}, {1e3 * height:.0f} mm high"}
            rows += [Record(row | family) for row in measure_simulated(height, seeds, size)]
        slabs = [render(slab_scene(seed, size=size), "stereo") for seed in range(3)]
        edges = measure_edges(simulated_frames(0.0, seeds, size), slabs)
        shown = "{too_wide:.1f} px too wide, {height:.2f} of the height, {width:.2f} of the width".format(**edges)
        lines.append(f"{size[0]}: {shown}")
    yield from (format_table(rows, COLUMNS), *lines)


if __name__ == "__main__":
    print_lines(table)
