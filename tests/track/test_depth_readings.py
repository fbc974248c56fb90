"""The depth along a chain is read as the sensor gave it, without that of what hides the chain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.scenes import cloud_scene, frame_scene, image_scene

from doo3d.scene.frame import FrameScene
from doo3d.track.depth_readings import NODES, PER_NODE, readings_along
from doo3d.types import Camera, Chain, Frame

CAMERA = Camera(600.0, 600.0, 320.0, 240.0, 640, 480)
RANGE, BEHIND, RADIUS = 0.8, 1.3, 0.004
SEGMENTS = 100
COLUMNS = slice(120, 521)
"""Columns of the image that the chain covers: 400 px."""


def chain(occluded: slice = slice(0, 0)) -> Chain:
    """A chain across the image, RANGE before the camera."""
    x = np.linspace(-200, 200, SEGMENTS + 1) / CAMERA.fx * RANGE
    hidden = np.zeros(SEGMENTS, dtype=bool)
    hidden[occluded] = True
    joints, filled = np.column_stack((x, np.zeros_like(x), np.full_like(x, RANGE))), np.arange(SEGMENTS) % 8 == 0
    return Chain(joints, float(x[1] - x[0]), RADIUS, occluded=hidden, depth_filled=filled | hidden)


MASK = np.zeros((480, 640), dtype=bool)
MASK[237:244, COLUMNS] = True
DEPTH = np.full(MASK.shape, BEHIND, dtype=np.float32)
DEPTH[233:248, COLUMNS] = RANGE - RADIUS


def seen(depth: np.ndarray = DEPTH) -> FrameScene:
    """The chain's mask, 7 px wide, and its surface before a wall, which a stereo camera reads 4 px too wide."""
    return frame_scene(Frame(None, depth, CAMERA), MASK)


def depths(readings: np.ndarray) -> np.ndarray:
    """The readings as depth: (2, NODES, PER_NODE) m."""
    x = np.clip((np.arange(NODES * PER_NODE) + 0.5) / PER_NODE - 0.5, 0, NODES - 1) / (NODES - 1) - 0.5
    angle = x * 2 * np.arctan(200 / CAMERA.fx)
    return np.cos(angle).reshape(NODES, PER_NODE) / readings


def test_the_chain_and_what_lies_behind_are_read() -> None:
    readings = readings_along(chain(), seen(), (True, True))
    assert readings.shape == (2, NODES, PER_NODE)
    own, behind = depths(readings)
    np.testing.assert_allclose(own, RANGE, atol=0.001)
    np.testing.assert_allclose(behind, BEHIND, atol=0.001)


def test_what_is_missing_is_no_reading() -> None:
    depth = DEPTH.copy()
    depth[:, 300:340] = 0
    own = depths(readings_along(chain(), seen(depth), (True, True)))[0].ravel()
    assert np.isnan(own).mean() == pytest.approx(40 / 400, abs=0.02)


def test_readings_beside_what_hides_the_chain_are_left_out() -> None:
    """A hand before segments 50 to 60, 40 px, is read 10 px beyond its edges, too."""
    depth = DEPTH.copy()
    depth[:, 310:370] = 0.5
    own = depths(readings_along(chain(slice(50, 60)), seen(depth), (True, True)))[0].ravel()
    known = np.isfinite(own)
    np.testing.assert_allclose(own[known], RANGE, atol=0.001)
    assert known.mean() == pytest.approx(1 - (40 + 2 * 14) / 400, abs=0.02)


@pytest.mark.parametrize("tips", [(True, False), (False, True), (False, False)])
def test_readings_beside_a_hidden_end_are_left_out(tips: tuple[bool, bool]) -> None:
    own = readings_along(chain(), seen(), tips)[0].ravel()
    ends = np.isfinite(own[[0, -1]])
    assert tuple(ends) == tips
    assert np.isfinite(own).mean() == pytest.approx(1 - 14 / 400 * (2 - sum(tips)), abs=0.02)


def test_a_chain_that_no_depth_camera_saw_has_no_readings() -> None:
    for scene in (cloud_scene(chain().joints), image_scene(MASK)):
        assert readings_along(chain(), scene, (True, True)) is None


def test_a_chain_that_leaves_the_image_is_read_inside() -> None:
    given = chain()
    out = replace(given, joints=given.joints + np.array([0.3, 0.0, 0.0]))
    assert np.isnan(readings_along(out, seen(), (True, True))[0, -1]).all()


def test_a_chain_whose_depth_was_measured_needs_no_readings() -> None:
    measured = replace(chain(), depth_filled=np.arange(SEGMENTS) < SEGMENTS // 10)
    assert readings_along(measured, seen(), (True, True)) is None
