"""Measure how the time of a detection grows with size: drawn frames that differ in one respect only."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from ..config import Config
from ..geometry.polyline import arc_length
from ..pipeline import detect
from ..types import Bools, Camera, Floats, Frame
from ..types.display import counted
from .benchmark import measure_yardstick

WIDTH, HEIGHT = 1280, 720
RADIUS_PX = 5
FOCAL_PX = 920.0
DISTANCE = 0.8
"""Distance in m from the camera to the lowest strand."""

SIZES = {
    "pixels": (0.0576, 0.2304, 0.9216, 2.0736, 3.6864),
    "length": (1, 2, 4, 8, 16),
    "cables": (1, 2, 4, 8, 16),
    "crossings": (1, 2, 4, 8, 16),
}
"""Respect in which the frames differ -> the timed sizes."""

UNITS = {"pixels": "megapixels", "length": "m of cable", "cables": "cables", "crossings": "crossings"}


@dataclass(frozen=True)
class ScalePoint:
    """The time of a detection in a drawn frame of one size.

    Attributes
    ----------
    respect
        the respect in which the frames of the series differ: pixels, length, cables or crossings.
    size
        megapixels of the frame, m of cable, number of cables or of crossings.
    milliseconds
        median time over the runs, ms.
    yardstick
        the yardstick in ms, from `measure_yardstick`.
    chains
        number of chains detected.
    """

    respect: str
    size: float
    milliseconds: float
    yardstick: float
    chains: int

    def line(self) -> str:
        """Return the line of the table that `doo3d bench --scale` prints."""
        size = f"{self.size:.2f}" if self.respect in ("pixels", "length") else f"{self.size:.0f}"
        times = f"{self.milliseconds:>9.1f}{self.milliseconds / self.yardstick:>12.1f}"
        return f"{size:>12} {UNITS[self.respect]:<20}{times}  {counted(self.chains, 'chain')}"


HEADING = f"{'size':>12} {'':<20}{'ms':>9}{'yardsticks':>12}"


def time_sizes(config: Config, runs: int) -> Iterator[ScalePoint]:
    """Time detections in drawn frames with given masks: one respect after the other, from small to large sizes.

    Parameters
    ----------
    config
        configuration of the detection.
    runs
        number of timed runs of each frame.
    """
    for respect, sizes in SIZES.items():
        for wanted in sizes:
            frame, mask, size = draw_frame(respect, wanted)
            seconds = []
            for _ in range(runs + 1):
                start = time.perf_counter()
                detection = detect(frame, config, mask)
                seconds.append(time.perf_counter() - start)
            median = 1000 * float(np.median(seconds[1:]))
            yield ScalePoint(respect, size, median, measure_yardstick(10), len(detection.chains))


def growth(points: list[ScalePoint]) -> float:
    """Return the exponent of the growth of time with size, from the two largest sizes of a series: 1 is linear."""
    first, last = points[-2:]
    return math.log(last.milliseconds / first.milliseconds) / math.log(last.size / first.size)


def draw_frame(respect: str, size: float) -> tuple[Frame, Bools, float]:
    """Draw a frame of strands as flat ribbons over a table, the later ones nearer to the camera.

    Parameters
    ----------
    respect
        the quantity that `size` gives: "pixels", "length", "cables" or "crossings".
    size
        megapixels of the frame; m of cable, rounded to a whole number of strands in the frame; number of cables or of crossings.

    Returns
    -------
    frame : the frame.
    mask : (H, W) bool, the strands.
    size : the size as drawn, in the unit of UNITS.
    """
    scale = (1e6 * size / (WIDTH * HEIGHT)) ** 0.5 if respect == "pixels" else 1.0
    width, height, focal = round(WIDTH * scale), round(HEIGHT * scale), FOCAL_PX * scale
    strands = [strand * scale for strand in _STRANDS[respect](size)]
    depth = np.full((height, width), DISTANCE + 0.02, np.float32)
    mask = np.zeros((height, width), np.uint8)
    thickness = max(2, round(2 * RADIUS_PX * scale))
    radius = RADIUS_PX * DISTANCE / FOCAL_PX
    for level, strand in enumerate(strands):
        line = [np.rint(strand * 16).astype(np.int32)]
        cv2.polylines(depth, line, False, DISTANCE - 2 * radius * min(level, 1), thickness, cv2.LINE_8, 4)
        cv2.polylines(mask, line, False, 1, thickness, cv2.LINE_8, 4)
    color = np.full((height, width, 3), 150, np.uint8)
    color[mask > 0] = (20, 60, 200)
    if respect == "pixels":
        size = width * height / 1e6
    elif respect == "length":
        size = float(arc_length(strands[0])[-1]) * DISTANCE / focal
    frame = Frame(color, depth, Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height))
    return frame, mask > 0, float(size)


def _wave(row: float, amplitude: float) -> Floats:
    """Return a wave from left to right around an image row, (P, 2) px."""
    u = np.linspace(100, WIDTH - 100, 400)
    return np.column_stack((u, row + amplitude * np.sin((u - 100) / (WIDTH - 200) * 2 * np.pi)))


def _long_strand(length: float) -> list[Floats]:
    """Return a strand of about the given length (m) that runs back and forth, in rows 25 px apart."""
    side, gap = WIDTH - 240, 25
    rows = max(1, round(length * FOCAL_PX / DISTANCE / (side + gap)))
    if rows == 1:
        side = round(length * FOCAL_PX / DISTANCE)
    points, turn = [], np.linspace(-np.pi / 2, np.pi / 2, 24)[1:-1]
    for row in range(rows):
        way = 1 if row % 2 == 0 else -1
        u = np.linspace(120, 120 + side, 200)[::way]
        points.append(np.column_stack((u, np.full_like(u, 60.0 + gap * row))))
        if row + 1 < rows:
            points.append(points[-1][-1] + np.column_stack((way * gap / 2 * np.cos(turn), gap / 2 * (1 + np.sin(turn)))))
    return [np.concatenate(points)]


def _many_cables(count: float) -> list[Floats]:
    return [_wave(HEIGHT * (k + 0.5) / count, min(20.0, 100 / count)) for k in range(int(count))]


def _many_crossings(count: float) -> list[Floats]:
    """Return a straight strand and one that crosses it `count` times."""
    u = np.linspace(100, WIDTH - 100, 1200)
    straight = np.column_stack((u, np.full_like(u, HEIGHT / 2)))
    return [straight, np.column_stack((u, HEIGHT / 2 + 120 * np.cos((u - 100) / (WIDTH - 200) * count * np.pi)))]


_STRANDS: dict[str, Callable[[float], list[Floats]]] = {
    "pixels": lambda _: [_wave(HEIGHT / 2, 150)],
    "length": _long_strand,
    "cables": _many_cables,
    "crossings": _many_crossings,
}
