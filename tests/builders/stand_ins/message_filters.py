"""Stand-in for message_filters of ROS 2: `deliver` gives each callback the messages of the sample."""

from __future__ import annotations

import doo3d_sample as sample
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Header, Image, Time

_synchronizers = []


class Subscriber:
    def __init__(self, node, msg_type, topic, *, qos_profile):
        assert isinstance(node, Node)
        self.msg_type, self.topic = msg_type, topic


class ApproximateTimeSynchronizer:
    def __init__(self, fs, queue_size, slop):
        assert queue_size >= 1
        assert slop > 0
        self.filters, self.callbacks = fs, []
        _synchronizers.append(self)

    def registerCallback(self, cb, *args):
        self.callbacks.append(cb)


def deliver() -> None:
    for number in range(sample.COUNT):
        for synchronizer in _synchronizers:
            messages = [_message(each, number) for each in synchronizer.filters]
            for callback in synchronizer.callbacks:
                callback(*messages)


def _message(subscriber, number):
    header = Header(stamp=Time(sec=number, nanosec=0), frame_id="camera_color_optical_frame")
    if subscriber.msg_type is CameraInfo:
        k = [sample.FX, 0.0, sample.CX, 0.0, sample.FY, sample.CY, 0.0, 0.0, 1.0]
        return CameraInfo(header=header, height=sample.HEIGHT, width=sample.WIDTH, distortion_model="plumb_bob", k=k)
    assert subscriber.msg_type is Image
    is_depth = "depth" in subscriber.topic
    pixels = sample.depth(number) if is_depth else sample.color(number)[..., ::-1]
    encoding = ("16UC1" if number else "32FC1") if is_depth else "bgr8"
    if encoding == "32FC1":  # as other drivers send it
        pixels = (pixels / 1000).astype("<f4")
    step = pixels[0].nbytes
    size = {"height": pixels.shape[0], "width": pixels.shape[1]}
    return Image(header=header, **size, encoding=encoding, is_bigendian=0, step=step, data=pixels.tobytes())
