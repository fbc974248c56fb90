"""Strands detected by color, in a photograph and in a frame."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.errors import refuses

from doo3d.config import SegmentConfig
from doo3d.segment import segment
from doo3d.segment.methods import resolve_method
from doo3d.segment.methods.strands import mask
from doo3d.types import Camera, Cloud, Frame, Image

SHAPE = (240, 320)
X = np.linspace(-20, 340, 400)
BEND = np.column_stack((X, 120 + 50 * np.sin(X / 60)))
SHADE, MARK = BEND + np.array((0, 40)), BEND + np.array((0, 45))
CAMERA = Camera(fx=300.0, fy=300.0, cx=160.0, cy=120.0, width=320, height=240)


def drawn(image, line, width, color):
    cv2.polylines(image, [np.rint(line * 8).astype(np.int32)[:, None]], False, color, width, cv2.LINE_AA, 3)


def pixels(line, width):
    image = np.zeros(SHAPE, np.uint8)
    drawn(image, line, width, 255)
    return image > 127


def busy(seed=0):
    """A background of blotches of all colors, some as wide as a strand."""
    random = np.random.default_rng(seed)
    image = np.full((*SHAPE, 3), 128, np.uint8)
    for _ in range(900):
        center = random.uniform((0, 0), SHAPE[::-1])
        along = random.normal(0, 6, 2)
        color = random.integers(0, 255, 3).tolist()
        cv2.line(
            image, tuple(np.rint(center - along).astype(int)), tuple(np.rint(center + along).astype(int)), color, 5, cv2.LINE_AA
        )
    return image


def overlap(found, truth):
    return (found & truth).sum() / (found | truth).sum()


def test_auto_selects_the_network_in_frames_with_color():
    grey = np.full((*SHAPE, 3), 90, np.uint8)
    depth = np.full(SHAPE, 0.8, np.float32)
    assert resolve_method(Image(grey), SegmentConfig()) == "network"
    assert resolve_method(Frame(grey, depth, CAMERA), SegmentConfig()) == "network"
    assert resolve_method(Frame(None, depth, CAMERA), SegmentConfig()) == "plane"


@pytest.mark.parametrize("seed", [0, 1])
def test_a_strand_before_a_busy_background(seed):
    image = busy(seed)
    drawn(image, BEND, 10, (30, 60, 200))
    assert overlap(mask(Image(image), SegmentConfig(), 0).mask, pixels(BEND, 10)) > 0.75


def test_a_large_photograph():
    image = cv2.resize(busy(), (1280, 960), interpolation=cv2.INTER_CUBIC)
    drawn(image, 4 * BEND, 40, (30, 60, 200))
    truth = cv2.resize(pixels(BEND, 10).astype(np.uint8), (1280, 960), interpolation=cv2.INTER_NEAREST) > 0
    assert overlap(mask(Image(image), SegmentConfig(), 0).mask, truth) > 0.6


def test_a_shadow_is_left_out_with_a_note_where_nothing_else_is_found():
    image = np.full((*SHAPE, 3), (200, 190, 170), np.uint8)
    light = np.zeros(SHAPE, np.float32)
    drawn(light, SHADE, 10, 1.0)
    shaded = (image * (1 - 0.35 * cv2.GaussianBlur(light, (0, 0), 2.5))[..., None]).astype(np.uint8)
    settings = SegmentConfig(method="strands", max_width=np.inf, max_width_ratio=np.inf)
    assert "only darker" in mask(Image(shaded), settings, 0).note
    drawn(shaded, BEND, 10, (200, 40, 40))
    found = segment(Image(shaded), settings).scene
    assert overlap(found.mask, pixels(BEND, 10)) > 0.75
    assert not (found.mask & pixels(SHADE, 6) & ~pixels(BEND, 16)).any()
    assert found.notes == ()


def test_an_empty_table_has_no_strand():
    image = np.full((*SHAPE, 3), 150, np.uint8) + np.random.default_rng(0).integers(0, 8, (*SHAPE, 3), dtype=np.uint8)
    assert not mask(Image(image), SegmentConfig(), 0).mask.any()


def table(noise=0.0):
    random = np.random.default_rng(0)
    color = np.clip(random.normal(150, 3, (*SHAPE, 3)), 0, 255).astype(np.uint8)
    return color, (0.8 + noise * random.normal(size=SHAPE)).astype(np.float32)


def test_a_wire_that_depth_does_not_see():
    color, depth = table(0.001)
    drawn(color, BEND, 3, (170, 50, 50))
    found = mask(Frame(color, depth, CAMERA), SegmentConfig(), 0)
    assert (found.mask & pixels(BEND, 3)).sum() > 0.95 * pixels(BEND, 3).sum()
    assert not (found.mask & ~pixels(BEND, 7)).any()
    assert found.note == ""


def test_a_mark_on_the_table_beside_a_raised_strand():
    color, depth = table()
    drawn(color, BEND, 10, (170, 50, 50))
    drawn(color, MARK, 4, (50, 50, 170))
    depth[pixels(BEND, 8)] = 0.78
    found = mask(Frame(color, depth, CAMERA), SegmentConfig(), 0)
    assert (found.mask & pixels(BEND, 8)).sum() > 0.95 * pixels(BEND, 8).sum()
    assert not found.mask[pixels(MARK, 4) & ~pixels(BEND, 14)].any()
    assert "1 band that is flat on the surface" in found.note


def test_a_strand_of_the_tables_color_is_raised():
    color, depth = table()
    depth[pixels(BEND, 8)] = 0.78
    np.testing.assert_array_equal(mask(Frame(color, depth, CAMERA), SegmentConfig(), 0).mask, pixels(BEND, 8))


def test_readings_of_the_table_beside_a_strand_are_removed():
    color, depth = table()
    drawn(color, BEND, 8, (170, 50, 50))
    depth[pixels(BEND, 16)] = 0.78
    found = mask(Frame(color, depth, CAMERA), SegmentConfig(), 0)
    assert overlap(found.mask, pixels(BEND, 8)) > 0.75


def test_short_things_of_another_color_are_left_out():
    color, depth = table()
    drawn(color, BEND, 8, (170, 50, 50))
    depth[pixels(BEND, 8)] = 0.78
    color[200:216, 250:270], depth[200:216, 250:270] = (40, 200, 40), 0.77
    assert not mask(Frame(color, depth, CAMERA), SegmentConfig(), 0).mask[200:216, 250:270].any()
    color[200:216, 250:270] = (170, 50, 50)  # the color of a strand that continues there
    assert mask(Frame(color, depth, CAMERA), SegmentConfig(), 0).mask[200:216, 250:270].any()


def test_a_cloud_is_refused():
    with refuses("method-needs-image", "strands", "plane"):
        mask(Cloud(np.zeros((3, 3))), SegmentConfig(), 0)


def test_a_coil_that_depth_does_not_show():
    """Most of what is within 60 px of its middle is coil: that is not the color of the surface there."""
    random = np.random.default_rng(0)
    color = np.clip(random.normal(150, 3, (480, 640, 3)), 0, 255).astype(np.uint8)
    depth = (0.8 + 0.001 * random.normal(size=(480, 640))).astype(np.float32)
    t = np.linspace(0, 12 * np.pi, 3000)
    coil = np.column_stack((320 + (28 + 2.6 * t) * np.cos(t), 240 + (28 + 2.6 * t) * np.sin(t)))
    truth = np.zeros((480, 640), np.uint8)
    drawn(truth, coil, 9, 255)
    drawn(color, coil, 9, (170, 50, 50))
    depth[20:26, 100:290] = 0.79
    found = mask(Frame(color, depth, Camera(500.0, 500.0, 320.0, 240.0, 640, 480)), SegmentConfig(), 0).mask
    assert found[truth > 127].mean() > 0.95
    assert not found[225:255, 305:335].any()


def test_a_strand_in_the_air_of_which_depth_shows_more_than_there_is():
    """A stereo camera widens it: nothing else has depth, so nothing says which of that is the surface's."""
    color, _ = table()
    drawn(color, BEND, 7, (170, 50, 50))
    depth = np.where(pixels(BEND, 21), np.float32(0.6), np.float32(0))
    frame = Frame(color, depth, CAMERA)
    assert resolve_method(frame, SegmentConfig()) == "network"
    found = mask(frame, SegmentConfig(), 0)
    assert overlap(found.mask, pixels(BEND, 7)) > 0.75
    assert found.is_certain


def test_a_raised_part_with_something_else_is_not_certain():
    """A strand that touches a box is one band with it, whose color is that of the box; another strand is detected."""
    color, depth = table()
    line = BEND - np.array((0, 60))
    drawn(color, BEND + np.array((0, 40)), 7, (170, 50, 50))
    drawn(color, line, 7, (170, 50, 50))
    color[25:105, 100:220] = (240, 245, 240)
    depth[pixels(BEND + np.array((0, 40)), 7) | pixels(line, 7)] = 0.78
    depth[25:105, 100:220] = 0.7
    assert not mask(Frame(color, depth, CAMERA), SegmentConfig(), 0).is_certain
