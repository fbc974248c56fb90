"""Color from another camera than the depth: size, position, distortion; camera poses from the transforms of the bag."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

pytest.importorskip("rosbags")
from builders.bags import KINDS, SECOND, BagScript
from builders.errors import refused

from doo3d.inputs import ReadOptions, open_capture
from doo3d.types import Camera

DEPTH, COLOR = "/camera/depth/image_raw", "/camera/color/image_raw"
D_SIZE, D_NUMBERS = (120, 90), (110.0, 110.0, 59.5, 44.5)
C_SIZE, C_NUMBERS = (200, 150), (190.0, 190.0, 99.5, 74.5)
MOVE = (0.05, 0.0, 0.0)  # of the color camera, in the depth camera's frame


def stripes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the color (..., 3) uint8 of the wall at (x, y) m; smooth, so that half a pixel changes little."""
    return np.stack([128 + 100 * np.sin(9 * x), 128 + 100 * np.sin(7 * y), 60 + 0 * x], axis=-1).astype(np.uint8)


def wall(size, numbers, eye=(0.0, 0.0, 0.0), distance: float = 0.8) -> np.ndarray:
    """Return the view (H, W, 3) RGB from `eye` of the wall, which is perpendicular to the optical axes."""
    fx, fy, cx, cy = numbers
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    return stripes(eye[0] + (u - cx) * distance / fx, eye[1] + (v - cy) * distance / fy)


def scene(kind: str = "ros1", depth: np.ndarray | None = None, color: np.ndarray | None = None) -> BagScript:
    made = BagScript(kind)
    flat = np.full(D_SIZE[::-1], 800, np.uint16) if depth is None else depth
    made.image(DEPTH, SECOND, flat, "16UC1", frame="depth_optical")
    made.info("/camera/depth/camera_info", D_SIZE, D_NUMBERS, frame="depth_optical")
    made.image(COLOR, SECOND, wall(C_SIZE, C_NUMBERS, MOVE) if color is None else color, "rgb8", frame="color_optical")
    made.info("/camera/color/camera_info", C_SIZE, C_NUMBERS, frame="color_optical")
    made.tf("camera_link", "depth_optical", (0, 0, 0), static=True)
    made.tf("camera_link", "color_optical", MOVE, static=True)
    return made


def only(path: Path, **said):
    (frame_ref,) = open_capture(path, options=ReadOptions(**said)).frames
    return frame_ref.load()


@pytest.mark.parametrize("kind", KINDS)
def test_color_of_another_camera_is_aligned_to_the_depth(tmp_path, kind):
    frame = only(scene(kind).write(tmp_path / ("a.bag" if kind == "ros1" else "a"))).data
    assert frame.camera.fx == D_NUMBERS[0]
    expected = wall(D_SIZE, D_NUMBERS).astype(int)
    inner = (slice(10, -10), slice(25, -10))
    assert np.abs(frame.color[inner] - expected[inner]).max() <= 6  # a pixel of the color image is 4 mm on the wall
    assert np.abs(wall(D_SIZE, D_NUMBERS, MOVE).astype(int)[inner] - expected[inner]).max() > 30  # unaligned


def test_rotated_color_camera(tmp_path):
    made = scene(color=np.rot90(wall(C_SIZE[::-1], (190, 190, 74.5, 99.5), (0, 0, 0)), 1))
    made.messages = made.messages[:4]
    made.tf("camera_link", "depth_optical", (0, 0, 0), static=True)
    half = np.sqrt(0.5)
    made.tf("camera_link", "color_optical", (0, 0, 0), (0, 0, half, half), static=True)
    frame = only(made.write(tmp_path / "a.bag")).data
    expected = wall(D_SIZE, D_NUMBERS).astype(int)
    inner = (slice(10, -10), slice(20, -20))
    assert np.abs(frame.color[inner] - expected[inner]).max() <= 6


def test_surfaces_occluded_from_the_color_camera_are_black(tmp_path):
    depth = np.full(D_SIZE[::-1], 800, np.uint16)
    depth[:, 50:60] = 400  # a post before the wall
    fx, _, cx, _ = D_NUMBERS
    x = (np.array([50, 59]) - cx) * 0.4 / fx
    color = wall(C_SIZE, C_NUMBERS, MOVE)
    left, right = np.rint((x - MOVE[0]) * C_NUMBERS[0] / 0.4 + C_NUMBERS[2]).astype(int)
    color[:, left : right + 1] = (0, 0, 255)
    frame = only(scene(depth=depth, color=color).write(tmp_path / "a.bag")).data
    row = frame.color[45].astype(int)
    blue = (row[:, 2] > 200) & (row[:, 0] < 30)
    assert blue[51:59].all()
    assert not blue[:49].any()
    assert not blue[61:].any()
    assert (row[:49].sum(axis=1) == 0).sum() >= 5  # the post's shadow on the wall


def test_pixels_without_depth_keep_their_color(tmp_path):
    depth = np.full(D_SIZE[::-1], 800, np.uint16)
    depth[40:50, 55:70] = 0
    frame = only(scene(depth=depth).write(tmp_path / "a.bag")).data
    assert not frame.depth[45, 60]
    expected = wall(D_SIZE, D_NUMBERS).astype(int)
    assert np.abs(frame.color[35:55, 50:75] - expected[35:55, 50:75]).max() <= 6
    nothing = only(scene(depth=np.zeros(D_SIZE[::-1], np.uint16)).write(tmp_path / "b.bag")).data
    assert not nothing.color.any()


