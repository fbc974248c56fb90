"""Frames that show nothing in space, and settings that are not for sequences."""

from __future__ import annotations

import numpy as np
import pytest

import doo3d
from doo3d.config import load_config
from doo3d.errors import InputError
from doo3d.track.detect_sequence import detect_sequence
from doo3d.track.first_pass import observe_frame
from doo3d.track.strand_ends import TIP, UNKNOWN

CAMERA = doo3d.Camera(400.0, 400.0, 160.0, 120.0, 320, 240)


def test_images_are_refused():
    with pytest.raises(InputError, match="followed in space"):
        detect_sequence([], load_config("image"))


def test_a_frame_without_depth_is_filled_and_one_that_cannot_be_used_is_refused():
    depth, mask = np.full((240, 320), 0.56), np.zeros((240, 320), dtype=bool)
    mask[116:124, 40:280] = True
    depth[mask] = 0.5
    frames = [doo3d.Frame(color=None, depth=each, camera=CAMERA) for each in (depth, depth, np.zeros_like(depth), depth)]
    nothing = np.zeros_like(mask)
    for masks in ([mask] * 4, [mask, mask, nothing, mask]):
        detections = detect_sequence(frames, masks=masks)
        assert [len(detection.chains) for detection in detections] == [1] * 4
        assert detections[2].chains[0].depth_filled.all()
        assert detections[2].chains[0].from_time.all() != masks[2].any()  # the image of a frame without depth counts, too
    with pytest.raises(InputError, match="depth_scale"):
        detect_sequence([doo3d.Frame(color=None, depth=1000 * depth, camera=CAMERA)], masks=[mask])


def test_a_cloud_without_points_is_filled():
    along = np.linspace(-0.2, 0.2, 4000)
    around = np.random.default_rng(0).uniform(0, np.pi, 4000)
    points = np.column_stack((along, 0.004 * np.cos(around), 0.6 - 0.004 * np.sin(around)))
    clouds = [doo3d.Cloud(each, segmented=True) for each in (points, points, points[:0], points)]
    detections = detect_sequence(clouds)
    assert [len(detection.chains) for detection in detections] == [1] * 4
    assert detections[2].chains[0].from_time.all()


@pytest.mark.parametrize("color", [None, np.zeros((3, 640, 3), dtype=np.uint8)], ids=["no color", "color"])
def test_frames_of_a_few_rows(color):
    """Of which a small view of the surroundings would have none."""
    frame = doo3d.Frame(color, np.full((3, 640), 0.5, dtype=np.float32), doo3d.Camera(500.0, 500.0, 320.0, 1.0, 640, 3))
    mask = np.zeros((3, 640), dtype=bool)
    mask[1, 100:500] = True
    assert len(detect_sequence([frame] * 2, masks=[mask] * 2)) == 2


@pytest.mark.parametrize("is_given", [True, False])
def test_the_number_of_objects_and_certain_tips_are_of_a_given_object_only(is_given):
    """Two strands 5 cm apart in one frame: parts of one cable if the mask is given, else one may be something else."""
    depth, mask = np.full((240, 320), 0.56), np.zeros((240, 320), dtype=bool)
    mask[116:124, 40:140] = mask[116:124, 180:280] = True
    depth[mask] = 0.5
    config = load_config("default", {"merge.chains": 1})
    seen = observe_frame(doo3d.Frame(color=None, depth=depth, camera=CAMERA), config, mask if is_given else None)
    assert len(seen.detection.chains) == (1 if is_given else 2)
    assert {tip for strand in seen.strands for tip in strand.tips} == {TIP if is_given else UNKNOWN}
    assert len(seen.strands) == 2
    assert seen.object_given == is_given
