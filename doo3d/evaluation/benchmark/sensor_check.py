"""Measure how depth along a thin cable looks, on the simulated stereo sensor and on real frames of a rope.

    python -m doo3d.evaluation.benchmark.sensor_check [FOLDER]

FOLDER holds real frames, `*_depth.png` (uint16, 0 outside the rope) and `camera.json` (intrinsics and depth_scale).
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ...geometry.polyline import densify
from ...pipeline import detect
from ...types import Bools, Camera, Floats, Frame
from ..rendering.renderer import Rendered, render
from ..scenes.model import Scene, Solid, Table, Truth, cuboid_triangles
from ..scenes.stacking import AXIS_SPACING, spline_axis

ROPE_RADIUS, ROPE_DEPTH = 0.0029, 0.47
"""m, the cable that is measured, and its distance from the camera."""

ROPE_ALBEDO_COLOR = (40, 90, 190)
"""8-bit RGB of the cable."""

SLICE, WINDOW, STEP_HEIGHT = 0.002, 0.040, 0.060
"""m: length of a slice, length of the cable over which ripple is measured, height of the cable in the air above the table."""

MIDDLE, EDGE = (0.0, 0.3), (0.75, 0.95)
"""Ranges of the offset from the axis, in radii, that are the middle and the edge of a cable."""

MIN_PIXELS = 4
"""Readings of a slice that are enough for its spread."""

CHECKED_SEEDS = 2
"""Frames of each direction of the cable that are measured."""

OUTLIER = 0.015
"""m from the axis beyond which a reading is none of the cable, but of what is behind it."""


@dataclass(frozen=True)
class CableDepth:
    """How the depth along a cable looks. Medians over slices or windows.

    Attributes
    ----------
    spread
        mm, standard deviation of the depth within a slice of 2 mm.
    edge_minus_middle
        mm, by which the depth at the edges exceeds the depth in the middle; of a cylinder of radius 2.9 mm, 1.4.
    ripple
        mm, root mean square of the middle's depth about a smooth curve (a parabola) over 40 mm of cable.
    hole_fraction, holes_per_metre
        fraction of the axis without a reading within half a radius, and number of such runs of 3 mm or more per metre.
    longest_hole
        mm, the longest run without readings.
    """

    spread: float
    edge_minus_middle: float
    ripple: float
    hole_fraction: float
    holes_per_metre: float
    longest_hole: float


@dataclass(frozen=True)
class EdgeDepth:
    """How wide and how high things look in the depth image.

    Attributes
    ----------
    too_wide
        px of the color image by which a bar 60 mm above a table looks too wide.
    height, width
        apparent height and width of a cable on a table, over the true ones.
    """

    too_wide: float
    height: float
    width: float


def measure_cable(depth: Floats, camera: Camera, axis: Floats, radius: float) -> CableDepth:
    """Measure the depth along a cable.

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
    return CableDepth(
        spread=1e3 * _median(spreads),
        edge_minus_middle=1e3 * float(np.mean(edges)) if edges else float("nan"),
        ripple=1e3 * _median(_ripples(middles)),
        hole_fraction=float(holes.sum() / arcs[-1]),
        holes_per_metre=float((holes >= 0.003).sum() / arcs[-1]),
        longest_hole=1e3 * float(holes.max(initial=0.0)),
    )


def _hole_runs(arc: Floats, length: float) -> Floats:
    """Return the lengths in m of the runs of an axis without a reading; runs of up to 1 mm are the gaps between pixels."""
    gaps = np.diff(np.sort(np.concatenate(([0.0], arc, [length]))))
    return np.asarray(gaps[gaps > 0.0012])


def _ripples(middles: Floats) -> list[float]:
    """Return the RMS in m about a parabola of each window of slices, half overlapping; NaN is left out."""
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