def test_missing_transform_between_the_cameras(tmp_path):
    made = scene()
    made.messages = made.messages[:4]
    refused(made.write(tmp_path / "a.bag"), "extrinsics-missing", COLOR, DEPTH, "color_topic=none")


def bent(numbers, size, d, model) -> tuple[np.ndarray, np.ndarray]:
    """Return the position in the pinhole image of each pixel of the distorted image: columns, rows."""
    fx, fy, cx, cy = numbers
    inner = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    grid = np.stack(np.meshgrid(np.arange(size[0]), np.arange(size[1])), axis=-1).reshape(-1, 1, 2).astype(float)
    if model == "equidistant":
        found = cv2.fisheye.undistortPoints(grid, inner, np.array(d), P=inner)
    else:
        found = cv2.undistortPoints(grid, inner, np.array(d), P=inner)
    return found[:, 0, 0].reshape(size[::-1]), found[:, 0, 1].reshape(size[::-1])


@pytest.mark.parametrize(
    ("model", "d"),
    [
        ("plumb_bob", (-0.2, 0.05, 0.002, -0.001, 0.0)),
        ("rational_polynomial", (0.1, -0.05, 0.001, 0.001, 0.01, 0.3, -0.02, 0.01)),
        ("equidistant", (0.05, 0.01, 0.0, 0.0)),
        ("Inverse Brown Conrady", (-0.15, 0.05, 0.002, -0.001, 0.0)),
    ],
)
def test_color_and_depth_are_undistorted(tmp_path, model, d):
    u, v = bent(D_NUMBERS, D_SIZE, d, model)
    fx, fy, cx, cy = D_NUMBERS
    color = stripes((u - cx) * 0.8 / fx, (v - cy) * 0.8 / fy)
    depth = np.where(u > 70, 900, 600).astype(np.uint16)
    made = BagScript("mcap")
    made.image(DEPTH, SECOND, depth, "16UC1")
    made.image(COLOR, SECOND, color, "rgb8")
    for topic in (DEPTH, COLOR):
        made.info(topic.replace("image_raw", "camera_info"), D_SIZE, D_NUMBERS, model, d)
    frame = only(made.write(tmp_path / "bag")).data
    inner = (slice(15, -15), slice(15, -15))
    expected = wall(D_SIZE, D_NUMBERS).astype(int)
    assert np.abs(frame.color[inner] - expected[inner]).max() <= 3
    assert np.abs(color[inner] - expected[inner]).max() > 6  # the lens matters
    straight = np.where(np.arange(D_SIZE[0]) > 70, 0.9, 0.6).astype(np.float32)
    columns = np.r_[15:70, 72:105]
    assert np.array_equal(frame.depth[15:-15, columns], np.tile(straight[columns], (60, 1)))


def test_rectified_topic_uses_the_projection_matrix_without_distortion(tmp_path):
    made = BagScript("ros1")
    made.image("/camera/depth/image_rect", SECOND, np.full(D_SIZE[::-1], 800, np.uint16), "16UC1")
    made.info("/camera/depth/camera_info", D_SIZE, D_NUMBERS, d=(-0.3, 0.1, 0, 0, 0), p=(100, 101, 60, 45))
    camera = only(made.write(tmp_path / "a.bag")).data.camera
    assert camera == Camera(100, 101, 60, 45, *D_SIZE)


# --- where the camera is ------------------------------------------------------------------------------------------------


def moving(kind: str, world: str = "map") -> BagScript:
    """A camera moves along x at 1 m/s and rotates about z at 1 rad/s; transforms at 20 Hz, images at 30 Hz."""
    made = BagScript(kind)
    made.info("/camera/depth/camera_info", D_SIZE, D_NUMBERS)
    made.tf("/base", "camera_optical", (0, 0, 0.5), static=True)
    for i in range(21):
        angle = i / 20
        made.tf(world, "base", (i / 20, 0, 0), (0, 0, np.sin(angle / 2), np.cos(angle / 2)), SECOND + i * SECOND // 20)
    for i in range(31):
        made.image(DEPTH, SECOND + i * SECOND // 30, np.full(D_SIZE[::-1], 800, np.uint16), "16UC1")
    return made


@pytest.mark.parametrize("kind", KINDS)
def test_poses_of_a_moving_camera(tmp_path, kind):
    frame_refs = open_capture(moving(kind).write(tmp_path / ("a.bag" if kind == "ros1" else "a"))).frames
    assert len(frame_refs) == 31
    for i, frame_ref in enumerate(frame_refs):
        pose, t = frame_ref.load().pose, i / 30
        expected = [[np.cos(t), -np.sin(t), 0, t], [np.sin(t), np.cos(t), 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]]
        assert np.abs(pose - expected).max() < 1e-6


def test_no_pose_without_fixed_frame_or_in_a_gap(tmp_path):
    assert only_poses(moving("mcap", world="robot").write(tmp_path / "a")) == 0
    gap = moving("mcap")
    gap.messages = [line for line in gap.messages if line[0] != "/tf" or line[2] < 1.3 * SECOND]
    assert 9 <= only_poses(gap.write(tmp_path / "b")) <= 12


def test_cycle_of_frames_ends(tmp_path):
    made = moving("ros1", world="camera_optical")
    assert only_poses(made.write(tmp_path / "a.bag")) == 0


def only_poses(path: Path) -> int:
    return sum(frame_ref.load().pose is not None for frame_ref in open_capture(path).frames)
