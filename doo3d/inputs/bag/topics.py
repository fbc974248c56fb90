"""Which topics of a bag hold the depth, the colour and the clouds, and what is known of the cameras."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

from ...errors import InputError
from ...types import Camera
from ..read_options import ReadOptions
from . import realsense
from .index import Bag, Found
from .messages import encoding_of, is_color, is_depth, is_grey, size_of
from .undistortion import Lens

NONE = "none"  # as a topic: there is to be none
MILLIMETRES = 1000.0  # units per metre of 16UC1 (REP 118)
_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_NO_DEPTH = re.compile(r"infra|confidence|(^|[/_])ir([/_]|\d|$)")
_TRIES = 20  # messages of a topic that are looked at until one is whole
_TRANSPORT = re.compile(r"/(compressed|compressedDepth)$")


@dataclass(frozen=True)
class Stream:
    """Images of one topic. size : width, height px. scale : units of whole numbers per metre. lens : None where not known."""

    found: Found
    encoding: str
    size: tuple[int, int]
    lens: Lens | None = None
    scale: float = MILLIMETRES

    @property
    def name(self) -> str:
        """Of the topic."""
        return self.found.topic.name


class Streams:
    """The topics to read. depth, color, cloud : None where there is none, or it is not wanted."""

    def __init__(self, bag: Bag, index: Mapping[str, Found], options: ReadOptions) -> None:
        self._bag, self._index, self._options = bag, index, options
        self.depth: Stream | None = None
        self.color: Stream | None = None
        self.cloud = self._given("cloud_topic", ("sensor_msgs/msg/PointCloud2",))
        if self.cloud is not None:
            return
        self._images = self._whole_images()
        self.depth = self._choose("depth_topic", _is_depth, self._depth_rank)
        self.color = self._choose("color_topic", _is_color, self._color_rank)
        if self.depth is None and options.depth_topic is None:
            clouds = [found for found in index.values() if found.topic.kind.endswith("/PointCloud2") and len(found)]
            if clouds and options.color_topic is None:
                self.cloud = self._single(clouds, lambda found: (found.topic.name.count("/"),), "cloud_topic")
        if self.depth is not None:
            self.depth = self._with_lens(self.depth, options.info_topic)
        if self.color is not None:
            self.color = self._with_lens(self.color, None)

    def _whole_images(self) -> dict[str, Stream]:
        """All topics with images, each by the first of them that is whole."""
        result = {}
        for name, found in self._index.items():
            if found.topic.kind in _IMAGES and (message := self._first(found)) is not None:
                result[name] = Stream(found, encoding_of(message), size_of(message))
        return result

    def _first(self, found: Found) -> Any:
        for index in range(min(len(found), _TRIES)):
            try:
                message = self._bag.message(found.topic, found.place(index))
                size_of(message)
            except InputError:
                continue
            return message
        return None

    def _given(self, key: str, kinds: tuple[str, ...]) -> Found | None:
        """The topic that the user names, whatever it holds; None where he names none."""
        wanted = getattr(self._options, key)
        if wanted is None or wanted == NONE:
            return None
        found = self._index.get(wanted) or self._index.get(f"/{wanted}")
        if found is None or found.topic.kind not in kinds or not len(found):
            there = sorted(name for name, other in self._index.items() if other.topic.kind in kinds and len(other))
            what = f"there are {', '.join(there)}" if there else "there are none of this kind"
            raise InputError(f"{self._bag.path}: has no topic {wanted} for {key}; {what}", code="topic-missing")
        return found

    def _choose(self, key: str, fits: Callable[[Stream], bool], rank: Callable[[Found], tuple[Any, ...]]) -> Stream | None:
        if getattr(self._options, key) == NONE:
            return None
        given = self._given(key, _IMAGES)
        if given is not None:
            stream = self._images.get(given.topic.name)
            if stream is None:
                raise InputError(f"{self._bag.path}: {given.topic.name} holds no image that is whole", code="message-damaged")
            return stream
        candidates = [stream.found for stream in self._images.values() if fits(stream)]
        return self._images[self._single(candidates, rank, key).topic.name] if candidates else None

    def _single(self, candidates: list[Found], rank: Callable[[Found], tuple[Any, ...]], key: str) -> Found:
        """The best one; raises InputError where two are equally good."""
        best = sorted(candidates, key=lambda found: (rank(found), found.topic.name))
        if len(best) > 1 and rank(best[0]) == rank(best[1]):
            same = [found.topic.name for found in best if rank(found) == rank(best[0])]
            raise InputError(
                f"{self._bag.path}: {', '.join(same)} are equally good: choose with --input-option {key}={same[0]}",
                code="topic-ambiguous",
            )
        return best[0]

    def _depth_rank(self, found: Found) -> tuple[Any, ...]:
        name = found.topic.name.lower()
        order = ("depth_to_", "depth_registered", "rect", "depth")  # aligned_depth_to_color, depth_to_rgb
        return (next((i for i, word in enumerate(order) if word in name), len(order)), _is_packed(found))

    def _color_rank(self, found: Found) -> tuple[Any, ...]:
        name, depth = found.topic.name, self.depth.name if self.depth else ""
        beside = len([1 for a, b in zip(PurePosixPath(name).parts, PurePosixPath(depth).parts, strict=False) if a == b])
        words = re.search(r"colou?r|rgb", name.lower()) is None
        base = PurePosixPath(_TRANSPORT.sub("", name)).name
        return (
            _NO_DEPTH.search(name) is not None,
            is_grey(self._images[name].encoding),
            words,
            -beside,
            "rect" not in base,
            _is_packed(found),
        )

    def _with_lens(self, stream: Stream, info: str | None) -> Stream:
        """The stream with what the bag and the user say of its camera."""
        options, depth = self._options, stream is self.depth
        scale = stream.scale
        if depth and options.depth_scale is not None:
            scale = options.depth_scale
        elif depth and realsense.stream_of(stream.name) and not stream.encoding.startswith("32F"):
            scale = realsense.depth_scale(self._bag, self._index, stream.name)
        if depth and options.camera is not None:
            fx, fy, cx, cy = options.camera
            lens: Lens | None = Lens(Camera(fx, fy, cx, cy, *stream.size))
        else:
            lens = self._lens(stream, info)
        if depth and lens is None:
            raise InputError(
                f"{self._bag.path}: there is no CameraInfo for {stream.name} (looked for {_info_name(stream.name)}): "
                "name one with --input-option info_topic=..., or give the camera, --input-option 'camera=[fx, fy, cx, cy]'",
                code="intrinsics-missing",
            )
        return Stream(stream.found, stream.encoding, stream.size, lens, scale)

    def _lens(self, stream: Stream, info: str | None) -> Lens | None:
        kind = "sensor_msgs/msg/CameraInfo"
        found = self._given("info_topic", (kind,)) if info else self._index.get(_info_name(stream.name))
        infos = [found] if found else [other for other in self._index.values() if other.topic.kind == kind]
        for other in infos:
            if not len(other) or (found is None and (other.frame != stream.found.frame or not other.frame)):
                continue
            said = self._bag.message(other.topic, other.place(0))
            if found is None and (said.width, said.height) != stream.size:
                continue
            return self._checked(said, other.topic.name, stream)
        return None

    def _checked(self, said: Any, name: str, stream: Stream) -> Lens:
        where = f"{self._bag.path}: {name}"
        size = (int(said.width) or stream.size[0], int(said.height) or stream.size[1])
        if size != stream.size:
            raise InputError(
                f"{where} is for {size[0]}x{size[1]} but the images of {stream.name} are {stream.size[0]}x{stream.size[1]}: "
                + (
                    "name the right one with --input-option info_topic=..., or give --input-option 'camera=[fx, fy, cx, cy]'"
                    if _is_depth(stream)
                    else "read the depth alone, with --input-option color_topic=none"
                ),
                code="intrinsics-size",
            )
        upper = hasattr(said, "K")
        inner, outer, given = (said.K, said.P, said.D) if upper else (said.k, said.p, said.d)
        rectified = "rect" in PurePosixPath(_TRANSPORT.sub("", stream.name)).name and outer[0] > 0
        numbers = (outer[0], outer[5], outer[2], outer[6]) if rectified else (inner[0], inner[4], inner[2], inner[5])
        fx, fy, cx, cy = (float(number) for number in numbers)
        try:
            lens = Lens(Camera(fx, fy, cx, cy, *size), said.distortion_model, () if rectified else tuple(float(d) for d in given))
            lens.check()
        except InputError as error:
            raise InputError(f"{where}: {error}", code=error.code) from None
        return lens


def _info_name(topic: str) -> str:
    stream = realsense.stream_of(topic)
    return f"{stream}/info/camera_info" if stream else f"{_TRANSPORT.sub('', topic).rpartition('/')[0]}/camera_info"


def _is_packed(found: Found) -> bool:
    return found.topic.kind.endswith("/CompressedImage")


def _is_depth(stream: Stream) -> bool:
    name = stream.name.lower()
    if realsense.stream_of(stream.name):
        return realsense.is_depth_stream(stream.name)
    return is_depth(stream.encoding) and not _NO_DEPTH.search(name) and (stream.encoding != "mono16" or "depth" in name)


def _is_color(stream: Stream) -> bool:
    if realsense.stream_of(stream.name):
        return realsense.is_color_stream(stream.name)
    return is_color(stream.encoding) and not _is_depth(stream)
