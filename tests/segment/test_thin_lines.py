"""Lines that the network misses in photographs are found by their color, and textures are not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from doo3d import Image, load_config
from doo3d.segment.methods import network
from doo3d.segment.thin_lines import find_lines
from doo3d.types import Array, Bools

SIZE = (360, 480)
GREY, DARK = 150, 50


def curve(width: float, size: tuple[int, int] = SIZE) -> tuple[Array, Bools]:
    """Return a photograph of a dark wave on noisy grey, and the wave's pixels; width : px."""
    across = np.linspace(0.1, 0.9, 400)
    points = np.column_stack((across * size[1], (0.5 + 0.2 * np.sin(7 * across)) * size[0]))
    line = np.zeros((4 * size[0], 4 * size[1]), np.uint8)
    cv2.polylines(line, [np.rint(4 * points).astype(np.int32)[:, None]], False, 255, round(4 * width))
    share = cv2.resize(line, size[::-1], interpolation=cv2.INTER_AREA)[..., None] / 255
    noise = np.random.default_rng(0).normal(0, 3, (*size, 1))
    return np.clip(GREY + (DARK - GREY) * share + noise, 0, 255).astype(np.uint8).repeat(3, axis=2), share[..., 0] > 0.5


def plain() -> Array:
    """Return a photograph of a noisy grey surface."""
    noise = np.random.default_rng(0).normal(GREY, 3, (*SIZE, 1))
    return np.clip(noise, 0, 255).astype(np.uint8).repeat(3, axis=2)


def overlap(found: Bools, truth: Bools) -> float:
    """Return the intersection over the union of two masks."""
    return float((found & truth).sum() / (found | truth).sum())


@pytest.mark.parametrize("width", [1.5, 2, 3, 4])
def test_a_thin_line_on_a_plain_surface_is_found_although_the_network_sees_nothing(width):
    color, line = curve(width)
    found = find_lines(color, np.zeros(SIZE, bool), 5.5)
    assert found[line].mean() > 0.95
    assert cv2.dilate(line.view(np.uint8), np.ones((3, 3)))[found].all()


def test_a_wide_line_is_only_added_where_the_network_finds_some_of_it():
    color, line = curve(12)
    found = line & (np.arange(SIZE[1]) < 240)
    assert not find_lines(color, np.zeros(SIZE, bool), 5.5).any()
    assert overlap(find_lines(color, found, 5.5), line) > 0.9
    assert not find_lines(color, line, 5.5).any()  # nothing is missed


def test_short_lines_straight_lines_and_nets_are_none():
    color = plain()
    cv2.line(color, (0, 20), (SIZE[1], 50), (DARK,) * 3, 2)  # a joint of boards
    color[100:103, 100:240] = DARK  # shorter than half of the shorter side
    color[200:300:5, 100:400] = color[200:300, 100:400:5] = DARK  # a net
    assert not find_lines(color, np.zeros(SIZE, bool), 5.5).any()


def test_a_line_is_cut_off_at_a_hand():
    color, line = curve(3)
    color[60:260, :60] = (200, 150, 130)
    added = find_lines(color, np.zeros(SIZE, bool), 5.5)
    assert overlap(added, line & (np.arange(SIZE[1]) >= 60)) > 0.85


def test_a_large_photograph_is_scaled_down():
    color, line = curve(16, (1800, 2400))
    assert overlap(find_lines(color, np.zeros(line.shape, bool), 20.0), line) > 0.8


@pytest.mark.parametrize("width", [3, 4, 5, 8])
def test_the_network_and_the_lines_together_find_the_whole_curve(width):
    color, line = curve(width, (720, 960))
    selected = network.mask(Image(color), load_config("image").segment, 0)
    assert overlap(selected.mask, line) > 0.9
    assert np.median(selected.probability[line]) >= network.LINE_PROBABILITY
