"""The picture of what a stage made: points, and lines between them, over what the camera saw."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from ..types import Array, Bools, Floats, Ints
from .backdrop import Backdrop
from .canvas import Canvas
from .palette import DARK, LIGHT, UNIT_PX

_DIM = 0.45  # of the image's brightness that is left beneath what is drawn


@dataclass(frozen=True)
class Product:
    """What a stage made of a frame.

    name : such as "4-branches". points : (N, D) m (px in 2-D). colors : (N, 3) uint8 RGB. edges : (E, 2) int, lines between
    points, each in the colour of its first. mask : (H, W) bool, where the stage is one of the image. labels : point -> text.
    """

    name: str
    points: Floats
    colors: Array
    edges: Ints = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    mask: Bools | None = None
    labels: dict[int, str] = field(default_factory=dict)


def draw_product(backdrop: Backdrop, product: Product) -> Array:
    """The backdrop, dimmed, with the product over it: (H, W, 3) uint8 RGB."""
    height, width = backdrop.image.shape[:2]
    unit = max(1.0, float(np.sqrt(height * width)) / UNIT_PX)
    picture = np.asarray(np.rint(backdrop.image * _DIM), dtype=np.uint8)
    if product.mask is not None and product.mask.shape == (height, width):
        picture[product.mask] = backdrop.image[product.mask]
        borders, _ = cv2.findContours(product.mask.view(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, borders, -1, (60, 220, 90), max(1, round(unit)))
        return picture
    canvas = Canvas(height, width)
    at = backdrop.projection.project(product.points)
    good: Bools = np.asarray(np.isfinite(at).all(axis=1))
    linked = np.zeros(len(at), dtype=bool)
    linked[product.edges.ravel()] = True
    for a, b in product.edges[good[product.edges].all(axis=1)].tolist():
        canvas.line(at[[a, b]], _rgb(product.colors[a]), 1.0, 2.2 * unit)
    for i in np.flatnonzero(good).tolist():
        canvas.disc(at[i], (1.9 if linked[i] else 1.1) * unit, _rgb(product.colors[i]), 1.0)
    picture = canvas.over(picture)
    written: list[Floats] = []
    for i, text in product.labels.items():
        if good[i]:
            place = at[i] + 6 * unit
            while any((np.abs(place - other) < (48 * unit, 12 * unit)).all() for other in written):
                place = place + np.array((0.0, 13 * unit))
            written.append(place)
            _write(picture, text, place, unit)
    return picture


def _rgb(color: Array) -> tuple[int, int, int]:
    return int(color[0]), int(color[1]), int(color[2])


def _write(picture: Array, text: str, at: Floats, unit: float) -> None:
    size, (x, y) = 0.42 * unit, np.rint(at).astype(int).tolist()
    for color, thick in ((DARK, 3), (LIGHT, 1)):
        cv2.putText(picture, text, (x, y), cv2.FONT_HERSHEY_DUPLEX, size, color, max(1, round(thick * unit)), cv2.LINE_AA)
