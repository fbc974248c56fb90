"""Small captures for tests: one wavy rope above a table, and images written for any file name."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

WIDTH, HEIGHT, FOCAL = 320, 240, 400.0
MATRIX = [FOCAL, 0, 0, 0, FOCAL, 0, WIDTH / 2, HEIGHT / 2, 1]


def rope(amplitude: float = 30.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One wavy rope of 5 mm radius, 0.5 m away, above a table: colour (BGR), depth in mm (uint16), mask (bool)."""
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    line_u = np.linspace(40, WIDTH - 40, 400)
    line_v = HEIGHT / 2 + amplitude * np.sin((line_u - 40) / 35)
    gap = np.sqrt((u[..., None] - line_u[::4]) ** 2 + (v[..., None] - line_v[::4]) ** 2).min(axis=2)
    radius = 0.005 * FOCAL / 0.5
    mask = gap < radius
    depth = np.full((HEIGHT, WIDTH), 560.0)
    depth[mask] = 500 - 5 * np.sqrt(1 - (gap[mask] / radius) ** 2)
    color = np.full((HEIGHT, WIDTH, 3), (150, 160, 170), np.uint8)
    color[mask] = (40, 40, 200)
    return color, np.rint(depth).astype(np.uint16), mask


def save(path: Path, image: np.ndarray) -> None:
    """OpenCV's imwrite for any name, non-ASCII letters too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    good, data = cv2.imencode(path.suffix, image)
    assert good
    path.write_bytes(data.tobytes())
