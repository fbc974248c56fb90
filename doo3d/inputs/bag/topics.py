"""Choose the topics of a bag for depth, color and clouds, with the intrinsics of their cameras."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import PurePosixPath
from typing import Any

from ...errors import InputError
from ...guard.guarding import prefixed
from ...types import Camera
from ..read_options import NONE, ReadOptions
from . import realsense
from .index import Bag, TopicIndex
from .messages import encoding_of, is_color, is_depth, is_gray, size_of
from .undistortion import Lens

MILLIMETRES = 1000.0  # units per metre of 16UC1 (REP 118)
_CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_INFRARED_OR_CONFIDENCE = re.compile(r"infra|confidence|(^|[/_])ir([/_]|\d|$)")
_MAX_ATTEMPTS = 20  # messages of a topic that are read until one is complete
_TRANSPORT = re.compile(r"/(compressed|compressedDepth)$")


@dataclass(frozen=True)
class Stream:
    """The images of one topic of a bag.

    Attributes
    ----------
    topic_index
        the messages of the topic.
    encoding
        encoding of the first complete image, such as "16UC1", "rgb8" or "compressed".
    size
        (width, height) px.
    lens
        pinhole camera and lens distortion; None if unknown.
    scale
        units per metre of depth images with integer pixels; meaningless for other images.
    """

    topic_index: TopicIndex
    encoding: str
    size: tuple[int, int]
    lens: Lens | None = None
    scale: float = MILLIMETRES

    @property
    def name(self) -> str:
        """Name of the topic."""
        return self.topic_index.topic.name


class Streams:
    """The topics of a bag to read: a depth and a color topic, or a cloud topic.

    Topics named in the options are used. Otherwise topics are chosen by name and encoding: preferably a depth topic whose name
    says that it is aligned to color or rectified, and a color topic with color or rgb in its name that shares the most leading
    parts of the depth topic's name. Clouds are read if `options.cloud_topic` names a topic, or if the bag has no depth images and
    either no color images or the options set neither `depth_topic` nor `color_topic`.

    Attributes
    ----------
    depth, color
        topic of the depth images, with a known lens, and topic of the color images; None if the bag has none, or the option is
        "none", or `options.cloud_topic` names a topic.
    cloud
        messages of the cloud topic; None if no clouds are read. If set, it is read instead of `color`.
    unread_depth
        reason why a topic with depth in its name is not read; empty if there is no such topic.

    Raises
    ------
    InputError : a requested topic is missing, several fit equally well, or the depth camera's CameraInfo is missing or wrong.
    """

    def __init__(self, bag: Bag, index: Mapping[str, TopicIndex], options: ReadOptions) -> None:
        self._bag, self._index, self._options = bag, index, options
        self.depth: Stream | None = None
        self.color: Stream | None = None
        self.unread_depth = ""
        self._unread: dict[str, InputError] = {}
        self.cloud = self._requested("cloud_topic", ("sensor_msgs/msg/PointCloud2",))
        if self.cloud is not None:
            return
        self._images = self._image_streams()
        self.depth = self._choose("depth_topic", _is_depth, self._depth_rank)
        self.color = self._choose("color_topic", _is_color, self._color_rank)
        if self.depth is None and options.depth_topic != NONE:
            self.unread_depth = self._why_unread()
        if self.depth is None:
            clouds = [topic for topic in index.values() if topic.topic.kind.endswith("/PointCloud2") and len(topic)]
            if clouds and (self.color is None or (options.depth_topic is None and options.color_topic is None)):
                self.cloud = self._best(clouds, lambda topic: (topic.topic.name.count("/"),), "cloud_topic")
        if self.depth is not None:
            self.depth = self._with_lens(self.depth, options.info_topic)
        if self.color is not None:
            self.color = self._with_lens(self.color, None)

    def _image_streams(self) -> dict[str, Stream]:
        """Return the topics with images, with encoding and size of the first complete image."""
        streams = {}
        for name, topic_index in self._index.items():
            for i in range(min(len(topic_index), _MAX_ATTEMPTS) if topic_index.topic.kind in _IMAGES else 0):
                try:
                    message = self._bag.message(topic_index.topic, topic_index.location(i))
                    streams[name] = Stream(topic_index, encoding_of(message), size_of(message))
                    break
                except InputError as error:
                    self._unread[name] = error
        self._unread = {name: error for name, error in self._unread.items() if name not in streams}
        return streams

    def _why_unread(self) -> str:
        """Return the reason why the first topic with depth in its name is not read; empty if there is none."""
        for name, stream in self._images.items():
            if _is_lossy_depth(stream):
                return f"{name} is depth in 8 bits (JPEG), which loses it: record compressedDepth or the raw topic"
        return next((f"{name}: {error}" for name, error in self._unread.items() if _names_depth(name)), "")

    def _requested(self, key: str, kinds: tuple[str, ...]) -> TopicIndex | None:
        """Return the topic named by the option `key`, of one of the message types `kinds`; None if the option names none."""
        name = getattr(self._options, key)
        if name is None or name == NONE:
            return None
        topic_index = self._index.get(name) or self._index.get(f"/{name}")
        if topic_index is None or topic_index.topic.kind not in kinds or not len(topic_index):
            names = sorted(name for name, other in self._index.items() if other.topic.kind in kinds and len(other))
            choice = f"choose one of {', '.join(names)}" if names else "it has none of this type"
            raise InputError(f"{self._bag.path}: has no topic {name} for {key}; {choice}", code="topic-missing")
        return topic_index

    def _choose(self, key: str, fits: Callable[[Stream], bool], rank: Callable[[TopicIndex], tuple[Any, ...]]) -> Stream | None:
        """Return the stream named by the option `key`, else the best-ranked one that fits; None if there is none."""
        if getattr(self._options, key) == NONE:
            return None
        requested = self._requested(key, _IMAGES)
        if requested is not None:
            stream = self._images.get(requested.topic.name)
            if stream is None:
                name, cause = requested.topic.name, self._unread[requested.topic.name]
                raise InputError(f"{self._bag.path}: {name} has no image that can be read: {cause}", code=cause.code)
            return stream
        candidates = [stream.topic_index for stream in self._images.values() if fits(stream)]
        return self._images[self._best(candidates, rank, key).topic.name] if candidates else None

    def _best(self, candidates: list[TopicIndex], rank: Callable[[TopicIndex], tuple[Any, ...]], key: str) -> TopicIndex:
        """Return the candidate of lowest rank; raise InputError if two share it."""
        best = min(map(rank, candidates))
        first, *tied = sorted((each for each in candidates if rank(each) == best), key=lambda each: each.topic.name)
        if tied:
            names = ", ".join(each.topic.name for each in (first, *tied))
            sentence = f"{names} are equally good: choose one, such as --input-option {key}={first.topic.name}"
            raise InputError(f"{self._bag.path}: {sentence}", code="topic-ambiguous")
        return first

    def _depth_rank(self, candidate: TopicIndex) -> tuple[Any, ...]:
        name = candidate.topic.name.lower()
        order = ("depth_to_", "depth_registered", "rect", "depth")  # aligned_depth_to_color, depth_to_rgb
        return (next((i for i, word in enumerate(order) if word in name), len(order)), _is_compressed(candidate))

    def _color_rank(self, candidate: TopicIndex) -> tuple[Any, ...]:
        name, parts = candidate.topic.name, PurePosixPath(self.depth.name if self.depth else "").parts
        unshared = -sum(a == b for a, b in zip(PurePosixPath(name).parts, parts, strict=False))
        is_gray_image, is_infrared = is_gray(self._images[name].encoding), _INFRARED_OR_CONFIDENCE.search(name) is not None
        unnamed, unrectified = re.search(r"colou?r|rgb", name.lower()) is None, not _is_rectified(name)
        return is_infrared, is_gray_image, unnamed, unshared, unrectified, _is_compressed(candidate)

    def _with_lens(self, stream: Stream, info: str | None) -> Stream:
        """Return the stream with its camera and unit, from the options or else from the bag."""
        if stream is not self.depth:
            return replace(stream, lens=self._lens(stream, info))
        options, scale = self._options, self._options.depth_scale
        if scale is None and realsense.stream_of(stream.name) and not stream.encoding.startswith("32F"):
            scale = realsense.depth_scale(self._bag, self._index, stream.name)
        lens = Lens(Camera(*options.camera, *stream.size)) if options.camera is not None else self._lens(stream, info)
        if lens is None:
            fault = f"has no CameraInfo for {stream.name} (expected on {_info_name(stream.name)})"
            remedy = "name its topic with --input-option info_topic=..., or give --input-option 'camera=[fx, fy, cx, cy]'"
            raise InputError(f"{self._bag.path}: {fault}: {remedy}", code="intrinsics-missing")
        return replace(stream, lens=lens, scale=stream.scale if scale is None else scale)

    def _lens(self, stream: Stream, info: str | None) -> Lens | None:
        """Return the lens from the requested CameraInfo, the one beside the images, or one of the same frame and size."""
        paired = self._requested("info_topic", (_CAMERA_INFO,)) if info else self._index.get(_info_name(stream.name))
        infos = [paired] if paired else [each for each in self._index.values() if each.topic.kind == _CAMERA_INFO]
        for other in infos:
            if len(other) and (paired is not None or (other.frame and other.frame == stream.topic_index.frame)):
                message = self._bag.message(other.topic, other.location(0))
                if paired is not None or (message.width, message.height) == stream.size:
                    return self._lens_of(message, other.topic.name, stream)
        return None

    def _lens_of(self, info: Any, name: str, stream: Stream) -> Lens:
        """Return the lens of a CameraInfo message of the topic `name`; raise InputError if it does not fit the images."""
        where = f"{self._bag.path}: {name}"
        size = (int(info.width) or stream.size[0], int(info.height) or stream.size[1])
        if size != stream.size:
            remedy = "name the right one with --input-option info_topic=..., or give --input-option 'camera=[fx, fy, cx, cy]'"
            remedy = remedy if _is_depth(stream) else realsense.DEPTH_ALONE
            sizes = f"is for {size[0]}x{size[1]} but the images of {stream.name} are {stream.size[0]}x{stream.size[1]}"
            raise InputError(f"{where} {sizes}: {remedy}", code="intrinsics-size")
        matrix, projection, distortion = (info.K, info.P, info.D) if hasattr(info, "K") else (info.k, info.p, info.d)
        pinhole, coefficients = matrix[[0, 4, 2, 5]], tuple(distortion.tolist())
        if _is_rectified(stream.name) and projection[0] > 0:
            pinhole, coefficients = projection[[0, 5, 2, 6]], ()
        with prefixed(where):
            fx, fy, cx, cy = pinhole.tolist()
            lens = Lens(Camera(fx, fy, cx, cy, *size), info.distortion_model, coefficients)
            lens.check()
        return lens


def _info_name(topic: str) -> str:
    """Return the topic of the CameraInfo that belongs to a topic of images, by convention."""
    stream = realsense.stream_of(topic)
    return f"{stream}/info/camera_info" if stream else f"{_TRANSPORT.sub('', topic).rpartition('/')[0]}/camera_info"


def _is_rectified(topic: str) -> bool:
    return "rect" in PurePosixPath(_TRANSPORT.sub("", topic)).name


def _is_compressed(topic_index: TopicIndex) -> bool:
    return topic_index.topic.kind.endswith("/CompressedImage")


def _is_depth(stream: Stream) -> bool:
    if recorded := realsense.stream_of(stream.name):
        return recorded.rpartition("/")[2].startswith("Depth")
    name = stream.name.lower()
    is_named = stream.encoding != "mono16" or "depth" in name
    return is_depth(stream.encoding) and is_named and not _INFRARED_OR_CONFIDENCE.search(name)


def _is_color(stream: Stream) -> bool:
    if recorded := realsense.stream_of(stream.name):
        return recorded.rpartition("/")[2].startswith("Color")
    return is_color(stream.encoding) and not _is_depth(stream) and not _is_lossy_depth(stream)


def _is_lossy_depth(stream: Stream) -> bool:
    """Return whether images are depth compressed to 8 bits, by the name of their topic."""
    return stream.encoding == "compressed" and _names_depth(stream.name)


def _names_depth(topic: str) -> bool:
    """Return whether the last two parts of a topic's name contain depth but not color, as in camera/depth/image_raw."""
    parts = _TRANSPORT.sub("", topic.lower()).rsplit("/", 2)[-2:]
    return any("depth" in part for part in parts) and not re.search(r"colou?r|rgb", parts[-1].replace("depth_to_color", ""))
