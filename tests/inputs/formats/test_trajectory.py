"""Poses from a file for captures without poses."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from builders.errors import refused, refuses
from builders.sample_scene import LINE, POSE, put

from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.formats.trajectory import read_trajectory

TURNED = "0.3 -2.0 3.0 0 0 0.70710678 0.70710678"  # a quarter round z


def write(path, *lines):
    path.write_text("# time tx ty tz qx qy qz qw\n" + "".join(f"{line}\n" for line in lines))
    return path


def test_a_pose_is_camera_to_world(tmp_path):
    found = read_trajectory(write(tmp_path / "a.txt", f"1.0 {LINE}", f"2.0,{LINE.replace(' ', ',')}"))
    assert found.times.tolist() == [1.0, 2.0]
    assert np.allclose(found.poses, POSE, atol=1e-12)


def test_interpolation_between_two_poses(tmp_path):
    found = read_trajectory(write(tmp_path / "a.txt", "1.0 0.1 -2.0 3.0 0 0 0 1", f"1.1 {TURNED}"))
    pose = found.at(1.05, 0.06)
    assert np.allclose(pose[:3, 3], (0.2, -2.0, 3.0))
    assert np.allclose(pose[:2, :2], [[np.sqrt(0.5), -np.sqrt(0.5)], [np.sqrt(0.5), np.sqrt(0.5)]])
    assert np.allclose(found.at(1.025, 0.03)[:3, 3], (0.1, -2.0, 3.0))  # one alone is near
    assert found.at(1.1, 0)[0, 3] == 0.3
    assert found.at(1.05, 0.04) is None
    assert found.at(0.9, 0.04) is None
    assert found.at(9, 0.04) is None


def test_match_by_order_if_frames_have_no_times(capture, tmp_path):
    file = write(tmp_path / "a.txt", f"10 {LINE}", f"20 {TURNED}")
    opened = open_capture(capture(frames=2), options=ReadOptions(trajectory=file))
    frame_refs = pickle.loads(pickle.dumps(opened.frames))
    assert np.allclose(frame_refs[0].load().pose, POSE)
    assert frame_refs[1].load().pose[0, 3] == 0.3
    assert opened.format == "folder"
    refused(capture("capture3", frames=3), "frame-count", "a.txt: has 2", "capture3 has 3", options=ReadOptions(trajectory=file))


def test_match_by_time_with_external_masks(tmp_path):
    np.savez(tmp_path / "a.npz", depth=np.full((3, 4, 5), 700), K=np.diag([5.0, 5, 1]), timestamps=[1.0, 2.0, 3.0])
    masks = tmp_path / "masks"
    put(masks / "000001.png", np.eye(4, 5, dtype=bool))
    file = write(tmp_path / "a.txt", f"1.99 {LINE}", f"2.99 {TURNED}")
    opened = open_capture(tmp_path / "a.npz", masks=masks, options=ReadOptions(trajectory=file))
    loaded = opened.frames[1].load()
    assert np.allclose(loaded.pose, POSE)
    assert loaded.mask.sum() == 4
    assert open_capture(tmp_path / "a.npz", options=ReadOptions(trajectory=file)).frames[0].load().pose is None


def test_times_without_overlap(tmp_path):
    np.savez(tmp_path / "a.npz", depth=np.full((3, 4, 5), 700), K=np.diag([5.0, 5, 1]), timestamps=[1.0, 2.0, 3.0])
    file = write(tmp_path / "a.txt", f"1305031453.3 {LINE}")
    with refuses("times-apart", "a.txt", "1305031453.3", "1.0 to 3.0 s", "tolerance"):
        open_capture(tmp_path / "a.npz", options=ReadOptions(trajectory=file))


def test_lines_that_are_not_sorted_or_double(tmp_path):
    np.savez(tmp_path / "a.npz", depth=np.full((2, 4, 5), 700), K=np.diag([5.0, 5, 1]), timestamps=[1.0, 2.0])
    file = write(tmp_path / "a.txt", f"2.0 {TURNED}", f"1.0 {LINE}", f"1.0 {TURNED}")
    opened = open_capture(tmp_path / "a.npz", options=ReadOptions(trajectory=file))
    assert np.allclose(opened.frames[0].load().pose, POSE)
    assert [note.partition(":")[0] for note in opened.notes] == [
        "the lines of a.txt are not in order of time (line 3 is the first too early)",
        "1 lines of a.txt have the time of an earlier line",
    ]


@pytest.mark.parametrize(
    ("lines", "code", "parts"),
    [
        ([], "file-empty", []),
        (["1.0 0 0 0"], "line-invalid", ["line 2", "4"]),
        ([f"x {LINE}"], "line-invalid", ["line 2", "'x'"]),
        (["1.0 0 0 0 nan 0 0 1"], "line-invalid", ["line 2", "'nan'"]),
        (["1.0 0 0 0 1 2 3 4"], "pose-invalid", ["line 2", "5.48"]),
        (["1.0 0 0 0 0 0 0 0"], "pose-invalid", ["line 2"]),
    ],
)
def test_broken(capture, tmp_path, lines, code, parts):
    file = write(tmp_path / "a.txt", *lines)
    refused(capture(), code, "a.txt", *parts, options=ReadOptions(trajectory=file))


def test_binary_and_missing_file(capture, tmp_path):
    (tmp_path / "a.txt").write_bytes(bytes(range(128, 256)))
    refused(capture(), "file-not-text", "a.txt", options=ReadOptions(trajectory=tmp_path / "a.txt"))
    refused(capture("other"), "file-missing", "b.txt", options=ReadOptions(trajectory=tmp_path / "b.txt"))
