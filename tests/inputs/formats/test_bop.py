"""Scenes of the BOP benchmark."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest
from builders.errors import refused
from builders.sample_scene import POSE, assert_detected, check, put, scene, units

from doo3d.inputs import ReadOptions, open_capture


def frame_ref(**changes):
    fx, fy, cx, cy = scene().pinhole
    turn = POSE[:3, :3].T
    given = {
        "cam_K": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        "depth_scale": 0.1,
        "cam_R_w2c": turn.ravel().tolist(),
        "cam_t_w2c": (-turn @ POSE[:3, 3] * 1000).tolist(),
        "view_level": 0,
    } | changes
    return {key: value for key, value in given.items() if value is not None}


@pytest.fixture
def make(tmp_path):
    """Return a function that writes a scene of three images with changes to the camera of the second."""

    def write(**changes):
        folder = tmp_path / "test" / "000002"
        for i in (0, 1, 12):
            put(folder / "depth" / f"{i:06d}.png", units(10000))
            put(folder / "rgb" / f"{i:06d}.png", scene().color)
        cameras = {"0": frame_ref(), "1": frame_ref(**changes), "12": frame_ref(depth_scale=0.2), "13": frame_ref()}
        (folder / "scene_camera.json").write_text(json.dumps(cameras))
        return folder

    return write


def test_depth_color_camera_and_pose(make):
    opened = open_capture(make())
    assert opened.format == "bop"
    assert [frame.name for frame in opened.frames] == ["000000", "000001", "000012"]
    first, _, last = (frame.load() for frame in pickle.loads(pickle.dumps(opened.frames)))
    check(first, 1 / 10000)
    assert np.allclose(first.pose, POSE)
    assert first.mask is None
    assert last.data.depth.max() == pytest.approx(2 * first.data.depth.max())
    assert_detected(first)


def test_masks_are_the_visible_parts_of_all_objects(make):
    folder = make()
    left = np.arange(640) < 320
    put(folder / "mask_visib" / "000001_000000.png", scene().mask & left)
    put(folder / "mask_visib" / "000001_000001.png", scene().mask & ~left)
    put(folder / "mask_visib" / "000000_000000.png", np.zeros((480, 640), bool))
    put(folder / "mask_visib" / "000012_000000.png", np.ones((480, 640), bool))
    nothing, loaded, everything = (frame.load() for frame in open_capture(folder).frames)
    assert np.array_equal(loaded.mask, scene().mask)
    assert nothing.mask is None
    assert everything.mask is None
    assert_detected(loaded)


def test_grey_images_and_none(make):
    folder = make()
    (folder / "rgb").rename(folder / "gray")
    for file in (folder / "gray").iterdir():
        put(file, scene().color[..., 1])
    assert np.array_equal(open_capture(folder).frames[0].load().data.color[..., 2], scene().color[..., 1])
    (folder / "gray").rename(folder / "other")
    assert open_capture(folder).frames[0].load().data.color is None


def test_a_scene_without_poses(make):
    assert open_capture(make(cam_R_w2c=None)).frames[1].load().pose is None


def test_options_take_precedence(make):
    loaded = open_capture(make(cam_K=None, depth_scale=None), options=ReadOptions(camera=(500, 501, 300, 200), depth_scale=5000))
    camera = loaded.frames[1].load().data.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (500, 501, 300, 200)
    assert loaded.frames[1].load().data.depth.max() == pytest.approx(2 * scene().depth.max(), abs=1e-3)


def test_data_set_of_scenes_lists_them(make):
    refused(make().parent, "folder-of-captures", "000002")


# --- what cannot be read -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "code", "part"),
    [
        ({"cam_K": None}, "intrinsics-missing", "cam_K"),
        ({"cam_K": [500, 0, 320, 0, 500, 240, 0, 1, 1]}, "intrinsics-invalid", "cam_K"),
        ({"cam_K": [500, 0, 320, 0, -500, 240, 0, 0, 1]}, "intrinsics-invalid", "-500"),
        ({"cam_K": [500, 0, 320]}, "intrinsics-invalid", "cam_K"),
        ({"cam_K": "none"}, "intrinsics-invalid", "'none'"),
        ({"cam_K": [float("nan")] * 9}, "intrinsics-invalid", "cam_K"),
        ({"depth_scale": None}, "depth-scale-invalid", "None"),
        ({"depth_scale": 0}, "depth-scale-invalid", "depth_scale"),
        ({"depth_scale": "1"}, "depth-scale-invalid", "'1'"),
        ({"depth_scale": 1e-4}, "depth-unit", "000001.png"),
        ({"depth_scale": 1000.0}, "depth-unit", "000001.png"),
        ({"cam_R_w2c": [1, 0, 0, 0, 1, 0, 0, 0, 3]}, "pose-invalid", "cam_R_w2c"),
        ({"cam_t_w2c": [1, 2]}, "pose-invalid", "cam_t_w2c"),
    ],
)
def test_invalid_camera(make, changes, code, part):
    folder = make(**changes)
    refused(folder, code, part, *([] if code == "depth-unit" else ["image 1"]), index=1)
    assert open_capture(folder).frames[0].load().data.depth.any()


def test_images_without_a_partner_or_a_camera(make):
    folder = make()
    put(folder / "depth" / "000099.png", units(10000))
    (folder / "rgb" / "000001.png").unlink()
    (folder / "depth" / "000012.png").unlink()
    put(folder / "rgb" / "000099.png", scene().color)
    refused(folder, "color-missing", "rgb", "000001", index=1)
    refused(folder, "depth-missing", "000012", index=2)
    refused(folder, "intrinsics-missing", "scene_camera.json: image 99", index=3)


def test_files_of_another_size_and_truncated(make):
    folder = make()
    put(folder / "mask_visib" / "000000_000000.png", scene().mask[::2, ::2])
    put(folder / "rgb" / "000001.png", scene().color[::2])
    depth = folder / "depth" / "000012.png"
    depth.write_bytes(depth.read_bytes()[:-100])
    refused(folder, "mask-shape", "000000_000000.png", "320x240", "640x480", index=0)
    refused(folder, "color-size", "640x240", "640x480", index=1)
    refused(folder, "file-damaged", "000012.png", index=2)


@pytest.mark.parametrize("text", ["", "{", '{"0": {"cam_K": [1, 2', "[1, 2]", "\xff"])
def test_broken_json(make, text):
    folder = make()
    (folder / "scene_camera.json").write_text(text, encoding="latin-1")
    refused(folder, "json-invalid", "scene_camera.json")


def test_no_depth(make):
    folder = make()
    (folder / "depth").rename(folder / "other")
    refused(folder, "folder-empty", str(folder / "depth"))
