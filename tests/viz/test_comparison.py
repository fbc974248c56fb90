"""The picture of a comparison, by its pixels."""

import numpy as np
import pytest

from doo3d.types import Camera, Detection, Frame, Image
from doo3d.viz import draw
from doo3d.viz.comparison import CIRCLE_COLOR, COLOR_2D, COLOR_3D, draw_comparison

LINE = np.column_stack((np.arange(100.0, 501.0, 10), np.full(41, 200.0)))


def frame(width: int = 640, height: int = 480) -> Frame:
    color = np.full((height, width, 3), 128, np.uint8)
    return Frame(color, np.ones((height, width), np.float32), Camera(600, 600, 320, 240, width, height))


def like(pixel: np.ndarray, color: tuple[int, int, int]) -> bool:
    return bool(np.abs(pixel.astype(int) - color).max() < 40)


def test_both_chains_and_the_circle():
    picture = draw_comparison(frame(), [LINE], [LINE + np.array((0, 30))], [((300.0, 215.0), 4.0)])
    assert picture.shape == (480, 640, 3)
    assert like(picture[200, 250], COLOR_3D)
    assert like(picture[230, 250], COLOR_2D)
    ring = picture[215, 270:331]
    assert sum(like(pixel, CIRCLE_COLOR) for pixel in ring) >= 3
    assert like(picture[215, 300], (128, 128, 128))
    assert (frame().color == 128).all()


@pytest.mark.parametrize("size", [(16, 12), (1, 1), (1920, 1080)])
def test_any_size_without_chains(size):
    assert draw_comparison(frame(*size), [], [], []).shape == (size[1], size[0], 3)


def test_an_image_is_drawn_upon_as_an_array_is():
    color = np.full((60, 80, 3), 90, np.uint8)
    found = Detection((), mode="2d", coordinates="image")
    assert np.array_equal(draw(Image(color), found), draw(color, found))
