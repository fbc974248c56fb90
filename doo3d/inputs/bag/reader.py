"""Open bags as captures, without ROS: ROS 1 `.bag`, ROS 2 folders (SQLite or MCAP), `.mcap`, `.db3`, RealSense's SDK."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import InputError, require
from ...guard.guarding import prefixed, read_head
from ...types import Cloud, Floats, Frame, Image
from ...types.plausibility.camera import baseline_notes
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, NONE, OF_DEPTH, ReadOptions, check_used, without_color
from ..support.color_registration import align_color
from ..support.pose_file import TF
from .index import METADATA, SUFFIXES, Bag, Stamp, TopicIndex, is_readable, open_bag, stamp_of, storage_class
from .messages import cloud_of, color_of, depth_of
from .pairing import color_geometry, pair_by_time, transforms_of
from .records import MessageLocation, Topic
from .tf import Transforms
from .topics import Streams
from .undistortion import Lens

_CLOUD = "/PointCloud2"  # end of the type of a message
_Listed = tuple[list[FrameRef], list[str]]
_OPTICAL = "optical"  # in the name of a frame whose origin is the camera (REP 103)


class BagCapture:
    """A bag opened as a capture: ROS 1, ROS 2 or RealSense's SDK.

    There is one frame per depth image, with the color image nearest in time; if no color image is within `options.tolerance`
    (s), the frame has no color; if that is so for all frames, a note says so. A bag without depth images gives one frame per
    cloud or, without clouds either, one per color image. Frames are in order of time, as in the message headers. Poses are
    camera to world and come from /tf; the world is the coordinate frame named map, odom or world.

    In a damaged bag, all complete messages are read, and one frame is added at the end, whose loading raises an InputError about
    the damage.

    Raises
    ------
    InputError : the bag cannot be read, or has no depth image, cloud or color image.
    MissingDependency : the package rosbags is not installed.
    """

    what: ClassVar[str] = (
        "a ROS 1 bag, a ROS 2 bag (folder, MCAP or .db3) or one of RealSense's SDK, with depth images and CameraInfo or clouds"
    )
    format = "bag"
    options: ClassVar[frozenset[str]] = OF_DEPTH | {"color_topic", "depth_topic", "info_topic", "cloud_topic", "tolerance"}

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        require("rosbags.typesys", "bags")
        self.path = path
        self.notes: list[str] = []
        self.no_depth = ""
        bag = Bag(path)
        try:
            index = bag.index()
            faults = bag.faults()
            if without_color(options):
                options = options.model_copy(update={"color_topic": NONE})
            streams = Streams(bag, index, options)
            _check_options(path, streams, options)
            transforms = transforms_of(bag, index)
            _check_base_frame(path, transforms, options)
            self.topics = _topic_lines(index, streams)
            if streams.cloud is not None:
                viewpoint = (0.0, 0.0, 0.0) if _OPTICAL in streams.cloud.frame else None
                setup = _BagSetup(path, stamp_of(path), streams.cloud.topic, viewpoint=viewpoint)
                self.frames = _frames(setup, streams.cloud, transforms, options)
            elif streams.depth is not None:
                self.frames, self.notes = _depth_frames(bag, index, streams, transforms, options)
            elif streams.color is not None:
                topic_index = streams.color.topic_index
                self.frames = _frames(_BagSetup(path, stamp_of(path), topic_index.topic), topic_index, None, options)
            else:
                raise _no_frames(bag, faults, streams.unread_depth)
            if streams.depth is None and streams.cloud is None:
                self.no_depth = streams.unread_depth
        finally:
            bag.close()
        if faults:
            more = f"; and {len(faults) - 1} more faults" if len(faults) > 1 else ""
            sentence = f"{faults[0]}{more}; the {len(self.frames)} frames before this one are complete"
            self.frames.append(FrameRef(f"{len(self.frames):06d}", path, partial(_fail, sentence), self.frames[-1].timestamp))

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a file with the first bytes or the suffix of a bag, or the folder of a ROS 2 bag."""
        if path.is_dir():
            return _describes_bag(path / METADATA) or any(file.suffix in (".mcap", ".db3") for file in path.iterdir())
        return storage_class(path) is not None or path.suffix.lower() in SUFFIXES


