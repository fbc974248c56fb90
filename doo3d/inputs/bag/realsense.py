"""What is peculiar to bags of RealSense's SDK: names of topics, the unit of depth, extrinsics.

Read off librealsense's sources: `src/media/readme.md` and `src/media/ros/ros_file_format.h` (names of topics),
`ros_writer.cpp` and `src/device.cpp` (what the messages mean). A stream's topics begin with
`/device_<d>/sensor_<s>/<Stream>_<i>`; its images are at `image/data`, its intrinsics at `info/camera_info`. Depth is `mono16`
in units that the option `Depth Units` of its sensor gives in metres. `tf/<group>` is the transform from the group's reference
to the stream: p_stream = R p_reference + t.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ...errors import InputError
from ...types import Floats
from .index import Bag, Found
from .tf import matrix

_STREAM = re.compile(r"(/device_\d+/sensor_\d+)/([^/]+)/image/data")


def stream_of(topic: str) -> str | None:
    """What the topics of a stream begin with, for the topic of its images; None where it is not of the SDK."""
    found = _STREAM.fullmatch(topic)
    return f"{found[1]}/{found[2]}" if found else None


def is_depth_stream(topic: str) -> bool:
    """Whether a topic is that of the SDK's depth images."""
    found = _STREAM.fullmatch(topic)
    return found is not None and found[2].startswith("Depth")


def is_color_stream(topic: str) -> bool:
    """Whether a topic is that of the SDK's colour images."""
    found = _STREAM.fullmatch(topic)
    return found is not None and found[2].startswith("Color")


def depth_scale(bag: Bag, index: Mapping[str, Found], topic: str) -> float:
    """Units per metre of the SDK's depth images.

    Raises
    ------
    InputError : the bag does not say, or what it says cannot be.
    """
    found = _STREAM.fullmatch(topic)
    assert found is not None
    name = f"{found[1]}/option/Depth Units/value"
    option = next((index[given] for given in (name, name.replace(" ", "_")) if given in index), None)
    if option is None or not len(option):
        raise InputError(
            f"{bag.path}: does not say the unit of its depth (there is no {name}): "
            "give it, such as --input-option depth_scale=1000",
            code="depth-unit",
        )
    unit = float(bag.message(option.topic, option.place(0)).data)
    if not 0 < unit < 1:
        raise InputError(
            f"{bag.path}: {name} is {unit} m, which cannot be: give the unit, such as --input-option depth_scale=1000",
            code="depth-unit",
        )
    return 1 / unit


def extrinsics(bag: Bag, index: Mapping[str, Found], depth: str, color: str) -> Floats:
    """(4, 4) from coordinates of the depth camera to those of the colour camera, m.

    Raises
    ------
    InputError : the bag does not say.
    """
    places = {stream: _transforms(bag, index, stream_of(stream) or "") for stream in (depth, color)}
    shared = sorted(set(places[depth]) & set(places[color]))
    if not shared:
        raise InputError(
            f"{bag.path}: does not say where the camera of {color} is beside that of {depth} (there are no tf topics of the "
            "two): read the depth alone, with --input-option color_topic=none",
            code="extrinsics-missing",
        )
    return np.asarray(places[color][shared[0]] @ np.linalg.inv(places[depth][shared[0]]))


def _transforms(bag: Bag, index: Mapping[str, Found], stream: str) -> dict[str, Floats]:
    """From the reference of each group to the stream."""
    result = {}
    for name, found in index.items():
        if name.startswith(f"{stream}/tf/") and len(found):
            said = bag.message(found.topic, found.place(0))
            move, turn = said.translation, said.rotation
            result[name.rpartition("/")[2]] = matrix((move.x, move.y, move.z, turn.x, turn.y, turn.z, turn.w))
    return result
