"""Folders of the Redwood data sets and of ICL-NUIM, which have no file of intrinsics."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from builders.errors import refused
from builders.sample_scene import LINE, POSE, assert_detected, check, put, scene, units

from doo3d.inputs import ReadOptions, open_capture

OWN = ReadOptions(camera=scene().pinhole)
OTHER = np.array([[0, 0, 1, 5], [0, 1, 0, 6], [-1, 0, 0, 7], [0, 0, 0, 1.0]])


def log(path, *poses):
    """Return a pose in Redwood's format: three numbers, the last one that of the image from 1, then the matrix."""
    rows = [f"{n - 1}\t{n - 1}\t{n}\n" + "".join(" ".join(f"{x:.10f}" for x in row) + "\n" for row in pose) for n, pose in poses]
    path.write_text("".join(rows))
    return path


@pytest.fixture
def scan(tmp_path):
    """File names have number and microseconds; the color of the second depth image is missing."""
    folder = tmp_path / "scan"
    for name in ("0000001-000000000000", "0000002-000000033369", "0000003-000000066737"):
        put(folder / "depth" / f"{name}.png", units(1000))
    for name in ("0000001-000000004000", "0000002-000000070000"):
        put(folder / "rgb" / f"{name}.png", scene().color)
    return folder


@pytest.fixture
def indoor(tmp_path):
    folder = tmp_path / "indoor"
    for name in ("000001", "000002"):
        put(folder / "depth" / f"{name}.png", units(1000))
        put(folder / "image" / f"{name}.png", scene().color)
    log(folder / "trajectory.log", (1, POSE), (2, OTHER))
    return folder


@pytest.fixture
def icl(tmp_path):
    folder = tmp_path / "living_room_traj0_frei_png"
    for name in ("0", "1", "10"):
        put(folder / "depth" / f"{name}.png", units(5000))
        put(folder / "rgb" / f"{name}.png", scene().color)
    (folder / "associations.txt").write_text("0 depth/0.png 0 rgb/0.png\n")
    (folder / "livingRoom0.gt.freiburg").write_text(f"1 {LINE}\n2 {LINE}\n10 1 2 3 0 0 0 1\n")
    return folder


def test_names_with_times_pair_depth_and_color(scan):
    log(scan / "scan.log", (1, POSE), (3, OTHER))
    opened = open_capture(scan, options=OWN)
    assert opened.format == "redwood"
    assert [frame_ref.name for frame_ref in opened.frames] == ["0000001-000000000000", "0000003-000000066737"]
    assert [frame_ref.timestamp for frame_ref in opened.frames] == [0.0, 0.066737]
    one, other = (frame_ref.load() for frame_ref in pickle.loads(pickle.dumps(opened.frames)))
    check(one, 1 / 1000)
    assert np.allclose(one.pose, POSE)
    assert np.allclose(other.pose, OTHER)
    assert_detected(other)


def test_names_without_times_and_the_trajectory(indoor):
    opened = open_capture(indoor)
    assert opened.format == "redwood"
    assert [frame_ref.name for frame_ref in opened.frames] == ["000001", "000002"]
    assert opened.frames[0].timestamp is None
    check(opened.frames[1].load(), 1 / 1000, (525, 525, 319.5, 239.5))
    assert np.allclose(opened.frames[1].load().pose, OTHER)


def test_trajectory_is_preferred_among_logs(indoor):
    log(indoor / "odometry.log", (1, np.eye(4)))
    (indoor / "recorder.log").write_text("started\nstopped\n")
    assert np.allclose(open_capture(indoor).frames[0].load().pose, POSE)


def test_without_color_and_without_trajectory(scan):
    for file in (scan / "rgb").iterdir():
        file.unlink()
    (scan / "rgb").rmdir()
    opened = open_capture(scan)
    assert len(opened.frames) == 3
    loaded = opened.frames[1].load()
    assert loaded.data.color is None
    assert loaded.pose is None


def test_icl(icl):
    opened = open_capture(icl)
    assert opened.format == "icl"
    assert [frame_ref.name for frame_ref in opened.frames] == ["0", "1", "10"]
    zero, one, ten = (frame_ref.load() for frame_ref in opened.frames)
    check(ten, 1 / 5000, (481.2, 480, 319.5, 239.5))
    assert zero.pose is None
    assert np.allclose(ten.pose[:3, 3], (1, -2, 3))
    assert_detected(open_capture(icl, options=OWN).frames[0].load())
    # a point that the set's own camera (y up) sees at the same pixel is the same point of the mirrored world
    seen, flip = np.array([0.1, 0.2, 0.7, 1]), np.diag([1.0, -1, 1, 1])
    assert np.allclose(one.pose @ seen, flip @ POSE @ flip @ seen)
    assert np.linalg.det(one.pose[:3, :3]) == pytest.approx(1)


def test_folder_with_intrinsics_is_no_redwood(capture):
    folder = capture()
    log(folder / "trajectory.log", (1, POSE))
    (folder / "associations.txt").write_text("0 depth/0.png 0 rgb/0.png\n")
    assert open_capture(folder).format == "folder"


def test_folder_without_camera_is_not_guessed(capture):
    folder = capture()
    (folder / "camera_intrinsic.json").unlink()
    refused(folder, "intrinsics-missing", "camera_intrinsic.json", "camera=")


# --- what cannot be read -----------------------------------------------------------------------------------------------


def test_one_color_image_missing(indoor):
    (indoor / "image" / "000002.png").unlink()
    refused(indoor, "color-missing", "000002", index=1)


def test_no_depth(indoor, icl):
    for folder in (indoor, icl):
        for file in (folder / "depth").iterdir():
            file.unlink()
        refused(folder, "folder-empty", str(folder / "depth"))


def test_times_in_names_without_overlap(scan):
    for file in (scan / "rgb").iterdir():
        file.rename(file.with_name(file.name.replace("-0000", "-9000")))
    refused(scan, "times-apart", str(scan), "0.03 s")


@pytest.mark.parametrize("kept", [0.4, 0.6, 0.95])
def test_truncated_trajectory(indoor, kept):
    file = indoor / "trajectory.log"
    file.write_text(file.read_text()[: int(len(file.read_text()) * kept)])
    refused(indoor, "line-invalid", "trajectory.log: line ")


def test_invalid_pose_matrix(indoor):
    log(indoor / "trajectory.log", (1, 2 * POSE))
    refused(indoor, "pose-invalid", "trajectory.log: line 1")


def test_default_camera_is_for_one_image_size(indoor):
    put(indoor / "depth" / "000001.png", units(1000)[:240])
    refused(indoor, "intrinsics-size", "640x240", "640x480", index=0)
