"""Decode Foxglove's messages in MCAP files (protobuf or JSON) to the corresponding ROS messages.

Field numbers: github.com/foxglove/foxglove-sdk, schemas/proto; protobuf.dev/programming-guides/encoding.
"""

from __future__ import annotations

import base64
import struct
from collections.abc import Iterator
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...errors import InputError
from ...guard.parsing import parse_json

KINDS = {
    "foxglove.RawImage": "sensor_msgs/msg/Image",
    "foxglove.CompressedImage": "sensor_msgs/msg/CompressedImage",
    "foxglove.CameraCalibration": "sensor_msgs/msg/CameraInfo",
    "foxglove.PointCloud": "sensor_msgs/msg/PointCloud2",
    "foxglove.FrameTransform": "tf2_msgs/msg/TFMessage",
    "foxglove.FrameTransforms": "tf2_msgs/msg/TFMessage",
}
"""Foxglove schema -> corresponding ROS message type."""

SERIALIZATIONS = ("protobuf", "json")
"""Supported serializations; the encoding of a topic is its schema and one of these, such as "foxglove.RawImage protobuf"."""

# fields of a schema, numbered from 1, each name:kind: a format of struct, "packed" for doubles, "varint", "text", "bytes", or
# another schema, with a star if it is repeated
_SCHEMAS = {
    "RawImage": "timestamp:Time width:I height:I encoding:text step:I data:bytes frame_id:text",
    "CompressedImage": "timestamp:Time data:bytes format:text frame_id:text",
    "CameraCalibration": "timestamp:Time width:I height:I distortion_model:text "
    "D:packed K:packed R:packed P:packed frame_id:text",
    "PointCloud": "timestamp:Time frame_id:text pose:bytes point_stride:I fields:Element* data:bytes",
    "FrameTransform": "timestamp:Time parent_frame_id:text child_frame_id:text translation:Vector rotation:Quaternion",
    "FrameTransforms": "transforms:FrameTransform*",
    "Time": "sec:varint nsec:varint",
    "Vector": "x:d y:d z:d",
    "Quaternion": "x:d y:d z:d w:d",
    "Element": "name:text offset:I type:varint",
}
_TYPES = {1: 2, 2: 1, 3: 4, 4: 3, 5: 6, 6: 5, 7: 7, 8: 8}  # of Foxglove's PackedElementField: of ROS's PointField
_MAX_VARINT_BYTES = 10
_MAX_FIELDS = 10_000  # of a message: a tree of 1,000 transforms
_PREFIX = "foxglove."


def is_foxglove(encoding: str) -> bool:
    """Return whether the encoding of a topic is that of Foxglove's messages."""
    return encoding.startswith(_PREFIX)


def decode(data: bytes, encoding: str) -> Any:
    """Return a message of an encoding such as "foxglove.RawImage protobuf" with the fields of the ROS message.

    Raises
    ------
    ValueError : the bytes are damaged, or not what the schema prescribes.
    """
    schema, serialization = encoding.removeprefix(_PREFIX).split()
    try:
        if serialization == "json":
            values = parse_json(data, "a message")
            values["data"] = base64.b64decode(values.get("data", ""))
        else:
            values = _message(data, schema, iter(range(_MAX_FIELDS)))
        return _CONVERSIONS[schema](values)
    except (LookupError, TypeError, AttributeError, OverflowError, struct.error, InputError) as error:
        raise ValueError(f"it is not what {encoding} prescribes: {error!r}") from None


def header(data: bytes, encoding: str) -> tuple[int, str]:
    """Return the time in ns and the frame_id of a message; raise ValueError if it is damaged."""
    message = decode(data, encoding)
    stamped = message.transforms[0] if hasattr(message, "transforms") else message
    return stamped.header.stamp.sec * 10**9 + stamped.header.stamp.nanosec, stamped.header.frame_id


@lru_cache
def _fields(schema: str) -> dict[int, tuple[str, str]]:
    """Return number -> name and kind of the fields of a schema."""
    fields = [field.partition(":") for field in _SCHEMAS[schema].split()]
    return {number: (name, kind) for number, (name, _, kind) in enumerate(fields, 1)}


