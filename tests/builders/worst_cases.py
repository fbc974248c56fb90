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


def pinholes(size: Size, share: float) -> Bools:
    """Return the whole image but a margin, with single pixels missing at random."""
    mask = ~salt_and_pepper(size, share)
    mask[:4] = mask[-4:] = mask[:, :4] = mask[:, -4:] = False
    return mask


def cables_with_pinholes(size: Size, count: int, width: int, share: float) -> Bools:
    """Return wavy cables side by side with single pixels missing at random."""
    return cables(size, count, width) & ~salt_and_pepper(size, share)


def cables(size: Size, count: int, width: int) -> Bools:
    """Return wavy cables from left to right, one below the other."""
    x = np.arange(10, size[0] - 10, 4)
    rows = np.linspace(10, size[1] - 10, count)
    return _strands(size, [np.column_stack((x, y + 3 * np.sin(x / 60 + y))) for y in rows], width)


def lines(size: Size, spacing: int, width: int) -> Bools:
    """Return horizontal lines, one every `spacing` px, up to a margin at both sides."""
    mask = np.zeros(size[::-1], dtype=bool)
    mask[:, 4:-4] = ((np.arange(size[1]) % spacing) < width)[:, None]
    return mask


def zigzag(size: Size, turns: int, width: int) -> Bools:
    """Return one strand that goes up and down from left to right."""
    x = np.linspace(10, size[0] - 10, turns + 1)
    y = np.where(np.arange(turns + 1) % 2, size[1] - 10, 10)
    return _strands(size, [np.column_stack((x, y))], width)


def spiral(size: Size, pitch: float, width: int) -> Bools:
    """Return a strand wound from the middle to the edge."""
    largest = min(size) / 2 - 10
    angle = np.linspace(0, 2 * np.pi * largest / pitch, int(largest**2 / pitch) + 2)
    radius = pitch * angle / (2 * np.pi)
    line = np.column_stack((size[0] / 2 + radius * np.cos(angle), size[1] / 2 + radius * np.sin(angle)))
    return _strands(size, [line], width)


def rings(size: Size, count: int, width: int) -> Bools:
    """Return circles around one middle."""
    angle = np.linspace(0, 2 * np.pi, 200)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    middle = np.array(size) / 2
    return _strands(size, [middle + r * circle for r in np.linspace(6, min(size) / 2 - 6, count)], width)


def dots(size: Size, spacing: int, width: int) -> Bools:
    """Return squares on a grid."""
    v, u = np.mgrid[: size[1], : size[0]] % spacing
    return np.asarray((u < width) & (v < width))


def maze(size: Size, cell: int) -> Bools:
    """Return the walls of a maze, one pixel wide: from each place one wall to the right or down, at random."""
    mask = np.zeros(size[::-1], dtype=bool)
    down = np.random.default_rng(SEED).random((size[1] // cell, size[0] // cell)) < 0.5
    for v, u in np.ndindex(down.shape):
        y, x = v * cell, u * cell
        mask[y : y + cell + 1, x] |= down[v, u]
        mask[y, x : x + cell + 1] |= not down[v, u]
    return mask


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
    "comb of 1 px": lambda size: comb(size, 3, 1),
    "comb of 400 teeth": lambda size: comb(size, size[0] // 400 + 1, 2),
    "salt and pepper, 65 %": lambda size: salt_and_pepper(size, 0.65),
    "salt and pepper, 80 %": lambda size: salt_and_pepper(size, 0.8),
    "salt and pepper, 95 %": lambda size: salt_and_pepper(size, 0.95),
    "pinholes, 1 %": lambda size: pinholes(size, 0.01),
    "pinholes, 10 %": lambda size: pinholes(size, 0.1),
    "20 cables with pinholes": lambda size: cables_with_pinholes(size, 20, 21, 0.05),
    "200 thin cables": lambda size: cables(size, 200, 2),
    "60 cables": lambda size: cables(size, 60, 7),
    "lines of 1 px": lambda size: lines(size, 2, 1),
    "lines of 2 px": lambda size: lines(size, 3, 2),
    "lines of 3 px": lambda size: lines(size, 4, 3),
    "lines of 5 px": lambda size: lines(size, 7, 5),
    "zigzag of 400 turns": lambda size: zigzag(size, 400, 1),
    "zigzag of 100 turns": lambda size: zigzag(size, 100, 3),
    "spiral": lambda size: spiral(size, 9, 5),
    "spiral of 1 px": lambda size: spiral(size, 3, 1),
    "60 rings": lambda size: rings(size, 60, 3),
    "dots of 2 px": lambda size: dots(size, 4, 2),
    "dots of 8 px": lambda size: dots(size, 12, 8),
    "maze of 2 px": lambda size: maze(size, 2),
    "maze of 6 px": lambda size: maze(size, 6),
}
"""Name -> mask for an image of some size; made for 1280x720."""


LARGE: dict[str, tuple[Callable[[Size], Bools], Size]] = {
    "salt and pepper, 20 %, 4096x4096": (lambda size: salt_and_pepper(size, 0.2), (4096, 4096)),
    "salt and pepper, 60 %, 4096x4096": (lambda size: salt_and_pepper(size, 0.6), (4096, 4096)),
    "salt and pepper, 60 %, 8192x8192": (lambda size: salt_and_pepper(size, 0.6), (8192, 8192)),
    "pinholes, 1 %, 4096x4096": (lambda size: pinholes(size, 0.01), (4096, 4096)),
    "200 cables, 4096x4096": (lambda size: cables(size, 200, 9), (4096, 4096)),
    "salt and pepper, 50 %, 100000x16": (lambda size: salt_and_pepper(size, 0.5), (100_000, 16)),
    "line, 100000x16": (lambda size: lines(size, 16, 5), (100_000, 16)),
}
"""Name -> mask, and the size that it is made for: frames larger than cameras give."""


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
