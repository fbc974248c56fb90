"""Draw textures of surfaces that fill a background: plain, stone, wood, tiles, holes, brushed metal, cloth, terrazzo."""

import cv2
import numpy as np

from ..types import Array
from .noise import Rng, color, octaves, palette


def grid(size: int) -> tuple[Array, Array]:
    """Return the columns and rows of the pixels, (size, size) float32 each."""
    rows, columns = np.mgrid[0:size, 0:size].astype(np.float32)
    return columns, rows


def plain(rng: Rng, size: int) -> Array:
    """Draw a smooth gradient with a little noise."""
    x, y = grid(size)
    angle = rng.random() * 6.28
    ramp = (x * np.cos(angle) + y * np.sin(angle)) / size
    base, other = color(rng), color(rng)
    strength = rng.choice([0.05, 0.2, 0.6])
    image = base + strength * (other - base) * (ramp - ramp.min())[..., None]
    return np.asarray(image + (octaves(rng, size, size / 2)[..., None] - 0.5) * np.float32(0.15 * rng.random()))


def stone(rng: Rng, size: int) -> Array:
    """Draw noise of many octaves in several colors: stone, soil, moss, marble."""
    values = octaves(rng, size, rng.choice([12, 40, 120]), rng.uniform(0.45, 0.95))
    if rng.random() < 0.4:
        values = np.abs(2 * values - 1)
    if rng.random() < 0.5:
        values = np.clip((values - 0.5) * rng.uniform(1, 4) + 0.5, 0, 1)
    return palette(rng, values, int(rng.integers(2, 7)))


def wood(rng: Rng, size: int) -> Array:
    """Draw wood grain: stretched noise and rings, in boards or without."""
    values = octaves(rng, size, rng.uniform(10, 40), 0.7, rng.uniform(6, 25))
    rings = np.sin(octaves(rng, size, size / 2, 0.4, 4) * rng.uniform(20, 120))
    image = palette(rng, np.clip(0.7 * values + 0.15 * (rings + 1), 0, 1), 3)
    if rng.random() < 0.5:
        board = int(rng.integers(30, 130))
        for top in range(int(rng.integers(0, board)), size, board):
            image[top : top + board] *= np.float32(rng.uniform(0.85, 1.15))
            image[top : top + int(rng.integers(1, 3))] *= np.float32(rng.uniform(0.3, 0.9))
    return image


def tiles(rng: Rng, size: int) -> Array:
    """Draw a checkerboard, tiles or bricks, with joints."""
    x, y = grid(size)
    width, height = rng.uniform(12, 110, 2)
    row = np.floor(y / height)
    column = np.floor((x + (row * width / 2 if rng.random() < 0.4 else 0)) / width)
    image = stone(rng, size) if rng.random() < 0.5 else plain(rng, size)
    if rng.random() < 0.5:
        image = np.where(((row + column) % 2 > 0)[..., None], image, color(rng)).astype(np.float32)
    shade = rng.uniform(0.8, 1.2, 4096).astype(np.float32)
    image *= shade[((row * 61 + column * 17) % 4096).astype(np.int32)][..., None]
    joint = rng.uniform(0, 4)
    seam = (y % height < joint) | ((x + (row * width / 2 if rng.random() < 0.4 else 0)) % width < joint)
    image[seam] = 0.3 * image[seam] + 0.7 * color(rng)
    return image


def holes(rng: Rng, size: int) -> Array:
    """Draw a plate with a grid of holes: perforated metal, an optical table, a breadboard."""
    x, y = grid(size)
    pitch = rng.uniform(8, 60)
    radius = pitch * rng.uniform(0.12, 0.4)
    dx, dy = (x % pitch) - pitch / 2, (y % pitch) - pitch / 2
    distance = np.maximum(np.abs(dx), np.abs(dy)) if rng.random() < 0.3 else np.hypot(dx, dy)
    inside = np.clip(radius - distance + 0.5, 0, 1)[..., None]
    rim = np.clip(1 - np.abs(distance - radius) / 1.5, 0, 1)[..., None] * np.float32(rng.uniform(-0.2, 0.3))
    image = (plain if rng.random() < 0.6 else brushed)(rng, size)
    return image * (1 - inside) + inside * color(rng) * np.float32(0.5) + rim


def brushed(rng: Rng, size: int) -> Array:
    """Draw brushed metal."""
    return palette(rng, octaves(rng, size, rng.uniform(2, 8), 0.8, rng.uniform(20, 100)), 2) * np.float32(rng.uniform(0.6, 1))


def cloth(rng: Rng, size: int) -> Array:
    """Draw woven cloth, a carpet or corrugated card: periodic in one direction or two."""
    x, y = grid(size)
    pitch = rng.uniform(2.5, 18, 2)
    warp = (octaves(rng, size, 60) - 0.5) * rng.uniform(0, 10)
    a, b = np.sin((x + warp) * 6.28 / pitch[0]), np.sin((y + warp) * 6.28 / pitch[1])
    kind = rng.random()
    weave = (
        a * b if kind < 0.4 else (a if kind < 0.7 else np.where((np.floor(x / pitch[0]) + np.floor(y / pitch[1])) % 2 > 0, a, b))
    )
    values = 0.5 + weave * rng.uniform(0.1, 0.4) + (octaves(rng, size, 4, 0.9) - 0.5) * rng.uniform(0, 0.9)
    return palette(rng, np.clip(values, 0, 1), int(rng.integers(2, 4)))


def terrazzo(rng: Rng, size: int) -> Array:
    """Draw a floor with chips or grains of other colors."""
    image = np.ascontiguousarray(plain(rng, size), np.float32)
    shades = [color(rng) for _ in range(int(rng.integers(1, 5)))]
    scale = np.exp(rng.uniform(0.3, 2.8))
    for _ in range(int(min(1500, 40000 / scale**2 * rng.uniform(0.1, 1)))):
        corners = rng.random(2) * size + rng.normal(0, scale, (int(rng.integers(3, 6)), 2))
        cv2.fillConvexPoly(
            image, np.round(corners * 16).astype(np.int32), shades[int(rng.integers(len(shades)))].tolist(), cv2.LINE_AA, 4
        )
    return image


TEXTURES = (plain, stone, wood, tiles, holes, brushed, cloth)
