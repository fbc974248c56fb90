"""Paint strands into an image: round, shaded by a light, with texture, over and under each other."""

from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np

from ..types import Array
from .curves import STEP_PX, normals, smooth_noise
from .noise import Rng, color

PIECE_RADII = 14.0
"""Length in radii of the pieces in which a strand is painted: at most about half a loop, so that loops can overlap."""


@dataclass
class Canvas:
    """The painted image with its truth.

    image : (S, S, 3) float32, 0 to 1. mask : (S, S) float32, coverage of each pixel by an object, 0 to 1. centre : (S, S)
    float32, 1 on the centerline, 0 at the border of the strand.
    """

    image: Array
    mask: Array = field(init=False)
    centre: Array = field(init=False)

    def __post_init__(self) -> None:
        self.mask = np.zeros(self.image.shape[:2], np.float32)
        self.centre = np.zeros(self.image.shape[:2], np.float32)


@dataclass(frozen=True)
class Light:
    """A light: direction (3,) towards it, ambient fraction, strength of highlights, exponent of highlights."""

    direction: Array
    ambient: float
    shine: float
    exponent: float


@dataclass(frozen=True)
class Strand:
    """A strand to paint.

    curve : (N, 2) px. radii : (N,) px. look : color at (s, t). height : (N,), higher parts cover lower ones.
    """

    curve: Array
    radii: Array
    look: Callable[[Array, Array], Array]
    light: Light
    height: Array
    opacity: float = 1.0
    contact: float = 0.0
    is_object: bool = True


def random_light(rng: Rng) -> Light:
    """Draw a light with a random direction above the image."""
    angle, slope = rng.random() * 6.28, rng.uniform(0, 1.3)
    direction = np.array([np.sin(slope) * np.cos(angle), np.sin(slope) * np.sin(angle), np.cos(slope)])
    return Light(direction, rng.uniform(0.15, 0.75), 0.0, 20.0)


def with_finish(rng: Rng, light: Light) -> Light:
    """Return the light with the highlights of a random finish: matte or glossy."""
    shine = 0.0 if rng.random() < 0.4 else rng.uniform(0.05, 0.9)
    return Light(
        light.direction, float(np.clip(light.ambient + rng.normal(0, 0.1), 0.1, 0.95)), shine, np.exp(rng.uniform(1, 4.2))
    )


Look = Callable[[Array, Array], Array]


def plain_look(rng: Rng, base: Array) -> Look:
    """Return a look of one color."""
    return lambda s, t: np.broadcast_to(base, (*s.shape, 3))


def striped_look(rng: Rng, base: Array) -> Look:
    """Return a look with one or two stripes along the strand, straight or wound around it."""
    other = color(rng)
    turns = 0.0 if rng.random() < 0.6 else rng.uniform(0.02, 0.4)
    phase, width = rng.random() * 6.28, rng.uniform(-0.3, 0.8)

    def look(s: Array, t: Array) -> Array:
        angle = np.arcsin(np.clip(t, -1, 1)) + phase + turns * s
        return np.where((np.cos(angle) > width)[..., None], other, base)

    return look


def braided_look(rng: Rng, base: Array) -> Look:
    """Return a look of braided yarn: two sets of diagonal lines."""
    other = color(rng) if rng.random() < 0.4 else base * np.float32(rng.uniform(0.3, 0.8))
    pitch, across = rng.uniform(2, 9), rng.uniform(2, 6)
    sharp = rng.uniform(0.5, 4)

    def look(s: Array, t: Array) -> Array:
        angle = np.arcsin(np.clip(t, -1, 1)) * across
        part = 0.5 + 0.5 * np.tanh(sharp * np.sin(s * pitch / 2 + angle) * np.sin(s * pitch / 2 - angle))
        return np.asarray(base + part[..., None] * (other - base))

    return look


def roped_look(rng: Rng, base: Array) -> Look:
    """Return a look of laid rope: one set of diagonal lines, dark between the strands."""
    pitch, slope, depth = rng.uniform(1.5, 6), rng.uniform(0.8, 3), rng.uniform(0.15, 0.7)
    other = color(rng) if rng.random() < 0.25 else base

    def look(s: Array, t: Array) -> Array:
        wave = np.sin(s * pitch + slope * t)
        shades = np.where((np.sin((s * pitch + slope * t) / 3) > 0.6)[..., None], other, base)
        return shades * (1 - depth * np.clip(-wave, 0, 1)[..., None])

    return look


