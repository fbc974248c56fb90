"""Bags for the tests, written by rosbags: ROS 1, ROS 2 with SQLite and with MCAP, all from the same messages."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

KINDS = ("ros1", "sqlite3", "mcap")
SECOND = 10**9
IMAGE, PACKED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
INFO, CLOUD, TF = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/PointCloud2", "tf2_msgs/msg/TFMessage"
DTYPES = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}


@dataclass
class BagScript:
    """The messages of a bag to be written: topic, type, time (ns) and message, with the store of types to make them."""

    kind: str
    messages: list[tuple[str, str, int, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.store = get_typestore(Stores.ROS1_NOETIC if self.kind == "ros1" else Stores.ROS2_HUMBLE)
        if self.kind == "ros1":
            self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TF))

    def make(self, kind: str, **values: Any) -> Any:
        return self.store.types[kind](**values)

    def header(self, stamp: int, frame: str) -> Any:
        time = self.make("builtin_interfaces/msg/Time", sec=stamp // SECOND, nanosec=stamp % SECOND)
        more = {"seq": 0} if self.kind == "ros1" else {}
        return self.make("std_msgs/msg/Header", stamp=time, frame_id=frame, **more)

    def add(self, topic: str, kind: str, time: int, message: Any) -> None:
        self.messages.append((topic, kind, time, message))

    def image(
        self, topic: str, stamp: int, image: np.ndarray, encoding: str, frame="camera_optical", time=None, pad=0, big=0
    ) -> None:
        """Add an Image; `pad` bytes are appended to each row; `big` makes it big-endian."""
        dtype = np.dtype(DTYPES.get(encoding, np.uint8)).newbyteorder(">" if big else "<")
        rows = np.ascontiguousarray(image.astype(dtype)).view(np.uint8).reshape(len(image), -1)
        rows = np.pad(rows, ((0, 0), (0, pad)), constant_values=77)
        message = self.make(
            IMAGE, header=self.header(stamp, frame), height=image.shape[0], width=image.shape[1], encoding=encoding,
            is_bigendian=big, step=rows.shape[1], data=rows.ravel(),
        )  # fmt: skip
        self.add(topic, IMAGE, stamp if time is None else time, message)

    def packed(self, topic: str, stamp: int, data: bytes, how: str, frame="camera_optical") -> None:
        data_array = np.frombuffer(data, np.uint8)
        self.add(topic, PACKED, stamp, self.make(PACKED, header=self.header(stamp, frame), format=how, data=data_array))

    def info(
        self, topic: str, size, numbers, model="plumb_bob", d=(0.0,) * 5, p=None, frame="camera_optical", stamp=SECOND
    ) -> None:
        fx, fy, cx, cy = numbers
        k = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1], dtype=float)
        p = (fx, fy, cx, cy) if p is None else p
        outer = np.array([p[0], 0, p[2], 0, 0, p[1], p[3], 0, 0, 0, 1, 0], dtype=float)
        values = {"d": np.array(d, dtype=float), "k": k, "r": np.eye(3).ravel(), "p": outer}
        if self.kind == "ros1":
            values = {name.upper(): value for name, value in values.items()}
        roi = self.make("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
        message = self.make(
            INFO, header=self.header(stamp, frame), height=size[1], width=size[0], distortion_model=model,
            binning_x=0, binning_y=0, roi=roi, **values,
        )  # fmt: skip
        self.add(topic, INFO, stamp, message)

    def transform(self, move, turn) -> Any:
        return self.make(
            "geometry_msgs/msg/Transform",
            translation=self.make("geometry_msgs/msg/Vector3", **dict(zip("xyz", map(float, move), strict=True))),
            rotation=self.make("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", map(float, turn), strict=True))),
        )

    def tf(self, parent: str, child: str, move, turn=(0, 0, 0, 1), stamp=SECOND, static=False) -> None:
        one = self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(stamp, parent), child_frame_id=child, transform=self.transform(move, turn),
        )  # fmt: skip
        self.add("/tf_static" if static else "/tf", TF, stamp, self.make(TF, transforms=[one]))

    def cloud(self, topic: str, stamp: int, cells: np.ndarray, height: int = 1, frame="camera_optical", pad=0) -> None:
        """Add a PointCloud2 of a structured array; `pad` bytes are appended to each row."""
        numbers = {"f4": 7, "f8": 8, "u4": 6, "u1": 2}
        fields = [
            self.make("sensor_msgs/msg/PointField", name=name, offset=kind[1], datatype=numbers[kind[0].str[1:]], count=1)
            for name, kind in cells.dtype.fields.items()
        ]
        step, width = cells.dtype.itemsize, len(cells) // height
        rows = np.frombuffer(cells.tobytes(), np.uint8).reshape(height, -1)
        rows = np.pad(rows, ((0, 0), (0, pad)))
        message = self.make(
            CLOUD, header=self.header(stamp, frame), height=height, width=width, fields=fields, is_bigendian=False,
            point_step=step, row_step=rows.shape[1], data=rows.ravel(), is_dense=False,
        )  # fmt: skip
        self.add(topic, CLOUD, stamp, message)

    def write(self, path: Path, packing: str | None = None, extra: bytes = b"") -> Path:
        """Write the bag; `extra` bytes are appended to each Image, as by RealSense's SDK."""
        from rosbags import rosbag1, rosbag2

        if self.kind == "ros1":
            writer: Any = rosbag1.Writer(path)
            if packing:
                writer.set_compression(rosbag1.Writer.CompressionFormat[packing.upper()])
        else:
            storage = rosbag2.StoragePlugin.MCAP if self.kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
            writer = rosbag2.Writer(path, version=9, storage_plugin=storage)
            if packing:
                writer.set_compression(rosbag2.CompressionMode[packing.upper()], rosbag2.CompressionFormat.ZSTD)
        with writer:
            connections: dict[str, Any] = {}
            for topic, kind, time, message in self.messages:
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=self.store)
                pack = self.store.serialize_ros1 if self.kind == "ros1" else self.store.serialize_cdr
                data = bytes(pack(message, kind))
                writer.write(connections[topic], time, data + extra if kind == IMAGE else data)
        return path


