"""Bags as RealSense's SDK writes them: its topics, its unit of depth, its extrinsics, and the four bytes after its images."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags")
from builders.bags import SECOND, BagScript
from builders.errors import refused
from test_bags_aligned import C_NUMBERS, C_SIZE, D_NUMBERS, D_SIZE, MOVE, wall

from doo3d.inputs import ReadOptions, open_capture

DEPTH, COLOR = "/device_0/sensor_0/Depth_0", "/device_0/sensor_1/Color_0"
UNIT = 0.0001  # m, as a D405 has it
OPTION = "/device_0/sensor_0/option/Depth Units/value"


def recording(unit: float | None = UNIT, extrinsics: bool = True, frames: int = 3, distance: float = 0.8) -> BagScript:
    made = BagScript("ros1")
    if unit is not None:
        made.add(OPTION, "std_msgs/msg/Float32", 1, made.make("std_msgs/msg/Float32", data=unit))
    for stream, size, numbers in ((DEPTH, D_SIZE, D_NUMBERS), (COLOR, C_SIZE, C_NUMBERS)):
        made.info(f"{stream}/info/camera_info", size, numbers, "Brown Conrady", p=(0, 0, 0, 0), frame="0", stamp=1)
    for i in range(frames):
        stamp = 1_700_000_000 * SECOND + i * SECOND // 30
        depth = np.full(D_SIZE[::-1], round(distance / (unit or 0.001)), np.uint16)
        made.image(f"{DEPTH}/image/data", stamp, depth, "mono16", frame="1", time=i * SECOND // 30 + 2)
        color = wall(C_SIZE, C_NUMBERS, MOVE, distance)
        made.image(f"{COLOR}/image/data", stamp + 4_000_000, color, "rgb8", frame="1", time=i * SECOND // 30 + 3)
        made.image(
            "/device_0/sensor_0/Infrared_1/image/data", stamp, color[:, :, 0], "8UC1", frame="1", time=i * SECOND // 30 + 3
        )
    if extrinsics:
        # to the stream, from the group's reference, the depth camera: a point of the wall is 5 cm less to the right in color
        there = made.transform([-step for step in MOVE], (0, 0, 0, 1))
        made.add(f"{DEPTH}/tf/0", "geometry_msgs/msg/Transform", 1, made.transform((0, 0, 0), (0, 0, 0, 1)))
        made.add(f"{COLOR}/tf/0", "geometry_msgs/msg/Transform", 1, there)
    return made


def write(made: BagScript, path: Path) -> Path:
    return made.write(path, extra=struct.pack("<f", UNIT))


def test_depth_unit_and_color_extrinsics_of_the_file(tmp_path):
    opened = open_capture(write(recording(), tmp_path / "20240101_120000.bag"))
    assert opened.format == "bag"
    assert len(opened.frames) == 3
    loaded = opened.frames[1].load()
    assert loaded.pose is None
    frame = loaded.data
    assert np.allclose(frame.depth, 0.8, atol=1e-6)
    assert (frame.camera.fx, frame.camera.cx) == (D_NUMBERS[0], D_NUMBERS[2])
    assert frame.timestamp == pytest.approx(1_700_000_000 + 1 / 30)
    expected = wall(D_SIZE, D_NUMBERS).astype(int)
    inner = (slice(10, -10), slice(25, -10))
    assert np.abs(frame.color[inner] - expected[inner]).max() <= 6


def test_files_without_bytes_after_the_images(tmp_path):
    assert len(open_capture(recording().write(tmp_path / "a.bag", "lz4")).frames) == 3


def test_unit_of_one_millimetre(tmp_path):
    frame = open_capture(write(recording(unit=0.001), tmp_path / "a.bag")).frames[0].load().data
    assert np.allclose(frame.depth, 0.8, atol=1e-6)


def test_missing_unit(tmp_path):
    path = write(recording(unit=None), tmp_path / "a.bag")
    refused(path, "depth-unit", OPTION, "depth_scale")
    frame = open_capture(path, options=ReadOptions(depth_scale=1000)).frames[0].load().data
    assert np.allclose(frame.depth, 0.8, atol=1e-6)


@pytest.mark.parametrize("unit", [0.0, -0.001, float("nan"), 5.0])
def test_impossible_unit(tmp_path, unit):
    made = recording()
    made.messages[0] = (*made.messages[0][:3], made.make("std_msgs/msg/Float32", data=unit))
    refused(write(made, tmp_path / "a.bag"), "depth-unit", OPTION, f"{np.float32(unit):.4}")


def test_missing_extrinsics(tmp_path):
    path = write(recording(extrinsics=False), tmp_path / "a.bag")
    refused(path, "extrinsics-missing", COLOR, DEPTH, "color_topic=none")
    assert open_capture(path, options=ReadOptions(color_topic="none")).frames[0].load().data.color is None
