"""Apply the conventions of bags of RealSense's SDK: names of topics, unit of depth, extrinsics.

Source: librealsense: `src/media/readme.md` and `src/media/ros/ros_file_format.h` (names of topics), `ros_writer.cpp` and
`src/device.cpp` (what the messages mean). A stream's topics begin with `/device_<d>/sensor_<s>/<Stream>_<i>`; its images are at
`image/data`, its intrinsics at `info/camera_info`. Depth is `mono16` in units that the option `Depth Units` of its sensor gives
in metres. `tf/<group>` is the transform from the group's reference to the stream: p_stream = R p_reference + t.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ...errors import InputError
from ...types import Floats
from ..formats.trajectory import matrix
from .index import Bag, TopicIndex
from .tf import values_of

DEPTH_ALONE = "read the depth alone, with --input-option color_topic=none"
"""Remedy in the error about color that cannot be aligned."""

_STREAM = re.compile(r"(/device_\d+/sensor_\d+)/([^/]+)/image/data")


def stream_of(topic: str) -> str | None:
    """Return the common prefix of a RealSense stream's topics, from the topic of the stream's images.

    For "/device_0/sensor_0/Depth_0/image/data" it is "/device_0/sensor_0/Depth_0". None if `topic` is not named like an image
    topic of RealSense's SDK.
    """
    match = _STREAM.fullmatch(topic)
    return f"{match[1]}/{match[2]}" if match else None


def depth_scale(bag: Bag, index: Mapping[str, TopicIndex], topic: str) -> float:
    """Return the units per metre of the depth images in a bag of RealSense's SDK, such as 1000 for millimetres.

    Parameters
    ----------
    bag, index
        the bag, and its messages by topic name.
    topic
        the topic of the depth images.

    Raises
    ------
    InputError : the bag does not state the unit of depth, or its value is impossible.
    """
    name = f"{(stream_of(topic) or topic).rpartition('/')[0]}/option/Depth Units/value"
    option = index.get(name) or index.get(name.replace(" ", "_"))
    unit = float(bag.message(option.topic, option.location(0)).data) if option else 0.0
    if not 0 < unit < 1:
        fault = f"has no unit of depth, or an impossible one (topic {name}: {unit} m)"
        raise InputError(f"{bag.path}: {fault}: give it, such as --input-option depth_scale=1000", code="depth-unit")
    return 1 / unit


def extrinsics(bag: Bag, index: Mapping[str, TopicIndex], depth: str, color: str) -> Floats:
    """Return the (4, 4) transform from the depth to the color camera, x_color = T @ x_depth, m.

    Parameters
    ----------
    bag, index
        the bag, and its messages by topic name.
    depth, color
        the topics of the depth and of the color images.

    Raises
    ------
    InputError : the bag has no transforms of both streams to a common reference.
    """
    transforms = {stream: _stream_transforms(bag, index, stream_of(stream) or "") for stream in (depth, color)}
    shared = sorted(set(transforms[depth]) & set(transforms[color]))
    if not shared:
        fault = f"has no transform between the cameras of {color} and {depth} (no common tf topics)"
        raise InputError(f"{bag.path}: {fault}: {DEPTH_ALONE}", code="extrinsics-missing")
    return np.asarray(transforms[color][shared[0]] @ np.linalg.inv(transforms[depth][shared[0]]))


def _stream_transforms(bag: Bag, index: Mapping[str, TopicIndex], stream: str) -> dict[str, Floats]:
    """Return the transform (4, 4) from the reference of each extrinsics group to the stream, by group."""
    topics = {name.rpartition("/")[2]: each for name, each in index.items() if name.startswith(f"{stream}/tf/") and len(each)}
    return {group: matrix(values_of(bag.message(each.topic, each.location(0)))) for group, each in topics.items()}