def png(image: np.ndarray) -> bytes:
    return bytes(cv2.imencode(".png", image)[1])


def rvl(image: np.ndarray) -> bytes:
    """Return an image in RVL: runs of zeros and of readings by turns, in nibbles of 32-bit words (Wilson, 2017)."""
    nibbles, before, at, values = [], 0, 0, image.ravel().tolist()

    def write(number: int) -> None:
        while number > 7:
            nibbles.append(number & 7 | 8)
            number >>= 3
        nibbles.append(number)

    while at < len(values):
        zeros = next((i for i, value in enumerate(values[at:]) if value), len(values) - at)
        at += zeros
        readings = next((i for i, value in enumerate(values[at:]) if not value), len(values) - at)
        write(zeros)
        write(readings)
        for value in values[at : at + readings]:
            write(2 * (value - before) if value >= before else 2 * (before - value) - 1)
            before = value
        at += readings
    text = "".join(f"{nibble:x}" for nibble in nibbles)
    words = np.frombuffer(bytes.fromhex(text + "0" * (-len(text) % 8)), ">u4")
    return struct.pack("<ii", *image.shape[::-1]) + words.astype("<u4").tobytes()


def packed_depth(image: np.ndarray, a: float = 0.0, b: float = 0.0, pack: Callable[[np.ndarray], bytes] = png) -> bytes:
    """Return a message of compressed_depth_image_transport: integers as stored; metres as a / z + b, 0 for none."""
    if image.dtype != np.uint16:
        with np.errstate(divide="ignore", invalid="ignore"):
            image = np.where(np.isfinite(image) & (image > 0), a / image + b, 0).astype(np.uint16)
    return struct.pack("<iff", 0, a, b) + pack(image)
