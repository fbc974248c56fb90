"""Draw backgrounds from noise and simple shapes, without photographs."""

import itertools
from collections.abc import Callable

import cv2
import numpy as np

from ..types import Array
from .noise import Rng, color, octaves, palette
from .textures import TEXTURES, cloth, grid, plain, stone, terrazzo

LETTERS = "ABCDEFGHJKLMNPRSTUVWXYZabcdefghkmnprstuvwxyz0123456789+-/:.%"
FONTS = (cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_DUPLEX, cv2.FONT_HERSHEY_COMPLEX, cv2.FONT_HERSHEY_PLAIN)


def inked(image: Array, ink: Array, shade: Array) -> Array:
    """Print `ink`, (H, W) uint8, into an image in one color; needed because OpenCV writes letters into 8-bit images only."""
    cover = ink[..., None].astype(np.float32) / 255
    return np.asarray(image * (1 - cover) + cover * shade, np.float32)


def polygons(rng: Rng, size: int) -> Array:
    """Draw panels, boxes and machine parts: polygons with their own shade, edges and seams."""
    image = np.ascontiguousarray(plain(rng, size), np.float32)
    for _ in range(int(rng.integers(2, 30))):
        center, extent = rng.random(2) * size, size * rng.uniform(0.04, 0.6, 2)
        angle = rng.normal(0, 0.2) if rng.random() < 0.7 else rng.random() * 3.14
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * extent / 2 * rng.uniform(0.8, 1.2, (4, 2))
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = np.round((corners @ turn.T + center) * 16).astype(np.int32)
        cv2.fillConvexPoly(image, points, color(rng).tolist(), cv2.LINE_AA, 4)
        if rng.random() < 0.6:
            cv2.polylines(image, [points], True, color(rng).tolist(), int(rng.integers(1, 4)), cv2.LINE_AA, 4)
    light = octaves(rng, size, size / 1.5)[..., None]
    return image * (np.float32(0.7) + np.float32(0.6) * light)


def clutter(rng: Rng, size: int) -> Array:
    """Draw many shaded rectangles, ellipses, tubes and spots, like a workshop out of focus."""
    image = np.ascontiguousarray(plain(rng, size), np.float32)
    for _ in range(int(rng.integers(10, 90))):
        center = tuple(int(v) for v in rng.random(2) * size)
        axes = tuple(int(v) for v in np.exp(rng.uniform(np.log(2), np.log(size / 4), 2)))
        shade = color(rng)
        if rng.random() < 0.4:
            cv2.ellipse(image, center, axes, float(rng.random() * 180), 0, 360, shade.tolist(), -1, cv2.LINE_AA)
        elif rng.random() < 0.7:
            box = cv2.boxPoints((center, (2.0 * axes[0], 2.0 * axes[1]), float(rng.choice([0, 90]) + rng.normal(0, 8))))
            cv2.fillConvexPoly(image, np.round(box * 16).astype(np.int32), shade.tolist(), cv2.LINE_AA, 4)
        else:
            end = tuple(int(v) for v in rng.random(2) * size)
            for part in (1.0, 0.6, 0.25):
                width = max(1, int(min(axes) * part))
                cv2.line(image, center, end, (shade * np.float32(0.5 + 0.5 * (1 - part))).tolist(), width, cv2.LINE_AA)
    return image


def splatter(rng: Rng, size: int) -> Array:
    """Draw paint: drops, spots and thrown lines of irregular width, flat and without shade."""
    image = np.ascontiguousarray(stone(rng, size) if rng.random() < 0.6 else plain(rng, size), np.float32)
    shades = [color(rng) for _ in range(int(rng.integers(2, 7)))]
    for _ in range(int(rng.integers(40, 350))):
        shade = shades[int(rng.integers(len(shades)))].tolist()
        if rng.random() < 0.5:
            axes = tuple(int(v) for v in np.exp(rng.uniform(0, 2.6, 2)))
            cv2.ellipse(image, tuple(int(v) for v in rng.random(2) * size), axes, float(rng.random() * 180), 0, 360, shade, -1)
            continue
        heading = np.cumsum(rng.normal(0, 0.5, 14)) + rng.random() * 6.28
        steps = np.stack([np.cos(heading), np.sin(heading)], 1) * rng.uniform(1, 9)
        points = rng.random(2) * size + np.cumsum(steps, 0)
        width = rng.uniform(0.8, 5)
        for a, b in itertools.pairwise(points):
            thickness = max(1, round(width * rng.uniform(0.3, 1.4)))
            cv2.line(image, tuple(int(v) for v in a), tuple(int(v) for v in b), shade, thickness, cv2.LINE_AA)
    return image