def _topic_lines(index: Mapping[str, TopicIndex], streams: Streams) -> list[str]:
    """Return a line for each topic of a type that is read: name, type, number of messages, use."""
    used = [(stream.topic_index, use) for stream, use in ((streams.depth, "depth"), (streams.color, "color")) if stream]
    used += [(streams.cloud, "clouds")] if streams.cloud else []
    uses = {topic_index.topic.name: f", read as {use}" for topic_index, use in used}
    return [
        f"{name} ({each.topic.kind}, {len(each)} message{'s' * (len(each) != 1)}){uses.get(name, '')}"
        for name, each in sorted(index.items())
    ]


@dataclass(frozen=True)
class _BagSetup:
    """The parts common to all frames of a bag. extrinsics : rows of the (4, 4) depth-to-color transform, None if aligned."""

    path: Path
    stamp: Stamp
    topic: Topic
    lens: Lens | None = None
    scale: float = 1.0
    color: Topic | None = None
    color_lens: Lens | None = None
    extrinsics: tuple[tuple[float, ...], ...] | None = None
    viewpoint: tuple[float, ...] | None = None


def _depth_frames(bag: Bag, index: Mapping[str, TopicIndex], streams: Streams, tf: Transforms, options: ReadOptions) -> _Listed:
    depth, color, notes, locations = streams.depth, streams.color, list[str](), dict[int, MessageLocation]()
    assert depth is not None
    assert depth.lens is not None
    setup = _BagSetup(bag.path, stamp_of(bag.path), depth.topic_index.topic, depth.lens, depth.scale)
    if color is not None:
        required = options.color_topic is not None
        pairs, note = pair_by_time(bag.path, depth.topic_index, color.topic_index, options.tolerance, required)
        notes += [note] if note else []
        locations = {i: color.topic_index.location(j) for i, j in enumerate(pairs.tolist()) if j >= 0}
        if not note:
            lens, extrinsics = color_geometry(bag, index, depth, color, tf, int(depth.topic_index.clock()[0]))
            setup = replace(setup, color=color.topic_index.topic, color_lens=lens, extrinsics=extrinsics)
            notes += [] if extrinsics is None else baseline_notes(np.array(extrinsics))
    return _frames(setup, depth.topic_index, tf, options, locations), notes


def _frames(
    setup: _BagSetup,
    topic_index: TopicIndex,
    transforms: Transforms | None,
    options: ReadOptions,
    color: Mapping[int, MessageLocation] | None = None,
) -> list[FrameRef]:
    """Return the frames of a topic in order of time; color : number of a depth message -> location of its color image."""
    times, frames = topic_index.clock(), []
    for number, i in enumerate(np.argsort(times, kind="stable").tolist()):
        name, time = f"{number:06d}", int(times[i])
        pose = None if transforms is None else _pose(transforms, topic_index.frame, time, options)
        load = partial(_load, setup, name, time / 1e9, topic_index.location(i), (color or {}).get(i), pose)
        frames.append(FrameRef(name, setup.path, load, time / 1e9))
    return frames


def _check_options(path: Path, streams: Streams, options: ReadOptions) -> None:
    """Raise InputError if options about depth images or their color are set, but no depth images are read."""
    used = BagCapture.options
    if options.camera_file is not None:  # which the camera and the unit are from
        options = options.model_copy(update={"camera": None, "depth_scale": None})
    if streams.depth is None:
        used -= OF_DEPTH | {"info_topic", "tolerance"}
        used -= {"depth_topic", "color_topic"} if options.cloud_topic else set()
        check_used(options, used, f"{path}, of which no depth images are read")
    elif streams.depth.encoding.startswith("32F"):
        check_used(options, used - {"depth_scale"}, f"{path}, whose depth is in metres")


