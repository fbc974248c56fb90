"""Lines brighter or darker than what lies behind them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.errors import refuses

from doo3d.config import SegmentConfig
from doo3d.segment.methods.ridge import mask
from doo3d.types import Cloud, Image

pytest.importorskip("skimage.filters")


def cable(width: int, height: int, thick: int, color=(60, 50, 40)) -> tuple[Image, np.ndarray]:
    """A photograph of one cable in two bends before a noisy background, and its pixels."""
    u = np.linspace(0, 1, 100)
    line = np.column_stack((u * width, height * (0.5 + 0.25 * np.sin(2 * np.pi * u)))).round().astype(np.int32)
    truth = cv2.polylines(np.zeros((height, width), np.uint8), [line], False, 1, thick) > 0
    picture = np.random.default_rng(0).normal((150, 150, 150), 5, (height, width, 3)).astype(np.uint8)
    picture[truth] = color
    return Image(picture), truth


def overlap(one, other):
    return 2 * (one & other).sum() / (one.sum() + other.sum())


@pytest.mark.parametrize("color", [(60, 50, 40), (240, 230, 250)])
def test_a_dark_or_a_bright_line(color):
    image, truth = cable(320, 240, 8, color)
    assert overlap(mask(image, SegmentConfig(method="ridge"), 0), truth) > 0.75


@pytest.mark.parametrize(
    ("size", "thick"), [((1280, 960), 12), ((1920, 1440), 21), pytest.param((4000, 3000), 48, marks=pytest.mark.slow)]
)
def test_a_large_photograph_shows_the_cable_as_a_small_one_does(size, thick):
    image, truth = cable(*size, thick)
    found = mask(image, SegmentConfig(method="ridge"), 0)
    assert overlap(found, truth) > 0.75
    edge = np.abs(np.diff(found.astype(np.int8), axis=0)).argmax(axis=0)  # the upper edge, smooth at any enlargement
    assert np.abs(np.diff(edge, n=2)).max() <= 3


def test_nothing_to_see():
    assert not mask(Image(np.full((40, 60, 3), 128, np.uint8)), SegmentConfig(method="ridge"), 0).any()
    with refuses("method-needs-color", "ridge"):
        mask(Cloud(np.random.default_rng(0).random((9, 3))), SegmentConfig(method="ridge"), 0)
