"""Drawn images of cables on cloth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import label

from doo3d import detect, load_config
from doo3d.evaluation.photos.drawn import SIZE, draw_photo


def test_the_same_arguments_give_the_same_image():
    (first, mask), (again, same) = draw_photo(2, 4), draw_photo(2, 4)
    assert np.array_equal(first.color, again.color)
    assert np.array_equal(mask, same)
    assert not np.array_equal(first.color, draw_photo(2, 5)[0].color)


@pytest.mark.parametrize("cables", range(1, 6))
def test_cables_lie_inside_the_image_and_take_about_as_many_pixels(cables):
    image, mask = draw_photo(cables)
    assert image.color.shape == (*SIZE[::-1], 3)
    assert 25_000 < mask.sum() < 50_000
    assert not mask[[0, -1]].any()
    assert not mask[:, [0, -1]].any()
    assert label(mask)[1] <= cables


def test_cables_that_cross_are_found():
    image, mask = draw_photo(3, 4)
    detection = detect(image, load_config("image"), mask)
    assert len(detection.chains) == 3
    assert len(detection.crossings) > 3
