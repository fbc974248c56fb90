"""Small captures for tests: one wavy rope above a table, and images written for any file name."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

WIDTH, HEIGHT, FOCAL = 320, 240, 400.0
MATRIX = [FOCAL, 0, 0, 0, FOCAL, 0, WIDTH / 2, HEIGHT / 2, 1]


@lru_cache
def rope(amplitude: float = 30.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One wavy rope of 5 mm radius, 0.5 m away, above a table: color (BGR), depth in mm (uint16), mask (bool)."""
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
    images = color, np.rint(depth).astype(np.uint16), mask
    for image in images:
        image.setflags(write=False)
    return images


def cut(path: Path, share: float) -> Path:
    """Cut off a file, so that this share of it is left."""
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    return path


def save(path: Path, image: np.ndarray) -> None:
    """OpenCV's imwrite for any name, non-ASCII letters too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    good, data = cv2.imencode(path.suffix, image)
    assert good
    path.write_bytes(data.tobytes())


def write_capture(
    folder: Path, frames: int = 1, color: bool = True, mask: bool = False, intrinsics: dict[str, Any] | None = None
) -> Path:
    """Write a folder capture as recorders write it: frames of a rope, each of which bends a little more than the one before."""
    folder.mkdir(parents=True)
    values = {"width": WIDTH, "height": HEIGHT, "intrinsic_matrix": MATRIX} | (intrinsics or {})
    (folder / "camera_intrinsic.json").write_text(json.dumps(values))
    for i in range(frames):
        picture, depth, seen = rope(30.0 + 2 * i)
        save(folder / "depth" / f"{i:06d}.png", depth)
        if color:
            save(folder / "color" / f"{i:06d}.jpg", picture)
        if mask:
            save(folder / "mask" / f"{i:06d}.png", seen.astype(np.uint8) * 255)
    return folder
