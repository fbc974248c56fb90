"""Sequences of the TUM RGB-D benchmark."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from builders.errors import refused
from builders.sample_scene import LINE, POSE, assert_detected, check, put, scene, units

from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.formats.trajectory import associate

OWN = ReadOptions(camera=scene().pinhole)


def listed(path: Path, times, folder: str) -> None:
    path.write_text(f"# {folder} images\n# file\n# timestamp filename\n" + "".join(f"{t} {folder}/{t}.png\n" for t in times))


@pytest.fixture
def sequence(tmp_path):
    """Write four depth images, color images 10 ms after the first three, and one more in between."""
    folder = tmp_path / "rgbd_dataset_freiburg1_cable"
    depth, color = ("100.000000", "100.033333", "100.066667", "100.2"), ("100.010000", "100.024000", "100.043333", "100.076667")
    listed(folder_of(folder) / "depth.txt", depth, "depth")
    listed(folder / "rgb.txt", color, "rgb")
    for time in depth:
        put(folder / "depth" / f"{time}.png", units(5000))
    for time in color:
        put(folder / "rgb" / f"{time}.png", scene().color)
    (folder / "groundtruth.txt").write_text(f"# ground truth\n99.995 {LINE}\n100.005 {LINE}\n100.07 {LINE}\n")
    return folder


def folder_of(path: Path) -> Path:
    path.mkdir(parents=True, exist_ok=True)
    return path


def test_depth_color_camera_and_pose(sequence):
    opened = open_capture(sequence, options=OWN)
    assert opened.format == "tum"
    assert [frame_ref.name for frame_ref in opened.frames] == ["100.000000", "100.033333", "100.066667"]
    assert [frame_ref.timestamp for frame_ref in opened.frames] == [100.0, 100.033333, 100.066667]
    first, second, third = (frame_ref.load() for frame_ref in pickle.loads(pickle.dumps(opened.frames)))
    check(first, 1 / 5000)
    assert first.data.timestamp == 100.0
    assert np.allclose(first.pose, POSE)
    assert second.pose is not None  # 28 ms after the second line
    assert np.allclose(third.pose, POSE)
    assert_detected(third)


def test_default_camera_of_the_benchmark(sequence):
    sequence = sequence.rename(sequence.with_name("cable"))
    camera = open_capture(sequence).frames[0].load().data.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (525, 525, 319.5, 239.5)
    assert ["default" in note for note in open_capture(sequence).notes] == [True]
    assert open_capture(sequence, options=ReadOptions(depth_scale=2500)).frames[0].load().data.depth.max() == pytest.approx(
        1.478, abs=1e-3
    )


def test_color_is_paired_with_depth_by_time(sequence):
    for i, file in enumerate(sorted((sequence / "rgb").iterdir())):
        put(file, np.full((480, 640, 3), 10 * i, np.uint8))
    loaded_frames = [frame_ref.load() for frame_ref in open_capture(sequence).frames]
    assert [int(loaded.data.color[0, 0, 0]) for loaded in loaded_frames] == [0, 10, 30]  # 9 ms are nearer than 10


def test_each_image_is_in_one_pair_nearest_first():
    pairs = associate(np.array([0.0, 0.02, 1.0]), np.array([0.015, 0.03, 2.0]), 0.03)
    assert pairs == [(0, 1), (1, 0)]
    assert not associate(np.array([0.0]), np.array([1.0]), 0.5)


def test_association_equals_that_of_all_pairs():
    """Compare with the benchmark's algorithm: all pairs, sorted by their difference."""
    rng = np.random.default_rng(3)
    one, other = np.sort(rng.uniform(0, 5, 150)), np.sort(rng.uniform(0, 5, 140))
    every = sorted((abs(a - b), i, j) for i, a in enumerate(one) for j, b in enumerate(other) if abs(a - b) <= 0.03)
    expected, left, right = [], set(), set()
    for _, i, j in every:
        if i not in left and j not in right:
            left.add(i)
            right.add(j)
            expected.append((i, j))
    assert associate(one, other, 0.03) == sorted(expected)


