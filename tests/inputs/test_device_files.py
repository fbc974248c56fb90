"""Files of devices and tools: pointers of Git LFS, a bag whose color is too late, an E57 without scans, NPZ of other keys."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders.errors import refused
from builders.sample_scene import LENGTH, POSE, check, put, scene, units

from doo3d.inputs import ReadOptions, open_capture

DATA = Path(__file__).parents[3] / "shared" / "data" / "device_files"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the files of devices are not beside the checkout")
POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:b90a0af442bfc6aa\nsize 990\n"


@pytest.mark.parametrize("name", ["a.mcap", "a.bag", "a.db3", "a.npz", "a.ply", "a.png", "a.mp4", "a.r3d", "a.e57", "a.unknown"])
def test_a_pointer_of_git_lfs_instead_of_the_file(doo3d, tmp_path, name):
    (tmp_path / name).write_text(POINTER)
    code, _, err = doo3d("detect", name)
    assert code == 2
    for part in (name, "Git LFS", "git lfs pull", "[file-lfs-pointer]"):
        assert part in err


@pytest.mark.parametrize("name", ["depth/0.png", "rgb/0.png", "bag/a.mcap"])
def test_a_pointer_of_git_lfs_within_a_folder(tmp_path, name):
    if name.startswith("bag"):
        (tmp_path / "bag").mkdir()
        (tmp_path / name).write_text(POINTER)
        refused(tmp_path / "bag", "file-lfs-pointer", "a.mcap", "git lfs pull")
        return
    put(tmp_path / "depth" / "0.png", units(1000))
    put(tmp_path / "rgb" / "0.png", scene().color)
    (tmp_path / name).write_text(POINTER)
    refused(tmp_path, "file-lfs-pointer", name, "git lfs pull", index=0, options=ReadOptions(camera=scene().pinhole))


# --- NPZ of other keys -------------------------------------------------------------------------------------------------


def matrix() -> np.ndarray:
    fx, fy, cx, cy = scene().pinhole
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])


@pytest.mark.parametrize("color", ["color", "rgb", "image", "RGB", "color_image"])
@pytest.mark.parametrize("camera", ["K", "intrinsics", "camera_matrix", "intrinsic_matrix", "cam_K"])
def test_keys_of_npz(tmp_path, color, camera):
    np.savez(tmp_path / "a.npz", **{"depth": units(1000), color: scene().color, camera: matrix(), "poses": POSE[None]})
    loaded = open_capture(tmp_path / "a.npz").frames[0].load()
    check(loaded, 1 / 1000)
    assert np.allclose(loaded.pose, POSE)


@pytest.mark.parametrize("camera", [lambda: np.array(scene().pinhole), lambda: np.pad(matrix(), ((0, 1), (0, 1)))])
def test_intrinsics_of_four_numbers_or_four_rows(tmp_path, camera):
    stack = np.stack([units(1000)] * 2)
    np.savez(tmp_path / "a.npz", depths=stack, rgb=np.stack([scene().color] * 2), intrinsics=camera())
    for frame_ref in open_capture(tmp_path / "a.npz").frames:
        check(frame_ref.load(), 1 / 1000)


def test_detect_npz_with_the_camera_beside_it(doo3d, tmp_path):
    np.savez(tmp_path / "a.npz", depth=units(1000), rgb=scene().color)
    code, _, err = doo3d("detect", "a.npz", "-o", "out")
    assert code == 2
    assert "--camera FILE" in err
    (tmp_path / "camera.json").write_text(json.dumps({"K": matrix().tolist()}))
    code, _, err = doo3d("detect", "a.npz", "-o", "out")
    assert code == 0, err
    assert "note: the camera is read from camera.json" in err
    (chain,) = json.loads((tmp_path / "out" / "a.json").read_text())["chains"]
    assert abs(chain["length"] - LENGTH) < 0.03


def test_arrays_of_other_meaning_are_left_out(tmp_path):
    np.savez(tmp_path / "a.npz", depth=units(1000), K=matrix(), image=np.float64(3), color=scene().color, intrinsics="d435")
    check(open_capture(tmp_path / "a.npz").frames[0].load(), 1 / 1000)


# --- the files themselves ----------------------------------------------------------------------------------------------


@needs_data
def test_bag_of_the_realsense_sdk_whose_color_is_too_late(doo3d):
    code, out, err = doo3d("info", DATA / "realsense_sdk.bag")
    assert code == 0, err
    assert "0.102 s, so depth is read alone" in out
    assert "color" not in out.partition("content")[2].partition("\n")[0]
    assert len(open_capture(DATA / "realsense_sdk.bag").frames) == 2
    loaded = open_capture(DATA / "realsense_sdk.bag", options=ReadOptions(tolerance=0.2)).frames[0].load()
    assert loaded.data.color is not None


@needs_data
def test_tum_lists_of_a_script(doo3d):
    opened = open_capture(DATA / "tum_unsorted")
    times = [frame_ref.timestamp for frame_ref in opened.frames]
    assert len(times) == 17
    assert times == sorted(times)
    assert "depth.txt are not in order of time (line 7" in opened.notes[0]
    assert opened.frames[0].load().data.color is not None


@needs_data
def test_e57_without_scans(doo3d):
    code, _, err = doo3d("detect", DATA / "no_scans.e57")
    assert (code, "holds no scans" in err) == (2, True)


@needs_data
def test_pointer_of_git_lfs(doo3d):
    code, _, err = doo3d("detect", DATA / "git_lfs_pointer.mcap")
    assert (code, "git lfs pull" in err) == (2, True)


@needs_data
def test_depth_as_an_array_of_numpy(doo3d, tmp_path):
    assert "[intrinsics-missing]" in doo3d("info", DATA / "realsense_depth.npy")[2]
    (tmp_path / "camera.json").write_text(json.dumps({"fx": 920, "fy": 920, "cx": 640, "cy": 360, "width": 1280, "height": 720}))
    code, out, err = doo3d("info", DATA / "realsense_depth.npy", "--camera", "camera.json")
    assert code == 0, err
    assert "1280x720" in out
    assert "median 0.698 m" in out
