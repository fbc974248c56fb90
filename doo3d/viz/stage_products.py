"""Draw the intermediate result of one stage of the method: points and edges over the image."""

from dataclasses import dataclass, field

import cv2
import numpy as np

from ..types import Array, Bools, Floats, Ints
from .backdrop import Backdrop
from .canvas import Canvas
from .palette import line_unit
from .writing import write_outlined

DIMMING = 0.45  # factor of the image's brightness below the product


@dataclass(frozen=True)
class Product:
    """The intermediate result of one stage of the method for a frame, to be drawn: N points and E edges, or a mask.

    Attributes
    ----------
    name
        name of the picture, such as "4-branches".
    points
        (N, D) m (px in 2-D).
    colors
        (N, 3) uint8 RGB of the points.
    edges
        (E, 2) int, indices of the two points that each edge joins; it has the color of the first.
    mask
        (H, W) bool, for a stage that works on the image; None for other stages.
    labels
        index of a point -> text beside the point.
    """

    name: str
    points: Floats
    colors: Array
    edges: Ints = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    mask: Bools | None = None
    labels: dict[int, str] = field(default_factory=dict)


def draw_product(backdrop: Backdrop, product: Product) -> Array:
    """Draw the intermediate result of one stage over the dimmed image of a frame: (H, W, 3) uint8 RGB.

    If the product has a mask of at least the size of the image, only the mask is drawn: its pixels are not dimmed, its border is
    green. Otherwise points, edges and labels are drawn.

    Parameters
    ----------
    backdrop
        the image and the projection of points to its pixels.
    product
        the points and edges, or the mask.
    """
    height, width = backdrop.image.shape[:2]
    unit = line_unit(backdrop.image)
    picture = np.asarray(np.rint(backdrop.image * DIMMING), dtype=np.uint8)
    mask = np.zeros((0, 0), dtype=bool) if product.mask is None else product.mask[:height, :width]
    if mask.shape == (height, width):
        picture[mask] = backdrop.image[mask]
        borders, _ = cv2.findContours(np.ascontiguousarray(mask).view(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, borders, -1, (60, 220, 90), max(1, round(unit)))
        return picture
    canvas = Canvas(height, width)
    at = backdrop.projection.project(product.points)
    in_view: Bools = np.asarray(np.isfinite(at).all(axis=1))
    has_edge = np.zeros(len(at), dtype=bool)
    has_edge[product.edges.ravel()] = True
    for a, b in product.edges[in_view[product.edges].all(axis=1)].tolist():
        canvas.line(at[[a, b]], _rgb(product.colors[a]), 1.0, 2.2 * unit)
    for i in np.flatnonzero(in_view).tolist():
        canvas.disc(at[i], (1.9 if has_edge[i] else 1.1) * unit, _rgb(product.colors[i]), 1.0)
    picture = canvas.blend_over(picture)
    positions: list[Floats] = []
    for i, text in product.labels.items():
        if in_view[i]:
            position = at[i] + 6 * unit
            while any((np.abs(position - other) < (48 * unit, 12 * unit)).all() for other in positions):
                position = position + np.array((0.0, 13 * unit))
            positions.append(position)
            write_outlined(picture, text, position, 0.42 * unit, (3 * unit, unit))
    return picture


def _rgb(color: Array) -> tuple[int, int, int]:
    return int(color[0]), int(color[1]), int(color[2])