def test_depth_without_color(sequence):
    (sequence / "rgb.txt").unlink()
    frames = open_capture(sequence).frames
    assert len(frames) == 4
    assert frames[3].load().data.color is None
    assert frames[3].load().pose is None


def test_results_are_named_by_time(sequence, doo3d, tmp_path):
    code, _, err = doo3d(
        "detect", sequence, "-o", tmp_path / "out", "--input-option", f"camera={list(map(float, scene().pinhole))}"
    )
    assert code == 0, err
    assert (tmp_path / "out" / "100.033333.json").is_file()


# --- what cannot be read -----------------------------------------------------------------------------------------------


def test_lists_without_overlap(sequence):
    listed(sequence / "rgb.txt", ["200.0", "200.1"], "rgb")
    refused(sequence, "times-apart", "depth.txt", "100.0 to 100.2 s", "rgb.txt", "200.0", "0.03 s", "tolerance")


def test_missing_list_of_depth(sequence):
    (sequence / "depth.txt").unlink()
    refused(sequence, "file-missing", "depth.txt")


@pytest.mark.parametrize("name", ["depth.txt", "rgb.txt"])
def test_lists_that_are_not_sorted(sequence, name):
    before = [frame_ref.name for frame_ref in open_capture(sequence).frames]
    lines = (sequence / name).read_text().splitlines()
    (sequence / name).write_text("\n".join([*lines[:3], lines[-1], *lines[3:]]))  # the last comes first, and is double
    opened = open_capture(sequence)
    assert [frame_ref.name for frame_ref in opened.frames] == before
    assert f"lines of {name} are not in order of time (line 5" in opened.notes[0]
    assert f"1 lines of {name} have the time" in opened.notes[1]


def test_the_calibrations_of_freiburg_by_name(sequence):
    for name, fx in (("freiburg1", 517.3), ("freiburg2", 520.9), ("freiburg3", 535.4)):
        sequence = sequence.rename(sequence.with_name(f"rgbd_dataset_{name}_cable"))
        opened = open_capture(sequence)
        assert opened.frames[0].load().data.camera.fx == fx
        assert opened.notes == [f"the camera is the benchmark's calibration of {name}"]


def test_a_camera_file_beside_the_lists(sequence):
    (sequence / "camera.yaml").write_text("fx: 610\nfy: 611\ncx: 320\ncy: 240\ndepth_scale: 0.0002\n")
    opened = open_capture(sequence)
    check(opened.frames[0].load(), 1 / 5000, (610, 611, 320, 240))
    assert opened.notes == ["the camera is read from camera.yaml"]


def test_broken_lists(sequence):
    (sequence / "rgb.txt").write_text("100.0 rgb/100.0.png\n100.1\n")
    refused(sequence, "line-invalid", "rgb.txt: line 2")
    (sequence / "rgb.txt").write_text("# nothing\n")
    refused(sequence, "file-empty", "rgb.txt")


def test_images_missing_truncated_and_of_another_size(sequence):
    depth = sequence / "depth" / "100.000000.png"
    depth.write_bytes(depth.read_bytes()[:2000])
    (sequence / "rgb" / "100.024000.png").unlink()
    put(sequence / "rgb" / "100.076667.png", scene().color[:240])
    refused(sequence, "file-damaged", "100.000000.png", index=0)
    refused(sequence, "file-missing", "100.024000.png", index=1)
    refused(sequence, "color-size", "640x240", "640x480", index=2)


def test_default_camera_is_for_one_image_size(sequence):
    put(sequence / "depth" / "100.000000.png", units(5000)[::2, ::2])
    refused(sequence, "intrinsics-size", "320x240", "640x480", "camera=", index=0)


@pytest.mark.parametrize("scale", [2.0, 5e6])
def test_implausible_unit(sequence, scale):
    refused(sequence, "depth-unit", "100.000000.png", "depth_scale", index=0, options=ReadOptions(depth_scale=scale))
