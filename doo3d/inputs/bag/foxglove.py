"""Foxglove's messages in MCAP files, protobuf or JSON, as the ROS messages that they correspond to.

Field numbers: github.com/foxglove/foxglove-sdk, schemas/proto; protobuf.dev/programming-guides/encoding.
"""

from __future__ import annotations

import base64
import struct
from collections.abc import Iterator
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
"""Schema -> the message type that it is read as."""

SERIALIZATIONS = ("protobuf", "json")
"""Serializations that are read; the encoding of a topic is the schema and one of these: "foxglove.RawImage protobuf"."""

# fields of a schema by number: name and kind, a format of struct, "packed" for doubles, "varint", "text", "bytes", a schema,
# or a list of the schema that is repeated
_TIME = {1: ("sec", "varint"), 2: ("nsec", "varint")}
_VECTOR = {i + 1: (name, "d") for i, name in enumerate("xyz")}
_QUATERNION = {i + 1: (name, "d") for i, name in enumerate("xyzw")}
_STAMPED: dict[int, tuple[str, Any]] = {1: ("timestamp", _TIME)}
_TRANSFORM = _STAMPED | {
    2: ("parent_frame_id", "text"),
    3: ("child_frame_id", "text"),
    4: ("translation", _VECTOR),
    5: ("rotation", _QUATERNION),
}
_SCHEMAS: dict[str, dict[int, tuple[str, Any]]] = {
    "RawImage": _STAMPED
    | {
        2: ("width", "I"),
        3: ("height", "I"),
        4: ("encoding", "text"),
        5: ("step", "I"),
        6: ("data", "bytes"),
        7: ("frame_id", "text"),
    },
    "CompressedImage": _STAMPED | {2: ("data", "bytes"), 3: ("format", "text"), 4: ("frame_id", "text")},
    "CameraCalibration": _STAMPED
    | {2: ("width", "I"), 3: ("height", "I"), 4: ("distortion_model", "text"), 9: ("frame_id", "text")}
    | {5: ("D", "packed"), 6: ("K", "packed"), 7: ("R", "packed"), 8: ("P", "packed")},
    "PointCloud": _STAMPED
    | {2: ("frame_id", "text"), 4: ("point_stride", "I"), 6: ("data", "bytes")}
    | {5: ("fields", [{1: ("name", "text"), 2: ("offset", "I"), 3: ("type", "varint")}])},
    "FrameTransform": _TRANSFORM,
    "FrameTransforms": {1: ("transforms", [_TRANSFORM])},
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
            values = _message(data, _SCHEMAS[schema], iter(range(_MAX_FIELDS)))
        return _CONVERSIONS[schema](values)
    except (LookupError, TypeError, AttributeError, OverflowError, struct.error, InputError) as error:
        raise ValueError(f"it is not what {encoding} prescribes: {error!r}") from None


def header(data: bytes, encoding: str) -> tuple[int, str]:
    """Return the time, ns, and the frame of a message; ValueError if it is damaged."""
    message = decode(data, encoding)
    stamped = message.transforms[0] if hasattr(message, "transforms") else message
    return stamped.header.stamp.sec * 10**9 + stamped.header.stamp.nanosec, stamped.header.frame_id


def _message(data: bytes, schema: dict[int, tuple[str, Any]], fields: Iterator[int]) -> dict[str, Any]:
    """Return field -> value of a protobuf message; fields that the schema has not are skipped, missing ones are left out.

    `fields` yields as often as a message and those within it may have fields.
    """
    values: dict[str, Any] = {}
    at = 0
    while at < len(data):
        if next(fields, None) is None:
            raise ValueError("it has too many fields")
        key, at = _varint(data, at)
        wire, (name, kind) = key & 7, schema.get(key >> 3, ("", "bytes"))
        if wire == 0:
            values[name], at = _varint(data, at)
            continue
        size, at = _varint(data, at) if wire == 2 else ({1: 8, 5: 4}[wire], at)
        if at + size > len(data):
            raise ValueError("it ends too early")
        value = data[at : at + size]
        at += size
        if isinstance(kind, list):
            values.setdefault(name, []).append(_message(value, kind[0], fields))
        elif isinstance(kind, dict):
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
