"""Folders as ScanNet's exporter, 7-Scenes and Stray Scanner write them, and camera files of other images beside them."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from builders.errors import refused
from builders.sample_scene import LENGTH, POSE, assert_detected, check, put, scene, units

from doo3d.inputs import ReadOptions, open_capture

COLOR_SIZE = (1296, 968)
SCALES = COLOR_SIZE[0] / 640, COLOR_SIZE[1] / 480


def matrix_text(matrix: np.ndarray) -> str:
    return "\n".join(" ".join(f"{value:f}" for value in row) for row in matrix) + "\n"


def matrix_of(pinhole: tuple[float, ...]) -> np.ndarray:
    fx, fy, cx, cy = pinhole
    return np.array([[fx, 0, cx, 0], [0, fy, cy, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def color_pinhole() -> tuple[float, ...]:
    fx, fy, cx, cy = scene().pinhole
    (x, y) = SCALES
    return fx * x, fy * y, (cx + 0.5) * x - 0.5, (cy + 0.5) * y - 0.5


def scannet(folder: Path, frames: int = 2) -> Path:
    large = cv2.resize(scene().color, COLOR_SIZE, interpolation=cv2.INTER_CUBIC)
    for i in range(frames):
        put(folder / "depth" / f"{i}.png", units(1000))
        put(folder / "color" / f"{i}.jpg", large)
        (folder / "pose").mkdir(exist_ok=True)
        (folder / "pose" / f"{i}.txt").write_text(matrix_text(POSE if i != 1 else np.full((4, 4), -np.inf)))
    (folder / "intrinsic").mkdir()
    texts = {"intrinsic_depth": matrix_of(scene().pinhole), "intrinsic_color": matrix_of(color_pinhole())}
    texts |= {"extrinsic_depth": np.eye(4), "extrinsic_color": np.eye(4)}
    for name, matrix in texts.items():
        (folder / "intrinsic" / f"{name}.txt").write_text(matrix_text(matrix))
    return folder


def test_scannet(doo3d, tmp_path):
    opened = open_capture(scannet(tmp_path / "scan"))
    assert opened.format == "folder"
    loaded = opened.frames[0].load()
    check(loaded, 1 / 1000, color=4)
    assert_detected(loaded)
    np.testing.assert_allclose(loaded.pose, POSE, atol=1e-6)
    assert opened.frames[1].load().pose is None
    assert opened.notes == [
        f"the camera is read from {Path('intrinsic', 'intrinsic_depth.txt')}",
        "the color images (1296x968 px) are aligned to the depth images (640x480)",
    ]
    check(open_capture(tmp_path / "scan" / "depth" / "0.png").frames[0].load(), 1 / 1000, color=4)
    code, out, err = doo3d("detect", "scan", "-o", "out", "--frames", "0")
    assert code == 0, err
    (chain,) = json.loads((tmp_path / "out" / "0.json").read_text())["chains"]
    assert abs(chain["length"] - LENGTH) < 0.03
    assert "intrinsic_depth.txt" in out + err


def test_color_of_another_place_is_aligned_by_the_extrinsics(tmp_path):
    folder = scannet(tmp_path / "scan", frames=1)
    put(folder / "depth" / "0.png", np.full((480, 640), 500, np.uint16))
    ramp = np.zeros((COLOR_SIZE[1], COLOR_SIZE[0], 3), np.uint8)
    ramp[..., 0] = np.arange(COLOR_SIZE[0]) // 8
    (folder / "color" / "0.jpg").unlink()
    put(folder / "color" / "0.png", ramp)
    depth, color = np.eye(4), np.eye(4)
    depth[:3, 3], color[:3, 3] = (0.03, 0.2, 0), (-0.02, 0.2, 0)  # camera to device: the color camera is 5 cm to the left
    for name, matrix in (("extrinsic_depth", depth), ("extrinsic_color", color)):
        (folder / "intrinsic" / f"{name}.txt").write_text(matrix_text(matrix))
    found = open_capture(folder).frames[0].load().data.color[240, 100:500, 0].astype(float)
    fx, _, cx, _ = color_pinhole()
    x = (np.arange(100, 500) - scene().pinhole[2]) / scene().pinhole[0] * 0.5
    assert np.abs(found - (fx * (x + 0.05) / 0.5 + cx) / 8).max() <= 1


def test_color_of_unknown_place_is_refused_or_left_out(doo3d, tmp_path):
    folder = scannet(tmp_path / "scan", frames=1)
    (folder / "intrinsic" / "extrinsic_color.txt").unlink()
    code, _, err = doo3d("detect", "scan", "-o", "out")
    assert code == 2
    for part in ("1296x968", "640x480", "--input-option color=none", "extrinsic_color.txt", "[color-size]"):
        assert part in err
    code, _, err = doo3d("detect", "scan", "-o", "out", "--input-option", "color=none")
    assert code == 0, err
    (chain,) = json.loads((tmp_path / "out" / "0.json").read_text())["chains"]
    assert abs(chain["length"] - LENGTH) < 0.03
    assert open_capture(folder, options=ReadOptions(color="none")).frames[0].load().data.color is None


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("k7.json", {"width": 640, "height": 480}),  # of another project: a K in its name stands for anything
        ("robot.json", {"width": 640, "height": 480}),
        ("camera.json", {}),  # the camera of any images
        ("camera.json", {"width": 1280, "height": 720}),
    ],
)
def test_a_camera_of_others_in_the_folder_above_is_not_taken(tmp_path, name, values):
    fx, fy, cx, cy = scene().pinhole
    camera = {"fx": fx, "fy": fy, "cx": cx, "cy": cy}
    (tmp_path / name).write_text(json.dumps(camera | values))
    put(tmp_path / "scene" / "0_depth.png", units(1000))
    refused(tmp_path / "scene", "intrinsics-missing", "--camera FILE")


def test_a_camera_of_these_images_in_the_folder_above_is_taken(tmp_path):
    fx, fy, cx, cy = scene().pinhole
    (tmp_path / "camera.json").write_text(json.dumps({"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": 640, "height": 480}))
    put(tmp_path / "scene" / "0_depth.png", units(1000))
    opened = open_capture(tmp_path / "scene")
    assert opened.notes == [f"the camera is read from {tmp_path / 'camera.json'}"]
    assert_detected(opened.frames[0].load())


def test_a_camera_of_other_images_beside_the_images_is_refused(tmp_path):
    put(tmp_path / "0_depth.png", units(1000))
    (tmp_path / "camera.json").write_text(json.dumps({"fx": 605, "fy": 605, "cx": 640, "cy": 360}))
    refused(tmp_path, "intrinsics-size", "camera.json", "(640, 360)", "640x480", "--camera")
    assert open_capture(tmp_path, camera=tmp_path / "camera.json").frames[0].load().data.camera.cx == 640


def test_seven_scenes(tmp_path):
    for i in range(2):
        depth = units(1000)
        depth[:5] = 65535  # the data set's word for no measurement
        put(tmp_path / f"frame-{i:06d}.depth.png", depth)
        put(tmp_path / f"frame-{i:06d}.color.png", scene().color)
        (tmp_path / f"frame-{i:06d}.pose.txt").write_text("\t ".join(f"{value:.7e}" for value in POSE.ravel()) + "\n")
    opened = open_capture(tmp_path)
    assert "7-Scenes" in opened.notes[0]
    loaded = opened.frames[1].load()
    camera = loaded.data.camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (585, 585, 320, 240)
    assert not loaded.data.depth[:5].any()
    np.testing.assert_allclose(loaded.pose, POSE, atol=1e-6)
    own = open_capture(tmp_path, options=ReadOptions(camera=scene().pinhole)).frames[0].load()
    assert_detected(own)


def stray(folder: Path, frames: int = 3) -> Path:
    small = cv2.resize(units(1000), (256, 192), interpolation=cv2.INTER_NEAREST)
    large = cv2.resize(scene().color, (1280, 960))
    (folder / "depth").mkdir(parents=True)
    video = cv2.VideoWriter(str(folder / "rgb.mp4"), cv2.VideoWriter_fourcc(*"mp4v"), 30, (1280, 960))
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw"]
    for i in range(frames):
        put(folder / "depth" / f"{i:06d}.png", small)
        put(folder / "confidence" / f"{i:06d}.png", np.full((192, 256), 2, np.uint8))
        video.write(large[..., ::-1] // (i + 1))
        lines.append(f"{100 + i / 30}, {i:06d}, 0.1, -2.0, 3.0, 0.5, -0.5, 0.5, 0.5")
    video.release()
    (folder / "odometry.csv").write_text("\n".join(lines) + "\n")
    fx, fy, cx, cy = (2 * value for value in scene().pinhole)
    (folder / "camera_matrix.csv").write_text(f"{fx}, 0.0, {cx + 0.5}\n0.0, {fy}, {cy + 0.5}\n0.0, 0.0, 1.0\n")
    (folder / "imu.csv").write_text("timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n")
    return folder


def test_stray_scanner(tmp_path):
    opened = open_capture(stray(tmp_path / "71de12f9"))
    assert (opened.format, len(opened.frames), opened.notes) == ("stray", 3, [])
    loaded = opened.frames[0].load()
    camera = loaded.data.camera
    fx, _, cx, _ = scene().pinhole
    assert (camera.width, camera.height) == (256, 192)
    assert camera.fx == pytest.approx(fx * 0.4)
    assert camera.cx == pytest.approx((cx + 0.5) * 0.4 - 0.5)
    np.testing.assert_allclose(loaded.pose, POSE, atol=1e-6)
    assert opened.frames[2].timestamp == pytest.approx(100 + 2 / 30)
    small = cv2.resize(scene().color, (256, 192), interpolation=cv2.INTER_AREA).astype(int)
    assert np.abs(loaded.data.color - small).mean() < 8
    assert np.abs(opened.frames[1].load().data.color - small // 2).mean() < 8  # each depth image has the frame of its number
    assert_detected(loaded, tolerance=0.06)


def test_stray_scanner_without_its_video_or_a_frame_of_it(tmp_path):
    folder = stray(tmp_path / "a")
    alone = open_capture(folder, options=ReadOptions(color="none"))
    assert alone.frames[0].load().data.color is None
    put(folder / "depth" / "000009.png", cv2.imread(str(folder / "depth" / "000000.png"), cv2.IMREAD_UNCHANGED))
    refused(folder, "color-missing", "000009.png", "rgb.mp4", index=-1)
    (folder / "rgb.mp4").unlink()
    opened = open_capture(folder)
    assert "rgb.mp4" in opened.notes[0]
    assert opened.frames[0].load().data.camera.fx == pytest.approx(2 * scene().pinhole[0] * 256 / 1920)


@pytest.mark.parametrize("option", [{"camera": (200, 200, 128, 96)}, {"depth_scale": 2000}, {"color": "none"}])
def test_options_of_stray_scanner(tmp_path, option):
    folder = stray(tmp_path / "a", frames=1)
    plain, changed = (open_capture(folder, options=ReadOptions(**given)).frames[0].load().data for given in ({}, option))
    assert {"camera": changed.camera.fx == 200, "depth_scale": np.allclose(changed.depth * 2, plain.depth, atol=1e-3)}.get(
        next(iter(option)), changed.color is None
    )
    for name, value in (("depth_topic", "/a"), ("color", Path("a.png"))):
        refused(folder, "option-unused", name, "stray", options=ReadOptions(**{name: value}))


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("camera_matrix.csv", "1, 2\n", "line-invalid"),
        ("camera_matrix.csv", "0, 0, 0\n0, 0, 0\n0, 0, 1\n", "intrinsics-invalid"),
        ("odometry.csv", "1, 2, 3\n", "line-invalid"),
        ("odometry.csv", "1, x, 0, 0, 0, 0, 0, 0, 1\n", "line-invalid"),
        ("odometry.csv", "1, 0, 0, 0, 0, 0, 0, 0, 5\n", "pose-invalid"),
    ],
)
def test_damaged_text_of_stray_scanner(tmp_path, name, text, code):
    folder = stray(tmp_path / "a", frames=1)
    (folder / name).write_text(text)
    refused(folder, code, name)