def _check_base_frame(path: Path, transforms: Transforms, options: ReadOptions) -> None:
    """Raise InputError if the option `pose` names a coordinate frame that is not in the tf of the bag."""
    name = _base_frame(options)
    if name is not None and name not in transforms.frames:
        listed = ", ".join(transforms.frames)
        has = f"has the frames {listed}" if listed else "is empty (no tf2_msgs/TFMessage)"
        raise InputError(f"{path}: no frame {name!r} in its tf, which {has}", code="pose-missing")


def _base_frame(options: ReadOptions) -> str | None:
    """Return the coordinate frame that the option `pose` names; None if it names none."""
    is_frame = isinstance(options.pose, str) and options.pose.startswith(TF)
    return str(options.pose).removeprefix(TF).lstrip("/") if is_frame else None


def _pose(transforms: Transforms, frame: str, time: int, options: ReadOptions) -> Floats | None:
    """Return the (4, 4) pose of a frame at a time (ns): in the frame that the option `pose` names, else in the world."""
    target = _base_frame(options)
    return transforms.pose(frame, time) if target is None else transforms.between(frame, target, time)


def _load(
    setup: _BagSetup, name: str, time: float, location: MessageLocation, color: MessageLocation | None, pose: Floats | None
) -> FrameData:
    bag = open_bag(setup.path, setup.stamp)
    with prefixed(f"{setup.path}: frame {name}", setup.path):
        message = bag.message(setup.topic, location)
        if setup.topic.kind.endswith(_CLOUD):
            points, colors = cloud_of(message)
            if not len(points):
                raise InputError(f"the cloud on {setup.topic.name} holds no points with finite coordinates", code="cloud-empty")
            viewpoint = None if setup.viewpoint is None else np.array(setup.viewpoint)
            return FrameData(Cloud(points, colors, viewpoint, name, time), pose=pose)
        if setup.lens is None:
            return FrameData(Image(color_of(message), name, time))
        raw, camera = depth_of(message, setup.scale), setup.lens.camera
        if raw.shape != (camera.height, camera.width):
            sentence = f"the depth image is {raw.shape[1]}x{raw.shape[0]}, the first one is {camera.width}x{camera.height}"
            raise InputError(sentence, code="depth-shape")
        metres, image = setup.lens.undistorted(raw, nearest=True), None
        if color is not None and setup.color is not None and setup.color_lens is not None:
            image = setup.color_lens.undistorted(color_of(bag.message(setup.color, color)), nearest=False)
            if setup.extrinsics is not None:
                image = align_color(image, setup.color_lens.camera, metres, camera, np.array(setup.extrinsics))
        return FrameData(Frame(image, metres, camera, name, time), pose=pose)


def _fail(sentence: str) -> FrameData:
    raise InputError(sentence, code="bag-damaged")


def _describes_bag(metadata: Path) -> bool:
    return metadata.is_file() and b"rosbag2_bagfile_information" in read_head(metadata, 4096)


def _no_frames(bag: Bag, faults: list[str], unread: str) -> InputError:
    """Return the error for a bag without any frames."""
    topics = [
        f"{topic.name} ({topic.kind}{'' if is_readable(topic) else ', ' + topic.encoding})"
        for topic in sorted(bag.topics.values())
    ]
    if faults and not topics:
        return InputError(f"{bag.path}: nothing in it can be read: {faults[0]}", code="bag-damaged")
    listed = f"it has the topics {', '.join(topics) or '(none)'}"
    sentence = unread or "has no depth images, no clouds and no color images"
    return InputError(f"{bag.path}: {sentence}; {'; '.join([listed, *faults[:1]])}", code="frames-missing")