def cable_scene(
    seed: int, height: float = 0.0, angle: float = 30.0, size: tuple[int, int] = (1280, 720), straight: bool = True
) -> Scene:
    """Return a scene of one cable of radius 2.9 mm at 0.47 m from the camera, above a table that faces the camera.

    Parameters
    ----------
    seed
        seeds texture, pattern and noise.
    height
        m from the table to the lowest point of the cable.
    angle
        degrees of the cable's direction from the image's x axis.
    size
        (width, height) px of the image.
    straight
        True for a straight cable; False for a wave, which has all directions in the image.
    """
    scale = size[0] / 1280
    camera = Camera(918.0 * scale, 918.0 * scale, size[0] / 2, size[1] / 2, *size)
    x = np.linspace(-0.16, 0.16, 81)
    points = np.column_stack((x, np.zeros(81) if straight else 0.06 * np.sin(x * 30), np.zeros(81)))
    axis = spline_axis(Rotation.from_euler("z", angle, degrees=True).apply(points)) + np.array([0.0, 0.0, ROPE_DEPTH])
    table = Table(np.array([0.0, 0.0, ROPE_DEPTH + ROPE_RADIUS + height]), np.array([0.0, 0.0, -1.0]))
    return Scene("sensor", "sensor", seed, camera, (Truth(axis, ROPE_RADIUS, color=ROPE_ALBEDO_COLOR),), (), table)


def slab_scene(seed: int, height: float = STEP_HEIGHT, size: tuple[int, int] = (1280, 720)) -> Scene:
    """Return a scene of a bar 40 mm wide at 0.47 m from the camera, above a table that faces the camera.

    Parameters
    ----------
    seed
        seeds texture, pattern and noise.
    height
        m from the table to the bar.
    size
        (width, height) px of the image.
    """
    scene = cable_scene(seed, height, size=size)
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * (0.04, 0.2, 0.005) + (0, 0, ROPE_DEPTH)
    return Scene(**{**vars(scene), "cables": (), "occluders": (Solid(corners, cuboid_triangles()),)})


def measure_edges(cables: list[Rendered], slabs: list[Rendered]) -> EdgeDepth:
    """Measure the apparent width of a bar in the air, and the apparent width and height of a cable on the table.

    Parameters
    ----------
    cables
        rendered frames of a cable on the table, from `cable_scene`.
    slabs
        rendered frames of a bar in the air, from `slab_scene`.
    """
    wide = [_widened(frame) for frame in slabs]
    height, width = [], []
    for frame in cables:
        table = _table_depth(frame)
        top = _middle_height(frame, table)
        height.append(top / (2 * ROPE_RADIUS))
        width.append(_apparent_width(frame, top) / _true_width(frame))
    return EdgeDepth(_median(wide), _median(height), _median(width))


def _widened(frame: Rendered) -> float:
    """Return the px by which the bar of `slab_scene` looks too wide."""
    depth, exact = np.asarray(frame.frame.depth, dtype=float), frame.exact
    middle = ROPE_DEPTH + STEP_HEIGHT / 2
    rows = slice(int(0.4 * depth.shape[0]), int(0.6 * depth.shape[0]))
    seen, true = ((image[rows] > 0) & (image[rows] < middle) for image in (depth, exact))
    return float(seen.sum(axis=1).mean() - true.sum(axis=1).mean())


def _true_width(frame: Rendered) -> float:
    """Return the mean width of the cable in px: pixels of the mask per px of its length."""
    return float(frame.mask.sum()) / _image_length(frame)


def _image_length(frame: Rendered) -> float:
    pixels = frame.frame.camera.project(frame.truths[0].axis)
    return float(np.linalg.norm(np.diff(pixels, axis=0), axis=1).sum())


def _table_depth(frame: Rendered) -> Floats:
    table, camera = frame.exact, frame.frame.camera
    return np.full((camera.height, camera.width), float(table[~frame.mask].max()))


def _apparent_width(frame: Rendered, height: float) -> float:
    """Return the mean width in px of what is more than half of `height` in m above the table."""
    depth = np.asarray(frame.frame.depth, dtype=float)
    near = cv2.dilate(frame.mask.astype(np.uint8), np.ones((41, 41), np.uint8)) > 0
    raised = (depth > 0) & near & (_table_depth(frame) - depth > 0.5 * height)
    return float(raised.sum()) / _image_length(frame)