def ribbed_look(rng: Rng, base: Array) -> Look:
    """Return a look of a corrugated hose or a spiral wrap: rings across the strand."""
    pitch, depth, slope = rng.uniform(2, 9), rng.uniform(0.1, 0.8), rng.choice([0, 0.5])
    return lambda s, t: base * (1 - depth * (0.5 + 0.5 * np.sin(s * pitch + slope * t * 2 - 0.6 * (1 - t * t))))[..., None]


def printed_look(rng: Rng, base: Array) -> Look:
    """Return a look with small printed marks along the strand."""
    other = np.full(3, 1.0 if base.mean() < 0.5 else 0.0, np.float32)
    pitch, place = rng.uniform(3, 9), rng.uniform(-0.4, 0.4)
    pattern = rng.random(512) < rng.uniform(0.2, 0.6)

    def look(s: Array, t: Array) -> Array:
        cell = (np.floor(s * pitch) + 3 * np.floor(t * 6)).astype(int) % len(pattern)
        marked = pattern[cell] & (np.abs(t - place) < 0.3) & (np.sin(s / 9) > 0)
        return np.where(marked[..., None], other, base)

    return look


def ringed_look(rng: Rng, base: Array) -> Look:
    """Return a look with stretches of another color, like heat shrink or tape. Training never uses it."""
    other, pitch = color(rng), rng.uniform(4, 30)
    return lambda s, t: np.where((np.mod(s, pitch) < 0.3 * pitch)[..., None], other, base)


def speckled_look(rng: Rng, base: Array) -> Look:
    """Return a look with dots, like mottled cord. Training never uses it."""
    other, seed = color(rng), rng.random(1024) < rng.uniform(0.1, 0.5)
    return lambda s, t: np.where(
        seed[(np.floor(s * 2).astype(int) * 7 + np.floor(t * 3).astype(int) * 31) % 1024][..., None], other, base
    )


LOOKS = (plain_look, striped_look, braided_look, roped_look, ribbed_look, printed_look)
LOOK_SHARES = (0.55, 0.14, 0.09, 0.07, 0.06, 0.09)
HELD_OUT_LOOKS = (ringed_look, speckled_look)


def paint(rng: Rng, canvas: Canvas, strands: list[Strand]) -> None:
    """Paint strands, the higher parts over the lower ones."""
    pieces = []
    for strand in strands:
        length = max(6, int(PIECE_RADII * strand.radii.mean() / STEP_PX))
        for start in range(0, max(1, len(strand.curve) - 3), length):
            stop = min(start + length + 2, len(strand.curve))
            pieces.append((float(strand.height[start:stop].mean()), strand, start, stop))
    for _, strand, start, stop in sorted(pieces, key=lambda piece: piece[0]):
        _paint_piece(canvas, strand, start, stop)


def _paint_piece(canvas: Canvas, strand: Strand, start: int, stop: int) -> None:
    size = canvas.mask.shape[0]
    points = strand.curve[start:stop]
    margin = float(strand.radii[start:stop].max()) * (1.8 if strand.contact else 1) + 2
    x0, y0 = np.maximum(np.floor(points.min(0) - margin), 0).astype(int)
    x1, y1 = np.minimum(np.ceil(points.max(0) + margin) + 1, size).astype(int)
    if x1 - x0 < 2 or y1 - y0 < 2:
        return
    rows, columns, nearest = _nearest(points - [x0, y0], x1 - x0, y1 - y0, margin)
    rows, columns = rows + y0, columns + x0
    normal = normals(strand.curve)[start:stop][nearest]
    offset = np.stack([columns, rows], 1) - points[nearest]
    lateral = (offset * normal).sum(1)
    along = offset[:, 0] * normal[:, 1] - offset[:, 1] * normal[:, 0]
    over = np.maximum(np.abs(along) - 0.75 * STEP_PX, 0)
    radius = strand.radii[start:stop][nearest]
    # where a piece goes on in another, it ends flat
    outside = ((nearest == 0) & (along < -STEP_PX) & (start > 0)) | (
        (nearest == len(points) - 1) & (along > STEP_PX) & (stop < len(strand.curve))
    )
    distance = np.hypot(lateral, over)
    cover = (np.clip(radius - distance + 0.5, 0, 1) * ~outside).astype(np.float32)
    if strand.contact:
        beyond_end = ((nearest == 0) | (nearest == len(points) - 1)) & (over > 0)
        _darken(canvas, rows, columns, strand.contact * np.clip(1.8 - distance / radius, 0, 0.8) * ~beyond_end / 0.8)
    on = cover > 0
    rows, columns, cover = rows[on], columns[on], cover[on]
    t = (lateral[on] / radius[on]).clip(-1, 1)
    s = ((start + nearest[on]) * STEP_PX + along[on]) / strand.radii.mean()
    shade = _shaded(strand, s, t, normal[on])
    part = (cover * strand.opacity)[:, None]
    canvas.image[rows, columns] = canvas.image[rows, columns] * (1 - part) + part * shade
    old = canvas.mask[rows, columns]
    centre = np.clip(1 - distance[on] / radius[on], 0, 1)
    if strand.is_object:
        canvas.mask[rows, columns] = np.maximum(old, cover)
        canvas.centre[rows, columns] = np.where(cover >= 0.5, centre, canvas.centre[rows, columns])
    else:
        canvas.mask[rows, columns] = old * (1 - cover)
        canvas.centre[rows, columns] *= 1 - cover


