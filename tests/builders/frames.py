"""Frames made of others: with more around them, and with their cables twice."""

from __future__ import annotations

import numpy as np

from doo3d.types import Array, Bools, Camera, Cloud, Frame, Image

CLOUD_STEP = 1.2
"""Widths of a cloud by which its copy lies beside it."""


def padded(data: Frame | Image, mask: Bools | None) -> tuple[tuple[Frame | Image, Bools | None], int]:
    """Return a frame of twice the width and height with the given one in its middle, its mask, and the number of pixels added.

    Color goes on as at the border; depth is missing.
    """
    shape = data.color.shape[:2] if isinstance(data, Image) else data.depth.shape
    rows, columns = (shape[0] // 2, shape[1] // 2)

    def around(image: Array, **how: object) -> Array:
        return np.pad(image, ((rows, rows), (columns, columns), *([(0, 0)] * (image.ndim - 2))), **how)

    larger = None if mask is None else around(mask)
    added = (shape[0] + 2 * rows) * (shape[1] + 2 * columns) - shape[0] * shape[1]
    color = around(np.asarray(data.color), mode="edge")
    if isinstance(data, Image):
        return (Image(color), larger), added
    camera = data.camera
    middle = (camera.cx + columns, camera.cy + rows)
    wide = Camera(camera.fx, camera.fy, *middle, camera.width + 2 * columns, camera.height + 2 * rows)
    return (Frame(color, around(data.depth), wide), larger), added


def doubled(data: Frame | Image | Cloud, mask: Bools | None) -> tuple[Frame | Image | Cloud, Bools | None]:
    """Return a frame or cloud beside a copy of itself, with the mask."""

    def twice(image: Array) -> Array:
        return np.concatenate([image, image], axis=1)

    if isinstance(data, Cloud):
        step = np.array([CLOUD_STEP * np.ptp(data.points[:, 0]), 0.0, 0.0])
        return Cloud(np.concatenate([data.points, data.points + step])), None
    both = None if mask is None else twice(mask)
    color = twice(np.asarray(data.color))
    if isinstance(data, Image):
        return Image(color), both
    camera = data.camera
    wide = Camera(camera.fx, camera.fy, camera.cx, camera.cy, 2 * camera.width, camera.height)
    return Frame(color, twice(data.depth), wide), both