def _message(data: bytes, schema: str, fields: Iterator[int]) -> dict[str, Any]:
    """Return field -> value of a protobuf message; unknown fields are skipped, missing ones are left out.

    `fields` is an iterator that limits the number of fields of the message and of those within it.
    """
    values: dict[str, Any] = {}
    at = 0
    while at < len(data):
        if next(fields, None) is None:
            raise ValueError("it has too many fields")
        key, at = _varint(data, at)
        wire, (name, kind) = key & 7, _fields(schema).get(key >> 3, ("", "bytes"))
        if wire == 0:
            values[name], at = _varint(data, at)
            continue
        size, at = _varint(data, at) if wire == 2 else ({1: 8, 5: 4}[wire], at)
        if at + size > len(data):
            raise ValueError("it ends too early")
        value = data[at : at + size]
        at += size
        if kind.endswith("*"):
            values.setdefault(name, []).append(_message(value, kind[:-1], fields))
        elif kind in _SCHEMAS:
            values[name] = _message(value, kind, fields)
        elif kind == "packed":
            values.setdefault(name, []).extend(np.frombuffer(value, "<f8"))  # a number by itself, or several
        elif kind == "text":
            values[name] = value.decode("utf-8", "replace")
        else:
            values[name] = value if kind == "bytes" else struct.unpack("<" + kind, value)[0]
    return values


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for i in range(_MAX_VARINT_BYTES):
        value |= (data[at + i] & 0x7F) << 7 * i
        if data[at + i] < 0x80:
            return value, at + i + 1
    raise ValueError("a number is too long")


def _header(values: dict[str, Any], frame: str = "frame_id") -> SimpleNamespace:
    time = values.get("timestamp", {})
    stamp = SimpleNamespace(sec=int(time.get("sec", 0)), nanosec=int(time.get("nsec", 0)))
    return SimpleNamespace(stamp=stamp, frame_id=str(values.get(frame, "")).lstrip("/"))


def _image(values: dict[str, Any]) -> Any:
    size = {key: int(values.get(key, 0)) for key in ("width", "height", "step")}
    data = np.frombuffer(values.get("data", b""), np.uint8)
    return SimpleNamespace(header=_header(values), encoding=str(values.get("encoding", "")), is_bigendian=0, data=data, **size)


def _compressed(values: dict[str, Any]) -> Any:
    return SimpleNamespace(header=_header(values), format=str(values.get("format", "")), data=values.get("data", b""))


def _camera(values: dict[str, Any]) -> Any:
    numbers = {key.lower(): np.array(values.get(key, []), dtype=float) for key in "DKP"}
    if len(numbers["k"]) != 9:
        raise ValueError("its K has not nine numbers")
    numbers["p"] = numbers["p"] if len(numbers["p"]) == 12 else np.zeros(12)
    size = {key: int(values.get(key, 0)) for key in ("width", "height")}
    return SimpleNamespace(header=_header(values), distortion_model=str(values.get("distortion_model", "")), **size, **numbers)


def _cloud(values: dict[str, Any]) -> Any:
    step = int(values.get("point_stride", 0))
    data = np.frombuffer(values.get("data", b""), np.uint8)
    fields = [
        SimpleNamespace(
            name=str(each.get("name", "")), offset=int(each.get("offset", 0)), datatype=_TYPES.get(each.get("type"), 0)
        )
        for each in values.get("fields", [])
    ]
    count = len(data) // step if step else 0
    size = {"height": 1, "width": count, "point_step": step, "row_step": step * count}
    return SimpleNamespace(header=_header(values), fields=fields, is_bigendian=0, data=data, **size)


def _transforms(values: dict[str, Any]) -> Any:
    return SimpleNamespace(transforms=[_transform(each) for each in values.get("transforms", [values])])


def _transform(values: dict[str, Any]) -> Any:
    def numbers(key: str, default: dict[str, float]) -> SimpleNamespace:
        return SimpleNamespace(**{name: float(values.get(key, {}).get(name, number)) for name, number in default.items()})

    move, turn = numbers("translation", dict.fromkeys("xyz", 0.0)), numbers("rotation", dict.fromkeys("xyzw", 0.0))
    transform = SimpleNamespace(translation=move, rotation=turn)
    child = str(values.get("child_frame_id", "")).lstrip("/")
    return SimpleNamespace(header=_header(values, "parent_frame_id"), child_frame_id=child, transform=transform)


_CONVERSIONS = {
    "RawImage": _image,
    "CompressedImage": _compressed,
    "CameraCalibration": _camera,
    "PointCloud": _cloud,
    "FrameTransform": _transforms,
    "FrameTransforms": _transforms,
}
