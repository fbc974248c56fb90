"""Bad input from the shell: one sentence with cause, place and remedy, exit code 2, nothing written."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.captures import save

DEPTH, COLOR, MASK = "depth/000000.png", "color/000000.jpg", "mask/000000.png"


def read(path: Path) -> np.ndarray:
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def put_metres(folder: Path, depth: np.ndarray) -> None:
    """Write the depth of the frame in metres, in place of that in millimetres."""
    (folder / DEPTH).unlink()
    save(folder / "depth" / "000000.tiff", depth.astype(np.float32))


def test_empty_mask(refused, capture):
    folder = capture(mask=True)
    save(folder / MASK, np.zeros((240, 320), np.uint8))
    assert "frame 000000" in refused(folder, code="mask-empty")


def test_no_depth_in_the_mask(refused, capture):
    folder = capture(mask=True)
    mask = read(folder / MASK)
    save(folder / DEPTH, np.where(mask > 0, 0, read(folder / DEPTH)).astype(np.uint16))
    sentence = refused(folder, code="mask-without-depth")
    assert "frame 000000" in sentence
    assert f" {np.count_nonzero(mask)} pixels" in sentence


@pytest.mark.parametrize("mask", [False, True])
@pytest.mark.parametrize("value", [np.nan, -0.5])
def test_depth_that_is_none_everywhere(refused, capture, value, mask):
    folder = capture(mask=mask)
    put_metres(folder, np.full((240, 320), value))
    assert "frame 000000" in refused(folder, code="depth-none")


@pytest.mark.parametrize("scale", [0.001, 1])
def test_depth_scale_in_metres_or_millimetres_per_unit(doo3d, capture, scale):
    assert doo3d("detect", capture(intrinsics={"depth_scale": scale}))[0] == 0


def test_depth_in_the_wrong_unit(refused, capture):
    assert "depth_scale" in refused(capture(intrinsics={"depth_scale": 1e6}), code="depth-unit")


def test_depth_and_color_of_different_sizes(refused, capture):
    folder = capture()
    save(folder / COLOR, np.zeros((480, 640, 3), np.uint8))
    assert "640x480" in refused(folder, code="color-size")


def test_no_intrinsics(refused, capture):
    folder = capture()
    (folder / "camera_intrinsic.json").unlink()
    assert "camera_intrinsic.json" in refused(folder, code="intrinsics-missing")


def test_truncated_png(refused, capture):
    folder = capture()
    (folder / DEPTH).write_bytes((folder / DEPTH).read_bytes()[:-40])
    assert "000000.png" in refused(folder, code="file-damaged")


def test_truncated_ply(refused):
    header = "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    Path("a.ply").write_text(header + "0 0 1\n" * 4)
    assert "a.ply" in refused("a.ply", code="file-damaged")


def test_folder_without_frames(refused, capture):
    assert "depth" in refused(capture(frames=0), code="folder-empty")


@pytest.mark.parametrize(("name", "code"), [("nowhere", "file-missing"), (".", "folder-empty")])
def test_no_capture(refused, name, code):
    assert f"doo3d: {name}" in refused(name, code=code)


@pytest.mark.parametrize(
    ("args", "code", "part"),
    [
        (["--set", "merge.chain=2"], "key-unknown", "merge.chains"),
        (["--set", "merge.chains=0"], "value-out-of-bounds", "merge.chains"),
        (["--set", "merge.chains"], "override-invalid", "merge.chains"),
        (["-c", "paper_4d"], "preset-unknown", "'paper_4d'"),
        (["-c", "nowhere.yaml"], "file-missing", "nowhere.yaml"),
    ],
)
def test_invalid_settings(refused, capture, args, code, part):
    assert part in refused(capture(), *args, code=code)


def cloud(points) -> str:
    np.savez("cloud.npz", points=points)
    return "cloud.npz"


@pytest.mark.parametrize("points", [np.ones((1, 3)), np.ones((5000, 3))], ids=["one point", "coincident"])
def test_clouds_without_extent(refused, tmp_path, points):
    assert f"{len(points)} " in refused(cloud(points), code="cloud-without-extent")


def test_wrong_usage_is_exit_code_2(doo3d):
    assert doo3d("detect")[0] == 2
    assert doo3d("detct")[0] == 2