def painted(rng: Rng, size: int) -> Array:
    """Draw painted or printed bands with outlines: graffiti, logos, a map."""
    image = np.ascontiguousarray(plain(rng, size), np.float32)
    x = np.linspace(0, 1, 40)
    for _ in range(int(rng.integers(4, 22))):
        points = rng.random((4, 2)) * size * 1.4 - 0.2 * size
        curve = sum(
            w[:, None] * p for w, p in zip(((1 - x) ** 3, 3 * x * (1 - x) ** 2, 3 * x * x * (1 - x), x**3), points, strict=True)
        )
        line = [np.round(np.asarray(curve) * 16).astype(np.int32)]
        width = int(np.exp(rng.uniform(1.5, 4)))
        if rng.random() < 0.6:
            outline = color(rng) if rng.random() < 0.4 else np.zeros(3)
            cv2.polylines(image, line, False, outline.tolist(), width + int(rng.integers(2, 7)), cv2.LINE_AA, 4)
        cv2.polylines(image, line, rng.random() < 0.3, color(rng).tolist(), width, cv2.LINE_AA, 4)
    brush = octaves(rng, size, 8, 0.8)[..., None] - np.float32(0.5)
    return image + brush * np.float32(rng.uniform(0, 0.6))


def board(rng: Rng, size: int) -> Array:
    """Draw a circuit board: traces with corners, pads and chips."""
    base = color(rng)
    image = np.ascontiguousarray(
        np.broadcast_to(base, (size, size, 3)) * (0.9 + 0.2 * octaves(rng, size, 80)[..., None]), np.float32
    )
    trace = np.clip(base + rng.uniform(-0.2, 0.25), 0, 1).tolist()
    for _ in range(int(rng.integers(10, 60))):
        points = [rng.random(2) * size]
        for _ in range(int(rng.integers(2, 6))):
            angle = rng.integers(8) * np.pi / 4
            points.append(points[-1] + rng.uniform(8, 90) * np.array([np.cos(angle), np.sin(angle)]))
        cv2.polylines(image, [np.round(np.array(points)).astype(np.int32)], False, trace, int(rng.integers(1, 4)), cv2.LINE_AA)
    for _ in range(int(rng.integers(5, 70))):
        center = tuple(int(v) for v in rng.random(2) * size)
        cv2.circle(image, center, int(rng.integers(2, 6)), color(rng).tolist(), -1, cv2.LINE_AA)
    for _ in range(int(rng.integers(0, 14))):
        x, y, w, h = (int(v) for v in (*(rng.random(2) * size), *rng.uniform(8, 70, 2)))
        cv2.rectangle(image, (x, y), (x + w, y + h), (color(rng) * np.float32(0.4)).tolist(), -1)
        for pin in range(x, x + w, 6):
            cv2.line(image, (pin, y - 4), (pin, y), (0.8, 0.8, 0.8), 2)
            cv2.line(image, (pin, y + h), (pin, y + h + 4), (0.8, 0.8, 0.8), 2)
    return image


def text(rng: Rng, size: int) -> Array:
    """Draw printed text: a label, a sheet of paper, a box with a large word."""
    image = np.ascontiguousarray((plain if rng.random() < 0.7 else cloth)(rng, size), np.float32)
    scale = np.exp(rng.uniform(-1.2, 1.8))
    line = max(8, int(30 * scale * rng.uniform(0.8, 2)))
    ink = np.zeros((size, size), np.uint8)
    for row in range(int(rng.integers(0, line)), size + line, line):
        words = "".join(rng.choice(list(LETTERS + "    "), int(size / (14 * scale)) + 2))
        font = FONTS[int(rng.integers(len(FONTS)))]
        cv2.putText(ink, words, (int(rng.integers(-30, 60)), row), font, scale, 255, max(1, int(2 * scale)), cv2.LINE_AA)
    return inked(image, ink, color(rng))


