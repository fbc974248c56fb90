"""Segmentation: the mask or method that decides, and the data that are refused."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from builders.blue_cable import BLUE, DEPTH, RADIUS, SEEN, frame, painted, scene_of
from builders.drawn_masks import CAMERA, frame_of, surface, wave
from builders.errors import refuses
from builders.paths import SAMPLES

from doo3d.config import SegmentConfig
from doo3d.types import CameraView, Cloud, Frame, Image

CONFIG = SegmentConfig()


def test_the_given_mask_replaces_the_method():
    half = SEEN.copy()
    half[:, 320:] = False
    found = scene_of(frame(color=painted(SEEN)), BLUE, half)
    assert not found.mask[:, 320:].any()
    assert found.mask.any()
    found = scene_of(frame(), SegmentConfig(method="mask"), half.astype(np.uint8) * 255)
    np.testing.assert_array_equal(found.mask, half)


def test_an_empty_mask():
    with refuses("mask-empty"):
        scene_of(frame(), CONFIG, np.zeros_like(SEEN))
    with refuses("mask-empty"):
        scene_of(Cloud(surface(wave(), RADIUS)), CONFIG, np.zeros(len(surface(wave(), RADIUS)), bool))


@pytest.mark.parametrize("mask", [None, SEEN])
def test_no_depth(mask):
    with refuses("depth-none"):
        scene_of(frame(0 * DEPTH), CONFIG, mask)


def test_no_depth_in_the_mask():
    with refuses("mask-without-depth", "black and shiny"):
        scene_of(frame(np.where(SEEN, 0, 0.6)), CONFIG, SEEN)
    wide = cv2.dilate(SEEN.astype(np.uint8), np.ones((17, 17), np.uint8)) > 0
    with refuses("mask-without-depth", "black and shiny"):
        scene_of(frame(np.where(wide, 0, 0.6)), CONFIG, SEEN)
    elsewhere = np.zeros(SEEN.shape)
    elsewhere[:5] = 0.6
    with refuses("mask-without-depth", "aligned"):
        scene_of(frame(elsewhere), CONFIG, SEEN)


@pytest.mark.parametrize("mask", [None, SEEN])
@pytest.mark.parametrize("factor", [1000, 1e-3, 1e6])
def test_depth_in_the_wrong_unit(factor, mask):
    with refuses("depth-unit", "depth_scale"):
        scene_of(frame(factor * DEPTH), CONFIG, mask)


@pytest.mark.parametrize("mask", [None, SEEN])
def test_depth_below_that_of_any_camera_is_none(mask):
    with refuses("depth-none", "in metres"):
        scene_of(frame(1e-6 * DEPTH), CONFIG, mask)


@pytest.mark.parametrize("mask", [SEEN[:-3], SEEN.T, SEEN[..., None], SEEN.ravel()])
def test_a_mask_of_another_shape(mask):
    with refuses("mask-shape", str(mask.shape), "(480, 640)"):
        scene_of(frame(), CONFIG, mask)


def test_a_missing_mask_is_refused():
    with refuses("mask-missing", "segment.method"):
        scene_of(frame(), SegmentConfig(method="mask"))


def test_an_empty_selection_is_a_note_and_no_error():
    found = scene_of(frame(color=painted(np.zeros_like(SEEN))), BLUE)
    assert found.points.shape == (0, 3)
    assert len(found.notes) == 1
    assert "segment.ranges" in found.notes[0]


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((1, 3)), np.ones((500, 3)), np.full((5, 3), np.nan)])
def test_clouds_without_extent(points):
    with refuses("cloud-without-extent"):
        scene_of(Cloud(points), CONFIG)


@pytest.mark.parametrize("factor", [1e4, 1e-4])
def test_clouds_in_the_wrong_unit(factor):
    with refuses("points-unit", "depth_scale"):
        scene_of(Cloud(factor * surface(wave(), RADIUS)), CONFIG)


def test_an_inverted_mask_is_noted():
    full = frame(np.full(DEPTH.shape, 0.7))
    (note,) = scene_of(full, CONFIG, ~SEEN).notes
    assert "is it inverted?" in note
    assert scene_of(full, CONFIG, SEEN).notes == ()
    rows, columns = np.indices(SEEN.shape)
    with_disk = np.hypot(rows - 60, columns - 60) > 30
    assert scene_of(full, CONFIG, with_disk).notes == ()


def test_a_long_cloud_names_the_setting():
    line = np.column_stack((np.linspace(0, 450, 2000), np.zeros((2000, 2))))
    with refuses("points-unit", "if it is that large, --set segment.max_depth="):
        scene_of(Cloud(line), CONFIG)


@pytest.mark.parametrize("value", [65.535, 1e4, 1e7])
def test_readings_beyond_the_range_are_none(value):
    """Saturated depth, with a mask and without."""
    lost = (np.random.default_rng(0).random(DEPTH.shape) < 0.05) & SEEN
    saturated, without = (Frame(painted(SEEN), np.where(lost, z, DEPTH), CAMERA) for z in (value, 0.0))
    for mask in (SEEN, None):
        assert np.array_equal(scene_of(saturated, CONFIG, mask).points, scene_of(without, CONFIG, mask).points)


def test_fused_views_of_poses_in_the_wrong_unit():
    view = CameraView(CAMERA, np.eye(4), SEEN, DEPTH)
    with refuses("points-unit", "poses"):
        scene_of(Cloud(1e4 * surface(wave(), RADIUS), views=(view,)), CONFIG)


def test_the_input_is_not_written_to():
    depth, mask = DEPTH.astype(np.float32), SEEN.copy()
    data = Frame(painted(SEEN), depth, CAMERA)
    scene_of(data, BLUE)
    scene_of(data, CONFIG, mask)
    np.testing.assert_array_equal(depth, DEPTH.astype(np.float32))
    np.testing.assert_array_equal(mask, SEEN)
    assert frame_of(wave(), radius=RADIUS)[1].sum() == SEEN.sum()


def test_strands_of_an_image_are_selected():
    file = SAMPLES / "crossing" / "color" / "000000.jpg"
    image = Image(np.ascontiguousarray(cv2.imread(str(file))[:, :, ::-1]))
    found = scene_of(image, SegmentConfig(max_width=np.inf, max_width_ratio=np.inf))
    assert found.mask.any()
    assert found.notes == ()
    assert scene_of(image, SegmentConfig(method="ridge", max_width=np.inf, max_width_ratio=np.inf)).notes == ()
    assert scene_of(image, SegmentConfig(), found.mask).notes == ()
