"""Folders as RealSense's Viewer and recorders of robots' data write them."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.captures import FOCAL, HEIGHT, MATRIX, WIDTH, rope, save
from builders.errors import refused, refuses

from doo3d.inputs import open_capture

COLOR, DEPTH, MASK = rope()
METRES = DEPTH / 1000
SNAPSHOT = f"""Stream,Depth
Frame Number,55
Resolution x,{WIDTH}
Resolution y,{HEIGHT}
Bytes per pixel,2

Intrinsic:,
Fx,{FOCAL:f}
Fy,{FOCAL:f}
PPx,161.5
PPy,118.0
Distorsion,Brown Conrady
"""


def save_snapshot(folder: Path, name: str = "snap", color: np.ndarray = COLOR) -> Path:
    """What the Viewer's button writes: 16 bits without a header, a colored preview, the color, and the numbers of the depth."""
    folder.mkdir(exist_ok=True)
    (folder / f"{name}_Depth.raw").write_bytes(DEPTH.tobytes())
    save(folder / f"{name}_Depth.png", cv2.applyColorMap((DEPTH >> 2).astype(np.uint8), cv2.COLORMAP_JET))
    save(folder / f"{name}_Color.png", color)
    (folder / f"{name}_Depth_metadata.csv").write_text(SNAPSHOT)
    return folder


def save_camera(folder: Path) -> None:
    (folder / "camera_intrinsic.json").write_text(
        f'{{"width": {WIDTH}, "height": {HEIGHT}, "intrinsic_matrix": {MATRIX}, "depth_scale": 1000}}'
    )


def check(path: Path, with_color: bool = True):
    capture = open_capture(path)
    frame = capture[0].load().data
    assert np.array_equal(frame.depth, METRES.astype(np.float32))
    assert (frame.color is not None) == with_color
    if with_color:
        assert np.array_equal(frame.color, COLOR[:, :, ::-1])
    return capture, frame.camera


@pytest.mark.parametrize("file", ["", "snap_Depth.raw"])
def test_snapshot_of_the_viewer(tmp_path, file):
    camera = check(save_snapshot(tmp_path) / file)[1]
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (FOCAL, FOCAL, 161.5, 118.0)


def test_snapshots_in_one_folder(tmp_path):
    save_snapshot(tmp_path, "a")
    capture = open_capture(save_snapshot(tmp_path, "b"))
    assert [frame.name for frame in capture] == ["a", "b"]
    assert all(frame.load().data.color is not None for frame in capture)


def test_color_of_another_size_is_not_aligned_to_a_snapshot(tmp_path):
    capture, _ = check(save_snapshot(tmp_path, color=np.repeat(COLOR, 2, axis=1)), with_color=False)
    assert any("does not align" in note for note in capture.notes)


@pytest.mark.parametrize(
    ("content", "numbers", "code"),
    [
        (DEPTH.tobytes()[:-1], SNAPSHOT, "file-damaged"),
        (DEPTH.tobytes() + b"\0", SNAPSHOT, "size-too-large"),
        (b"", SNAPSHOT, "file-damaged"),
        (b"", SNAPSHOT.replace(f"x,{WIDTH}", f"x,{10**9}"), "size-too-large"),
        (DEPTH.tobytes(), SNAPSHOT.replace("Resolution", "Size"), "intrinsics-missing"),
        (DEPTH.tobytes(), SNAPSHOT.replace(f"Fx,{FOCAL:f}", "Fx,-1"), "intrinsics-invalid"),
    ],
)
def test_damaged_snapshot(tmp_path, content, numbers, code):
    folder = save_snapshot(tmp_path)
    (folder / "snap_Depth.raw").write_bytes(content)
    (folder / "snap_Depth_metadata.csv").write_text(numbers)
    with refuses(code, "snap_Depth"):  # the camera is read when it is opened
        open_capture(folder)[0].load()


@pytest.mark.parametrize(
    ("color", "depth"),
    [
        ("cam_high", "cam_high_depth"),
        ("cam_high_rgb", "cam_high_depth"),
        ("observation.images.top", "observation.images.top_depth"),
    ],
)
def test_color_folder_without_a_word_for_color(tmp_path, color, depth):
    save(tmp_path / color / "image_0.png", COLOR)
    save(tmp_path / depth / "image_0.png", DEPTH)
    save(tmp_path / "a_rgb" / "image_0.png", COLOR[::-1])  # of another camera
    save_camera(tmp_path)
    check(tmp_path)
    check(tmp_path / depth)
    check(tmp_path / depth / "image_0.png")