def _middle_height(frame: Rendered, table: Floats) -> float:
    """Return the median height in m of the readings along the axis above the table."""
    u, v = np.round(frame.frame.camera.project(frame.truths[0].axis)).astype(int).T
    depth = np.asarray(frame.frame.depth, dtype=float)[v, u]
    return float(np.median((table[v, u] - depth)[depth > 0]))


def rope_frames(folder: Path) -> list[tuple[str, Frame, Bools]]:
    """Read real frames: (name, frame without color, mask) each.

    Parameters
    ----------
    folder
        holds `*_depth.png` and `camera.json`.
    """
    values = json.loads((folder / "camera.json").read_text(encoding="utf-8"))
    camera = Camera(**{key: values[key] for key in ("fx", "fy", "cx", "cy", "width", "height")})
    frames = []
    for path in sorted(folder.glob("*_depth.png")):
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) * values["depth_scale"]
        frame = Frame(None, depth.astype(np.float32), camera, path.name.partition("_")[0])
        frames.append((frame.name, frame, depth > 0))
    return frames


def measure_rope(frame: Frame, mask: Bools, radius: float = ROPE_RADIUS) -> CableDepth:
    """Measure the depth along the first cable that is detected in a frame.

    Parameters
    ----------
    frame, mask
        the frame, and the (H, W) pixels of its cable.
    radius
        m.
    """
    chain = detect(frame, mask=mask).chains[0]
    return measure_cable(np.where(mask, frame.depth, 0.0), frame.camera, chain.joints, radius)


def simulated_frames(height: float, seeds: range = range(3), size: tuple[int, int] = (1280, 720)) -> list[Rendered]:
    """Render the cable of `cable_scene` by the stereo sensor, straight in several directions.

    Parameters
    ----------
    height
        m above the table.
    seeds
        one frame is rendered for each seed and each of the directions 0, 30, 60 and 90 degrees.
    size
        (width, height) px of the image.
    """
    return [render(cable_scene(seed, height, angle, size), "stereo") for seed in seeds for angle in (0.0, 30.0, 60.0, 90.0)]


def measure_simulated(height: float, seeds: range = range(3), size: tuple[int, int] = (1280, 720)) -> list[CableDepth]:
    """Measure the depth along a cable of radius 2.9 mm at 0.47 m, as the simulated stereo sensor sees it.

    Parameters
    ----------
    height
        m above the table.
    seeds
        seeds of texture, pattern and noise.
    size
        (width, height) px of the image.

    Returns
    -------
    The measures of a frame for each seed and each of four directions.
    """
    return [
        measure_cable(
            np.where(frame.mask, frame.frame.depth, 0.0), frame.frame.camera, frame.truths[0].axis, frame.truths[0].radius
        )
        for frame in simulated_frames(height, seeds, size)
    ]


def _line(name: str, values: list[CableDepth]) -> str:
    cells = [f"{np.nanmean([getattr(value, key) for value in values]):8.2f}" for key in CableDepth.__dataclass_fields__]
    return f"{name:18s}" + " ".join(cells)


def main(arguments: list[str]) -> None:
    """Print the measures of the simulated sensor, and of the real frames in a folder if one is named."""
    print(" " * 18 + "  spread edge-mid   ripple    holes    per m  longest")  # noqa: T201
    for name, frame, mask in rope_frames(Path(arguments[0])) if arguments else ():
        print(_line(f"real {name}", [measure_rope(frame, mask)]))  # noqa: T201
    seeds = range(CHECKED_SEEDS)
    for size in ((1280, 720), (848, 480)):
        for height in (0.0, STEP_HEIGHT):
            print(_line(f"{size[0]}, {1e3 * height:.0f} mm high", measure_simulated(height, seeds, size)))  # noqa: T201
        edges = measure_edges(
            simulated_frames(0.0, seeds, size), [render(slab_scene(seed, size=size), "stereo") for seed in range(3)]
        )
        print(f"{size[0]}: {edges.too_wide:.1f} px too wide, {edges.height:.2f} of the height, {edges.width:.2f} of the width")  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