def keys(rng: Rng, size: int) -> Array:
    """Draw a keyboard, a terminal block or a front panel: a grid of buttons with letters."""
    image = np.ascontiguousarray(plain(rng, size), np.float32)
    key, gap, shade = rng.uniform(14, 60, 2), rng.uniform(1, 14), color(rng)
    ink = np.zeros((size, size), np.uint8)
    for row, y in enumerate(np.arange(-key[1], size, key[1] + gap)):
        for x in np.arange(-key[0] + row * key[0] * 0.3, size, key[0] + gap):
            corner = tuple(int(v) for v in (x, y))
            opposite = tuple(int(v) for v in (x + key[0], y + key[1]))
            cv2.rectangle(image, corner, opposite, (shade * np.float32(rng.uniform(0.8, 1.1))).tolist(), -1)
            cv2.line(image, corner, (opposite[0], corner[1]), (shade * np.float32(1.4)).tolist(), 1)
            if rng.random() < 0.8:
                place = (int(x + 0.2 * key[0]), int(y + 0.6 * key[1]))
                cv2.putText(ink, str(rng.choice(list(LETTERS))), place, FONTS[0], float(key[1]) / 70, 255, 1, cv2.LINE_AA)
    return inked(image, ink, color(rng))


def rails(rng: Rng, size: int) -> Array:
    """Draw profiles, pipes of large radius, rails and edges of tables: straight bands with their own shade."""
    image = np.ascontiguousarray((plain if rng.random() < 0.5 else clutter)(rng, size), np.float32)
    x, y = grid(size)
    for _ in range(int(rng.integers(1, 6))):
        angle = rng.choice([0, np.pi / 2]) + rng.normal(0, 0.25)
        across = -x * np.sin(angle) + y * np.cos(angle)
        width = np.exp(rng.uniform(np.log(14), np.log(140)))
        t = (across - rng.uniform(across.min(), across.max())) / width
        profile = rng.random(int(rng.integers(2, 9))).astype(np.float32)
        kind = rng.random()
        if kind < 0.3 and width > 60:
            shade = np.sqrt(np.clip(1 - t * t, 0, 1))
        elif kind < 0.7:
            shade = profile[np.clip(((t + 1) / 2 * len(profile)).astype(np.int32), 0, len(profile) - 1)]
        else:
            shade = np.interp(t, np.linspace(-1, 1, len(profile)), profile)
        inside = np.clip((1 - np.abs(t)) * width + 0.5, 0, 1)[..., None]
        image = image * (1 - inside) + inside * color(rng) * (np.float32(0.4) + np.float32(0.7) * shade[..., None])
    return image.astype(np.float32)


def grille(rng: Rng, size: int) -> Array:
    """Draw straight bars of one width side by side or crossed: fins, frames of windows, shelves, a fence, blinds."""
    image = (clutter, plain, polygons)[int(rng.integers(3))](rng, size)
    x, y = grid(size)
    for turn in (0.0, np.pi / 2)[: int(rng.integers(1, 3))]:
        angle = turn + rng.normal(0, 0.3)
        pitch = np.exp(rng.uniform(np.log(7), np.log(90)))
        across = (-x * np.sin(angle) + y * np.cos(angle) + rng.random() * pitch) % pitch - pitch / 2
        half = pitch * rng.uniform(0.08, 0.42)
        t = np.clip(across / half, -1, 1)
        kind = rng.random()
        shade = (
            np.where(t < rng.uniform(-0.8, 0.8), 1.0, rng.uniform(0.3, 1)) if kind < 0.6 else 1 - rng.uniform(0, 0.7) * np.abs(t)
        )
        inside = np.clip(half - np.abs(across) + 0.5, 0, 1)[..., None]
        image = image * (1 - inside) + inside * color(rng) * shade[..., None]
    return np.asarray(image, np.float32)


def pieces(rng: Rng, size: int) -> Array:
    """Draw cells with shaded borders: gravel, leaves, cracked soil, a heap of parts."""
    count = int(np.exp(rng.uniform(2.5, 6.5)))
    seeds = np.ones((size, size), np.uint8)
    seeds[rng.integers(0, size, count), rng.integers(0, size, count)] = 0
    distance, labels = cv2.distanceTransformWithLabels(seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    shade = palette(rng, rng.random((1, count + 1)).astype(np.float32), int(rng.integers(2, 6)))[0]
    spacing = size / np.sqrt(count)
    edge = np.clip(cv2.morphologyEx(distance, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)), 0, 2)
    image = shade[np.minimum(labels, count)]
    depth = rng.uniform(-0.5, 0.8)
    image = image * (1 - np.float32(depth) * np.clip(distance / spacing, 0, 1)[..., None])
    if rng.random() < 0.5:
        image[np.abs(edge) < 0.7] *= np.float32(rng.uniform(0.1, 1))
    return np.asarray(image + (octaves(rng, size, 6, 0.8)[..., None] - 0.5) * np.float32(rng.uniform(0, 0.4)))