def test_several_cameras_are_named(tmp_path):
    for name, image in (("cam_a", COLOR), ("cam_b", COLOR[::-1])):
        save(tmp_path / name / "0.png", image)
        save(tmp_path / f"{name}_depth" / "0.png", DEPTH)
    save_camera(tmp_path)
    notes = check(tmp_path)[0].notes
    assert any("cam_a_depth is read" in note and "cam_b_depth" in note for note in notes)


def save_replicator(
    folder: Path, name: str = "distance_to_image_plane", metres: np.ndarray = METRES, apart: bool = False
) -> Path:
    """What BasicWriter writes: side by side, or each annotator `apart` in a folder of its name."""
    parts = {
        "rgb": ("png", np.dstack([COLOR, np.full(DEPTH.shape, 255, np.uint8)])),
        "semantic_segmentation": ("png", np.full((*DEPTH.shape, 4), 200, np.uint8)),
        name: ("npy", metres.astype(np.float32)),
    }
    for part, (suffix, image) in parts.items():
        file = folder / (part if apart else "") / f"{part}_0000.{suffix}"
        file.parent.mkdir(parents=True, exist_ok=True)
        np.save(file, image) if suffix == "npy" else save(file, image)
    values = {
        "cameraFocalLength": 2 * FOCAL / WIDTH * 10,
        "cameraAperture": [20, 15.29],
        "renderProductResolution": [WIDTH, HEIGHT],
    }
    file = folder / ("camera_params" if apart else "") / "camera_params_0000.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(values))
    return folder


@pytest.mark.parametrize("apart", [False, True])
def test_replicator(tmp_path, apart):
    capture, camera = check(save_replicator(tmp_path, apart=apart))
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2)
    assert capture[0].load().mask is None


@pytest.mark.parametrize("apart", [False, True])
def test_distances_along_the_rays(tmp_path, apart):
    u, v = np.meshgrid(np.arange(WIDTH) - WIDTH / 2, np.arange(HEIGHT) - HEIGHT / 2)
    distance = METRES * np.sqrt(1 + (u / FOCAL) ** 2 + (v / FOCAL) ** 2)
    distance[0, 0] = np.inf  # nothing there
    capture = open_capture(save_replicator(tmp_path, "distance_to_camera", distance, apart))
    depth = capture[0].load().data.depth
    assert np.abs(depth - METRES)[1:].max() < 1e-6
    assert depth[0, 0] == 0
    assert any("distance_to_camera" in note for note in capture.notes)
    check(save_replicator(tmp_path, apart=apart))  # the depth goes first


@pytest.mark.parametrize("change", [{"cameraFocalLength": 0}, {"cameraAperture": []}, {"renderProductResolution": ["a", 1]}])
def test_damaged_camera_of_replicator(tmp_path, change):
    file = save_replicator(tmp_path) / "camera_params_0000.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    refused(tmp_path, "intrinsics-invalid", "camera_params_0000.json")


def save_exr(folder: Path, channels: dict[str, np.ndarray]) -> Path:
    openexr = pytest.importorskip("OpenEXR")
    save(folder / "rgb" / "0.png", COLOR)
    save_camera(folder)
    (folder / "depth").mkdir()
    openexr.File({}, channels).write(str(folder / "depth" / "0.exr"))
    return folder


@pytest.mark.parametrize(
    "channels",
    [
        {"R": METRES},
        {"R": METRES, "G": METRES, "B": METRES},
        {"ViewLayer.Combined.R": 0 * METRES, "ViewLayer.Combined.G": METRES + 1, "ViewLayer.Depth.Z": METRES},
    ],
)
def test_depth_in_exr(tmp_path, channels):
    check(save_exr(tmp_path, {name: image.astype(np.float32) for name, image in channels.items()}))


def test_exr_without_depth(tmp_path):
    folder = save_exr(tmp_path, {"R": METRES.astype(np.float32), "G": METRES.astype(np.float32) + 1})
    refused(folder, "depth-shape", "0.exr", "R", "G", index=0)


def test_damaged_exr(tmp_path):
    file = save_exr(tmp_path, {"R": METRES.astype(np.float32)}) / "depth" / "0.exr"
    content = file.read_bytes()
    huge = content.replace(struct.pack("<4i", 0, 0, WIDTH - 1, HEIGHT - 1), struct.pack("<4i", 0, 0, 1 << 20, 1 << 20))
    (frame,) = open_capture(tmp_path)
    for broken, code in (
        (content[: len(content) // 2], "file-damaged"),
        (content[:20], "file-damaged"),
        (huge, "size-too-large"),
    ):
        file.write_bytes(broken)
        with refuses(code, "0.exr"):
            frame.load()
