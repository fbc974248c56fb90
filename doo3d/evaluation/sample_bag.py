"""Write a sample recording: a ROS 2 bag of the first frame of a sample capture."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import require
from ..inputs.support.camera_files import read_camera_file
from ..types import Camera

TIMESTAMP_NS = 10**9
"""Time of all messages: 1 s, in ns."""

TOPICS = "/camera/color/image_raw/compressed", "/camera/aligned_depth_to_color/image_raw/compressedDepth"
INFO = "/camera/aligned_depth_to_color/camera_info"
COMPRESSED_DEPTH_HEADER = bytes(12)
"""Header of a compressedDepth image: encoding 0, and two numbers for inverse depth, which are not used."""


def write_bag(capture: Path, path: Path) -> Path:
    """Write the first frame of a capture as a ROS 2 bag, and return the bag's path.

    The bag holds one message each of CameraInfo, color image (JPEG) and depth image (compressedDepth), at a time of 1 s.

    Parameters
    ----------
    capture
        folder with color/000000.jpg, depth/000000.png (uint16) and camera_intrinsic.json.
    path
        folder of the bag, in which an MCAP file is written; an existing folder is replaced.

    Raises
    ------
    MissingDependency : rosbags is not installed.
    """
    rosbag2, typesys = require("rosbags.rosbag2", "bags"), require("rosbags.typesys", "bags")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    found = read_camera_file(capture / "camera_intrinsic.json")[0]
    camera = Camera(*found.pinhole, *(found.size or (0, 0)))

    def make(kind: str, **values: Any) -> Any:
        return store.types[kind](**values)

    header = make("std_msgs/msg/Header", stamp=make("builtin_interfaces/msg/Time", sec=1, nanosec=0), frame_id="camera")
    k = np.array((camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1))
    p = np.array((camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0))
    roi = make("sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    info = make(
        "sensor_msgs/msg/CameraInfo", header=header, height=camera.height, width=camera.width, distortion_model="plumb_bob",
        d=np.zeros(5), k=k, r=np.eye(3).ravel(), p=p, binning_x=0, binning_y=0, roi=roi,
    )  # fmt: skip
    messages = [(INFO, info)]
    for topic, file, encoding in zip(
        TOPICS,
        ("color/000000.jpg", "depth/000000.png"),
        ("rgb8; jpeg compressed bgr8", "16UC1; compressedDepth png"),
        strict=True,
    ):
        data = (COMPRESSED_DEPTH_HEADER if "Depth" in encoding else b"") + (capture / file).read_bytes()
        image = make("sensor_msgs/msg/CompressedImage", header=header, format=encoding, data=np.frombuffer(data, np.uint8))
        messages.append((topic, image))
    shutil.rmtree(path, ignore_errors=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    with rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
        for topic, message in messages:
            kind = message.__msgtype__
            writer.write(
                writer.add_connection(topic, kind, typestore=store), TIMESTAMP_NS, bytes(store.serialize_cdr(message, kind))
            )
    return path
