"""Foxglove's messages in MCAP files, in protobuf and in JSON."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags")
from builders.bags import SECOND, png
from builders.errors import refuses
from test_bags import HEIGHT, WIDTH, slope, tint

from doo3d.inputs import open_capture
from doo3d.inputs.bag import foxglove

CAMERA = [20.0, 0, 8, 0, 20.0, 6, 0, 0, 1]
STAMP = {"sec": 1, "nsec": 500}
IMAGE = {"timestamp": STAMP, "frame_id": "optical", "width": WIDTH, "height": HEIGHT, "encoding": "16UC1", "step": 2 * WIDTH}
IMAGE |= {"data": slope().tobytes()}
PACKED = {"timestamp": STAMP, "frame_id": "optical", "data": png(tint(3)[:, :, ::-1]), "format": "png"}
INFO = {"timestamp": STAMP, "frame_id": "optical", "width": WIDTH, "height": HEIGHT, "K": CAMERA, "D": [0.0] * 5}
MOVE = {"timestamp": STAMP, "parent_frame_id": "world", "child_frame_id": "optical"}
MOVE |= {"translation": {"x": 1.0, "y": 2.0, "z": 3.0}, "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
POINTS = np.arange(30, dtype=np.float32).reshape(10, 3)
CLOUD = {"timestamp": STAMP, "frame_id": "lidar", "point_stride": 12, "data": POINTS.tobytes()}
CLOUD |= {"fields": [{"name": name, "offset": 4 * i, "type": 7} for i, name in enumerate("xyz")]}


def varint(value: int) -> bytes:
    return bytes([value & 127 | 128]) + varint(value >> 7) if value > 127 else bytes([value])


def field(number: int, kind: str, value: Any) -> bytes:
    """One field of a protobuf message, of a kind as in the reader's tables."""
    if kind.endswith("*"):
        return b"".join(field(number, kind[:-1], each) for each in value)
    if kind == "varint":
        return varint(number << 3) + varint(value)
    if kind in ("I", "d"):
        return varint(number << 3 | (1 if kind == "d" else 5)) + struct.pack("<" + kind, value)
    data = value if isinstance(value, bytes) else str(value).encode()
    if kind in foxglove._SCHEMAS:
        data = protobuf(kind, value)
    elif kind == "packed":
        data = np.array(value, dtype=float).tobytes()
    return varint(number << 3 | 2) + varint(len(data)) + data


def protobuf(schema: str, values: dict[str, Any]) -> bytes:
    fields = foxglove._fields(schema).items()
    return b"".join(field(number, kind, values[name]) for number, (name, kind) in fields if name in values)


def serialized(schema: str, values: dict[str, Any], how: str) -> bytes:
    if how == "json":
        return json.dumps(values, default=lambda data: base64.b64encode(data).decode()).encode()
    return protobuf(schema, values) + field(99, "text", "unknown")


def record(op: int, data: bytes) -> bytes:
    return bytes([op]) + struct.pack("<Q", len(data)) + data


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def mcap(path: Path, topics: dict[str, tuple[str, bytes]], how: str) -> Path:
    """An MCAP file, not compressed, with a message on each topic: name -> schema and data."""
    content = b"\x89MCAP0\r\n"
    for i, (name, (schema, data)) in enumerate(topics.items(), 1):
        content += record(3, struct.pack("<H", i) + text(f"foxglove.{schema}") + text(how) + struct.pack("<I", 0))
        content += record(4, struct.pack("<HH", i, i) + text(name) + text(how) + struct.pack("<I", 0))
        content += record(5, struct.pack("<HIQQ", i, 0, SECOND, SECOND) + data)
    path.write_bytes(content + record(15, bytes(4)))
    return path


def capture_of(path: Path, how: str, **messages: tuple[str, dict[str, Any]]):
    topics = {f"/cam/{name}": (schema, serialized(schema, values, how)) for name, (schema, values) in messages.items()}
    return open_capture(mcap(path, topics, how))


@pytest.mark.parametrize("how", ["protobuf", "json"])
def test_images_camera_and_transform(tmp_path, how):
    capture = capture_of(
        tmp_path / "a.mcap", how, depth=("RawImage", IMAGE), camera_info=("CameraCalibration", INFO),
        color=("CompressedImage", PACKED), tf=("FrameTransform", MOVE),
    )  # fmt: skip
    loaded = capture[0].load()
    assert capture[0].timestamp == 1 + 500e-9
    assert np.array_equal(loaded.data.depth, (slope() / np.float32(1000)).astype(np.float32))
    assert np.array_equal(loaded.data.color, tint(3))
    assert (loaded.data.camera.fx, loaded.data.camera.cx) == (20, 8)
    assert loaded.pose[:3, 3].tolist() == [1, 2, 3]


@pytest.mark.parametrize("how", ["protobuf", "json"])
def test_cloud_and_transforms(tmp_path, how):
    tree = {"transforms": [MOVE, {**MOVE, "parent_frame_id": "optical", "child_frame_id": "lidar"}]}
    capture = capture_of(tmp_path / "a.mcap", how, points=("PointCloud", CLOUD), tf=("FrameTransforms", tree))
    loaded = capture[0].load()
    assert np.array_equal(loaded.data.points, POINTS)
    assert loaded.pose[:3, 3].tolist() == [2, 4, 6]


def test_damaged_messages():
    """Cut off anywhere, or with any byte changed, a message is read or refused as damaged."""
    rng = np.random.default_rng(0)
    for schema, values in (("RawImage", IMAGE), ("CameraCalibration", INFO), ("PointCloud", CLOUD), ("FrameTransform", MOVE)):
        for how in foxglove.SERIALIZATIONS:
            data, encoding = serialized(schema, values, how), f"foxglove.{schema} {how}"
            for number in range(150):
                changed = bytearray(data)
                changed[int(rng.integers(len(data)))] ^= int(rng.integers(1, 256))
                damaged = bytes(changed) if number % 2 else data[: int(rng.integers(len(data)))]
                outcome = "read"
                try:
                    foxglove.decode(damaged, encoding)
                except ValueError:
                    outcome = "refused"
                assert outcome in ("read", "refused")


@pytest.mark.parametrize("data", [b"\x08\x00" * 20_000, b"\x80" * 50, b"\x0b\x00", b"\x0a\xff\xff\xff\x7f"])
def test_messages_made_to_do_harm(tmp_path, data):
    with pytest.raises(ValueError):  # noqa: PT011
        foxglove.decode(data, "foxglove.RawImage protobuf")
    with refuses("frames-missing", "damaged message on /cam/depth"):
        open_capture(mcap(tmp_path / "a.mcap", {"/cam/depth": ("RawImage", data)}, "protobuf"))


def test_video_is_named(tmp_path):
    with refuses("frames-missing", "foxglove.CompressedVideo, protobuf"):
        open_capture(mcap(tmp_path / "a.mcap", {"/cam/video": ("CompressedVideo", b"")}, "protobuf"))
