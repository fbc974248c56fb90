"""Masks and frames on which detection has the most work to do: noise, nets, folded strands."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from doo3d.types import Array, Bools, Camera, Cloud, Floats, Frame, Image

Size = tuple[int, int]
"""Width and height of an image, px."""

SEED = 7
"""Seed of everything drawn at random."""

DEPTH = 0.6
"""m, distance of the object in the frames with depth."""


def salt_and_pepper(size: Size, density: float) -> Bools:
    """Return a mask of single pixels drawn at random, the given fraction of all."""
    return np.asarray(np.random.default_rng(SEED).random(size[::-1]) < density)


def hilbert(size: Size, order: int, width: int) -> Bools:
    """Return one strand folded along a Hilbert curve of 4**order places, stretched to the image."""
    places = np.zeros((1, 2), dtype=int)
    for level in range(order):
        side = 2**level
        first = places[:, ::-1]
        last = np.column_stack((2 * side - 1 - places[:, 1], side - 1 - places[:, 0]))
        places = np.concatenate((first, places + np.array([0, side]), places + side, last))
    cell = np.array(size) / 2**order
    return _strands(size, [(places + 0.5) * cell], width)


def diagonals(size: Size, spacing: int, width: int) -> Bools:
    """Return a net of lines in both diagonal directions."""
    w, h = size
    lines = []
    for x in range(-h, w + h, spacing):
        lines += [np.array([(x, 0), (x + h, h)]), np.array([(x, 0), (x - h, h)])]
    return _strands(size, lines, width)


def sticks(size: Size, count: int, width: int) -> Bools:
    """Return straight strands at random positions and directions, each a sixth to a third of the image's height long."""
    random = np.random.default_rng(SEED)
    middle = random.uniform((0, 0), size, (count, 2))
    angle = random.uniform(0, np.pi, count)
    half = size[1] * random.uniform(1 / 12, 1 / 6, count)[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
    return _strands(size, list(np.stack((middle - half, middle + half), axis=1)), width)


def rectangles(size: Size, count: int, width: int) -> Bools:
    """Return nested rectangles, evenly spaced."""
    step = min(size) / (2 * count + 2)
    lines = []
    for i in range(1, count + 1):
        a, b, c, d = i * step, i * step, size[0] - i * step, size[1] - i * step
        lines.append(np.array([(a, b), (c, b), (c, d), (a, d), (a, b)]))
    return _strands(size, lines, width)


def comb(size: Size, spacing: int, width: int) -> Bools:
    """Return a strand along the top with teeth down to the bottom."""
    w, h = size
    teeth = [np.array([(x, 10), (x, h - 10)]) for x in range(10, w - 10, spacing)]
    return _strands(size, [np.array([(10, 10), (w - 10, 10)]), *teeth], width)


def blobs(size: Size, blur: float) -> Bools:
    """Return smooth random noise above its median."""
    noise = gaussian_filter(np.random.default_rng(SEED).normal(size=size[::-1]), blur)
    return np.asarray(noise > np.median(noise))


def checkerboard(size: Size, cell: int) -> Bools:
    """Return the white fields of a checkerboard with fields of `cell` px."""
    v, u = np.mgrid[: size[1], : size[0]] // cell
    return np.asarray((u + v) % 2 == 0)


MASKS: dict[str, Callable[[Size], Bools]] = {
    "salt and pepper, 35 %": lambda size: salt_and_pepper(size, 0.35),
    "salt and pepper, 5 %": lambda size: salt_and_pepper(size, 0.05),
    "salt and pepper, 20 %": lambda size: salt_and_pepper(size, 0.2),
    "salt and pepper, 50 %": lambda size: salt_and_pepper(size, 0.5),
    "Hilbert curve, 1,024 places": lambda size: hilbert(size, 5, 7),
    "Hilbert curve, 4,096 places": lambda size: hilbert(size, 6, 4),
    "Hilbert curve, 16,384 places": lambda size: hilbert(size, 7, 2),
    "net of diagonals, 40 px": lambda size: diagonals(size, 40, 5),
    "net of diagonals, 16 px": lambda size: diagonals(size, 16, 3),
    "300 sticks": lambda size: sticks(size, 300, 5),
    "30 nested rectangles": lambda size: rectangles(size, 30, 3),
    "blobs of 2 px": lambda size: blobs(size, 2.0),
    "blobs of 6 px": lambda size: blobs(size, 6.0),
    "checkerboard of 1 px": lambda size: checkerboard(size, 1),
    "checkerboard of 8 px": lambda size: checkerboard(size, 8),
    "comb": lambda size: comb(size, 16, 5),
}
"""Name -> mask for an image of some size; made for 1280x720."""


def image_of(mask: Bools) -> Image:
    """Return a photograph of an object: blue, on grey."""
    color = np.full((*mask.shape, 3), 128, dtype=np.uint8)
    color[mask] = (20, 60, 200)
    return Image(color)


def noise_image(size: Size) -> Array:
    """Return a photograph of noise, (H, W, 3) uint8."""
    return np.random.default_rng(SEED).integers(0, 256, (size[1], size[0], 3), dtype=np.uint8)


def frame_of_mask(mask: Bools, random_depth: bool) -> Frame:
    """Return a frame with the object at one depth in front of a table, or with depth at random everywhere."""
    h, w = mask.shape
    depth = np.where(mask, DEPTH, DEPTH + 0.1)
    if random_depth:
        depth = np.random.default_rng(SEED).uniform(DEPTH, DEPTH + 0.4, mask.shape)
    camera = Camera(fx=0.7 * w, fy=0.7 * w, cx=w / 2, cy=h / 2, width=w, height=h)
    return Frame(image_of(mask).color, depth.astype(np.float32), camera)


def cloud_of(frame: Frame, mask: Bools) -> Cloud:
    """Return the points of a frame's object as a cloud."""
    v, u = np.nonzero(mask)
    pixels = np.column_stack((u, v))
    points: Floats = frame.camera.unproject(pixels, frame.depth[v, u].astype(float))
    return Cloud(points)


def _strands(size: Size, lines: list[Floats], width: int) -> Bools:
    image = np.zeros(size[::-1], dtype=np.uint8)
    for line in lines:
        cv2.polylines(image, [np.round(line).astype(np.int32)], False, 255, width)
    return image > 0
