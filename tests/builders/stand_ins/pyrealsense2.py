"""Stand-in for pyrealsense2: the part of its interface that the documentation uses, with the frames of a sample."""

from __future__ import annotations

from enum import Enum, auto
from types import SimpleNamespace

import doo3d_sample as sample
import numpy as np

DEPTH_UNIT = 0.001


class stream(Enum):
    depth = auto()
    color = auto()


class format(Enum):
    z16 = auto()
    rgb8 = auto()


class config:
    def __init__(self):
        self.streams = {}

    def enable_stream(self, stream_type, width, height, format, framerate):
        self.streams[stream_type] = (width, height, format, framerate)


class BufData:
    """Memory of the driver, read through the buffer protocol."""

    def __init__(self, array):
        self.__array_interface__ = array.__array_interface__
        self._array = array


class video_frame:
    def __init__(self, array):
        self._array = array

    def get_data(self):
        return BufData(self._array)


class composite_frame:
    def __init__(self, number, is_aligned=False):
        self.number, self.is_aligned = number, is_aligned

    def get_color_frame(self):
        return video_frame(sample.color(self.number))

    def get_depth_frame(self):
        assert self.is_aligned, "the depth image of the camera itself is another view than the color image"
        return video_frame(sample.depth(self.number))

    def get_timestamp(self):
        return 1000.0 * self.number / 30  # ms


class align:
    def __init__(self, align_to):
        assert align_to is stream.color

    def process(self, frames):
        return composite_frame(frames.number, is_aligned=True)


class pipeline:
    def start(self, config):
        wanted = {stream.depth: format.z16, stream.color: format.rgb8}
        assert config.streams == {key: (sample.WIDTH, sample.HEIGHT, each, 30) for key, each in wanted.items()}
        self._next = 0
        return pipeline_profile()

    def wait_for_frames(self, timeout_ms=5000):
        self._next += 1
        if self._next > sample.COUNT:
            raise RuntimeError(f"Frame didn't arrive within {timeout_ms}")
        return composite_frame(self._next - 1)

    def stop(self):
        del self._next


class pipeline_profile:
    def get_device(self):
        return SimpleNamespace(first_depth_sensor=lambda: SimpleNamespace(get_depth_scale=lambda: np.float32(DEPTH_UNIT).item()))

    def get_stream(self, stream_type):
        assert stream_type is stream.color
        lens = SimpleNamespace(
            width=sample.WIDTH, height=sample.HEIGHT, fx=sample.FX, fy=sample.FY, ppx=sample.CX, ppy=sample.CY, coeffs=[0.0] * 5
        )
        return SimpleNamespace(as_video_stream_profile=lambda: SimpleNamespace(get_intrinsics=lambda: lens))