def _nearest(points: Array, width: int, height: int, margin: float) -> tuple[Array, Array, Array]:
    """Return rows and columns of the pixels within `margin` of the points, and the index of the nearest point of each."""
    zeros = np.full((height, width), 255, np.uint8)
    columns, rows = np.round(points[:, 0]).astype(int), np.round(points[:, 1]).astype(int)
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    index = np.flatnonzero(inside)
    empty = np.zeros(0, int)
    if not len(index):
        return empty, empty, empty
    zeros[rows[index], columns[index]] = 0
    distance, labels = cv2.distanceTransformWithLabels(zeros, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    table = np.zeros(int(labels.max()) + 1, int)
    table[labels[rows[index], columns[index]]] = index
    near_rows, near_columns = np.nonzero(distance <= margin)
    return near_rows, near_columns, table[labels[near_rows, near_columns]]


def _darken(canvas: Canvas, rows: Array, columns: Array, strength: Array) -> None:
    canvas.image[rows, columns] *= (1 - strength)[:, None].astype(np.float32)


def _shaded(strand: Strand, s: Array, t: Array, normal: Array) -> Array:
    """Return the color (P, 3) of points of a cylinder under the light: ambient, diffuse (Lambert) and highlight (Blinn)."""
    light = strand.light
    up = np.sqrt(1 - t * t)
    lit = t * (normal @ light.direction[:2]) + up * light.direction[2]
    half = light.direction + np.array([0, 0, 1.0])
    half = half / np.linalg.norm(half)
    gleam = np.clip(t * (normal @ half[:2]) + up * half[2], 0, 1) ** light.exponent
    body = strand.look(s, t) * (light.ambient + (1 - light.ambient) * np.clip(lit, 0, 1))[:, None]
    return np.asarray(body + (light.shine * gleam)[:, None], np.float32)


def random_strand(rng: Rng, curve: Array, radius: float, light: Light, base: Array, held_out: bool = False) -> Strand:
    """Draw a strand with a random look, finish, height and contact shadow.

    Parameters
    ----------
    rng
        source of random numbers.
    curve
        (N, 2), px.
    radius
        mean radius, px.
    light
        light of the image.
    base
        main color, (3,), 0 to 1.
    held_out
        True chooses one of the looks that the training never uses.
    """
    looks, shares = (HELD_OUT_LOOKS, None) if held_out else (LOOKS, LOOK_SHARES)
    look = looks[int(rng.choice(len(looks), p=shares))](rng, base)
    count = len(curve)
    radii = radius * (1 + rng.uniform(0, 0.25) * smooth_noise(rng, count, 4) * (rng.random() < 0.4))
    return Strand(
        curve,
        np.clip(radii, 0.6 * radius, 1.6 * radius),
        look,
        with_finish(rng, light),
        rng.normal() + 0.7 * smooth_noise(rng, count, max(3, count // 60)),
        rng.uniform(0.35, 0.85) if rng.random() < 0.05 else 1.0,
        rng.uniform(0.1, 0.7) if rng.random() < 0.75 else 0.0,
    )
