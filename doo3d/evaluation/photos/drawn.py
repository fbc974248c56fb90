"""Draw synthetic photographs: cables that cross themselves and each other on cloth, with their mask."""

import cv2
import numpy as np
from numpy.random import Generator
from scipy.ndimage import gaussian_filter

from ...types import Array, Bools, Floats, Image
from ..scenes.studio import CABLE_COLORS

SIZE = (640, 480)
"""Width and height of the image, px."""

WIDTH_PX = 11
"""Width of the cables, px."""

TURNS = ((2, 3), (1, 2), (3, 2), (2, 1), (2, 3))
"""Frequencies of each cable's Lissajous figure, across and down the image; one of the two is even, so that it never retraces
itself."""

PARTS = {1: 0.7, 2: 0.5, 3: 0.35, 4: 0.3, 5: 0.25}
"""Number of cables -> fraction of the Lissajous figure that each covers; all images have about equally many cable pixels."""

PIECE = 24
"""Number of points in a piece of cable that is drawn at once; a later piece covers an earlier one."""

POINTS = 1200
"""Number of points of a cable, which are 1 to 3 px apart."""

CLOTH = (172, 166, 158)
"""8-bit RGB of the cloth in full light."""

WEAVE, FOLDS, NOISE = 7.0, 16.0, 2.5
"""Amplitudes of the weave and of the folds' shading, and standard deviation of the camera noise, in gray levels of 255."""


def draw_photo(cables: int, seed: int = 0) -> tuple[Image, Bools]:
    """Draw an image of cables on cloth, 640x480 px; the same arguments give the same image.

    Parameters
    ----------
    cables
        number of cables, 1 to 5; they cross themselves and each other.
    seed
        seed of the random numbers: the part of its figure that each cable covers, and the cloth.

    Returns
    -------
    image : the image.
    mask : (480, 640) bool, the pixels of the cables.
    """
    rng = np.random.default_rng([cables, seed])
    image = _cloth(rng)
    mask = np.zeros(image.shape[:2], np.uint8)
    for k in range(cables):
        line = np.rint(_path(TURNS[k], PARTS[cables], rng) * 16).astype(np.int32)
        _draw_cable(image, mask, line, CABLE_COLORS[k])
    image = gaussian_filter(image, (0.6, 0.6, 0)) + rng.normal(0, NOISE, image.shape)
    return Image(np.clip(image + 0.5, 0, 255).astype(np.uint8)), mask > 0


def _cloth(rng: Generator) -> Floats:
    """Return the image of woven cloth with folds, (480, 640, 3) float64, 0 to 255."""
    v, u = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    weave = np.sin(2 * np.pi * u / 4.3) * np.sin(2 * np.pi * v / 4.7) + gaussian_filter(rng.normal(size=u.shape), 0.7)
    folds = gaussian_filter(rng.normal(size=u.shape), 45.0)
    light = WEAVE * weave / 2 + FOLDS * folds / folds.std()
    return np.asarray(np.array(CLOTH, dtype=float) + light[..., None])


def _path(turns: tuple[int, int], part: float, rng: Generator) -> Floats:
    """Return the path of a cable, a Lissajous figure: (P, 2) px, P points."""
    start, middle = rng.random(), rng.uniform(0.46, 0.54, 2)
    angle = 2 * np.pi * (start + np.linspace(0, part, POINTS))
    across, down = np.sin(turns[0] * angle), np.sin(turns[1] * angle)
    return np.column_stack((middle[0] + 0.4 * across, middle[1] + 0.4 * down)) * SIZE


def _draw_cable(image: Floats, mask: Array, line: Array, color: tuple[int, int, int]) -> None:
    """Draw a cable into the image and its mask, piece by piece: shadow, then the cable, then its highlight.

    line : (P, 2) int, sixteenths of a pixel.
    """
    cv2.polylines(mask, [line], False, 1, WIDTH_PX, cv2.LINE_8, 4)
    shade = [tuple(share * value for value in color) for share in (0.25, 1.0, 1.35)]
    for start in range(0, len(line) - 1, PIECE):
        end = start + PIECE + 1
        for overlap, light, width in (
            (PIECE // 2, shade[0], WIDTH_PX + 3),
            (PIECE, shade[1], WIDTH_PX),
            (2 * PIECE, shade[2], 3),
        ):
            cv2.polylines(image, [line[max(start - overlap, 0) : end]], False, light, width, cv2.LINE_8, 4)