def dark(rng: Rng, size: int) -> Array:
    """Draw a nearly black or nearly white surface."""
    image = (plain if rng.random() < 0.5 else cloth)(rng, size) * np.float32(rng.uniform(0.01, 0.2))
    return image if rng.random() < 0.7 else np.float32(1) - image


def hexagons(rng: Rng, size: int) -> Array:
    """Draw a hexagonal mesh. Never trained on."""
    x, y = grid(size)
    pitch = rng.uniform(10, 50)
    waves = [np.cos((x * np.cos(a) + y * np.sin(a)) * 6.28 / pitch) for a in (0, 2.094, 4.189)]
    return palette(rng, np.clip((sum(waves) + 1.5) / 4.5, 0, 1).astype(np.float32), int(rng.integers(2, 5)))


def bubbles(rng: Rng, size: int) -> Array:
    """Draw overlapping rings and discs: foam, washers, coins. Never trained on."""
    image = np.ascontiguousarray(plain(rng, size), np.float32)
    for _ in range(int(rng.integers(15, 90))):
        center = tuple(int(v) for v in rng.random(2) * size)
        radius = int(np.exp(rng.uniform(1.5, 4)))
        cv2.circle(image, center, radius, color(rng).tolist(), -1, cv2.LINE_AA)
        cv2.circle(image, center, radius, color(rng).tolist(), int(rng.integers(1, 5)), cv2.LINE_AA)
    return image


Background = Callable[[Rng, int], Array]

DRAWN = (polygons, clutter, splatter, painted, board, terrazzo, text, keys, rails, grille, pieces, dark)

KINDS: dict[str, Background] = {f.__name__: f for f in (*TEXTURES, *DRAWN)}
HELD_OUT: dict[str, Background] = {f.__name__: f for f in (hexagons, bubbles)}


def warped(rng: Rng, image: Array) -> Array:
    """Apply a random perspective, rotation and scale to an image, which is mirrored at its borders."""
    size = image.shape[0]
    corners = np.array([[0, 0], [size, 0], [size, size], [0, size]], np.float32)
    angle, scale = rng.random() * 6.28, rng.uniform(0.8, 1.6)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) * scale
    target = (corners - size / 2) @ turn.T + size / 2 + rng.normal(0, 0.12 * size, (4, 2))
    matrix = cv2.getPerspectiveTransform(corners, target.astype(np.float32))
    return np.asarray(cv2.warpPerspective(image, matrix, (size, size), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT))


def background(rng: Rng, size: int, held_out: bool = False) -> Array:
    """Draw a background of one surface, or of two that meet at an edge.

    Parameters
    ----------
    rng
        source of random numbers.
    size
        width and height, px.
    held_out
        True draws one of the kinds that the training never uses.

    Returns
    -------
    (size, size, 3) float32, 0 to 1.
    """
    kinds = list((HELD_OUT if held_out else KINDS).values())

    def surface() -> Array:
        image = np.asarray(kinds[int(rng.integers(len(kinds)))](rng, size), np.float32)
        if rng.random() < 0.5:
            gray = image.mean(axis=2, keepdims=True)
            image = gray + (image - gray) * np.float32(rng.uniform(0, 0.7))
        if rng.random() < 0.6:
            image = warped(rng, image)
        if rng.random() < 0.3:
            image = cv2.GaussianBlur(image, (0, 0), float(np.exp(rng.uniform(-0.5, 2.2))))
        return image

    image = surface()
    while rng.random() < 0.35:
        x, y = grid(size)
        angle = rng.random() * 6.28
        side = (x - rng.random() * size) * np.cos(angle) + (y - rng.random() * size) * np.sin(angle)
        image = np.where((side > 0)[..., None], image, surface())
        if rng.random() < 0.5:
            image *= 1 - np.float32(rng.uniform(0.1, 0.8)) * np.exp(-np.abs(side) / rng.uniform(0.7, 12))[..., None]
    return np.clip(image, 0, 1)
