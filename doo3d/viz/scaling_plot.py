"""Plot the time of a detection against the size of its input."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from ..types import Array, Floats
from .canvas import Canvas

PANEL_WIDTH, PANEL_HEIGHT = 400, 300
LEFT, RIGHT, TOP, BOTTOM = 62, 16, 34, 44  # px around the axes of a panel
TEXT, GRID, LINE, REFERENCE = (60, 60, 60), (222, 222, 222), (0, 92, 175), (200, 120, 0)


def draw_scaling(series: Mapping[str, Sequence[tuple[float, float]]], unit: str) -> Array:
    """Draw time against size, one log-log panel per series, two panels in a row, each with a curve of n log n.

    Parameters
    ----------
    series
        name of the size -> the points (size, time) of the series, from small to large, two at least.
    unit
        unit of the times.

    Returns
    -------
    (H, W, 3) uint8 RGB
    """
    panels = [_panel(name, np.array(points, dtype=float), unit) for name, points in series.items()]
    blank = np.full_like(panels[0], 255)
    panels += [blank] * (len(panels) % 2)
    return np.vstack([np.hstack(panels[k : k + 2]) for k in range(0, len(panels), 2)])


def _panel(name: str, points: Floats, unit: str) -> Array:
    canvas = Canvas(PANEL_HEIGHT, PANEL_WIDTH)
    size, times = points.T
    reference = times[-1] * size * np.log(size + 1) / (size[-1] * np.log(size[-1] + 1))
    low = 10 ** np.floor(np.log10(min(times.min(), times[-1] / 3)))
    high = 10 ** np.ceil(np.log10(times.max() * 1.01))

    def at(x: Sequence[float] | Floats, y: Sequence[float] | Floats) -> Floats:
        across = np.log(np.asarray(x) / size[0]) / np.log(size[-1] / size[0])
        up = np.log(np.asarray(y) / low) / np.log(high / low)
        width, height = PANEL_WIDTH - LEFT - RIGHT, PANEL_HEIGHT - TOP - BOTTOM
        return np.column_stack((LEFT + across * width, PANEL_HEIGHT - BOTTOM - up * height))

    image = np.full((PANEL_HEIGHT, PANEL_WIDTH, 3), 255, np.uint8)
    for value in 10 ** np.arange(round(np.log10(low)), round(np.log10(high)) + 1.0):
        (start,), (end,) = at(size[:1], [value]), at(size[-1:], [value])
        canvas.line(np.array((start, end)), GRID, 1.0, 1)
        _write(image, f"{value:g}", (LEFT - 8 - 8 * len(f"{value:g}"), round(start[1]) + 4))
    for value in size:
        (foot,) = at([value], [low])
        canvas.line(np.array((foot, at([value], [high])[0])), GRID, 1.0, 1)
        _write(image, f"{value:.3g}", (round(foot[0]) - 4 * len(f"{value:.3g}"), PANEL_HEIGHT - BOTTOM + 16))
    shown = reference >= low
    canvas.line(at(size[shown], reference[shown]), REFERENCE, 0.9, 1)
    canvas.line(at(size, times), LINE, 1.0, 2)
    for center in at(size, times):
        canvas.disc(center, 3.5, LINE, 1.0)
    image = canvas.blend_over(image)
    _write(image, f"{unit} against {name}", (LEFT, 20))
    _write(image, "thin line: n log n", (LEFT + 8, PANEL_HEIGHT - 8), REFERENCE)
    return image


def _write(image: Array, text: str, at: tuple[int, int], color: tuple[int, int, int] = TEXT) -> None:
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.4, color, 1, cv2.LINE_AA)
