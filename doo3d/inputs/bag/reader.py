"""Bags: ROS 1 `.bag`, ROS 2 folders (SQLite or MCAP), `.mcap`, `.db3`, and those of RealSense's SDK. No ROS is needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import InputError, require
from ...types import Cloud, Floats, Frame, Image
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from .color_alignment import align_color
from .index import ENCODINGS, METADATA, SUFFIXES, Bag, Found, Stamp, kind_of, opened, stamp_of
from .messages import cloud_of, color_of, depth_of
from .pairing import partners_of, relation, transforms_of
from .records import Place, Topic
from .tf import Transforms
from .topics import Stream, Streams
from .undistortion import Lens

_OPTICAL = "optical"  # in the name of a frame: the camera is at its origin (REP 103)


class BagCapture:
    """The depth images of a bag, each with the colour image nearest in time; or its clouds; or its colour images alone.

    Frames are in the order of their headers' stamps. A depth image without a colour image within `options.tolerance` is a
    frame without colour. Of a bag that is cut off or damaged what is whole is used, and one more frame fails and says so.
    """

    what: ClassVar[str] = (
        "a ROS 1 bag, a ROS 2 bag (folder, MCAP or .db3) or one of RealSense's SDK, with depth images and CameraInfo or clouds"
    )
    format = "bag"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        require("rosbags.typesys", "bags")
        self.path = path
        bag = Bag(path)
        try:
            index = bag.index()
            faults = bag.faults()
            streams = Streams(bag, index, options)
            transforms = transforms_of(bag, index)
            self.parts = _parts(index, streams)
            if streams.cloud is not None:
                self.frames = _clouds(path, streams.cloud, transforms)
            elif streams.depth is not None:
                self.frames = _frames(bag, index, streams.depth, streams.color, transforms, options)
            elif streams.color is not None:
                self.frames = _images(path, streams.color)
            else:
                raise _nothing(bag, faults)
        finally:
            bag.close()
        if faults:
            more = f"; and {len(faults) - 1} more faults" if len(faults) > 1 else ""
            sentence = f"{faults[0]}{more}; the {len(self.frames)} frames before this one are used"
            self.frames.append(FrameRef(f"{len(self.frames):06d}", path, partial(_fail, sentence), self.frames[-1].timestamp))

    @staticmethod
    def can_read(path: Path) -> bool:
        """Whether `path` is a file that starts as bags do, or failing that is called so; or a folder of a ROS 2 bag."""
        if path.is_dir():
            return _describes_bag(path / METADATA) or any(file.suffix in (".mcap", ".db3") for file in path.iterdir())
        return kind_of(path) is not None or path.suffix.lower() in SUFFIXES


def _parts(index: Mapping[str, Found], streams: Streams) -> list[str]:
    """The topics of the types that matter, with how many messages they have and what they are read as."""
    chosen = {"depth": streams.depth, "colour": streams.color, "clouds": streams.cloud}
    read = {(one if isinstance(one, Found) else one.found).topic.name: what for what, one in chosen.items() if one is not None}
    return [
        f"{name} ({found.topic.kind}, {len(found)} message{'s' * (len(found) != 1)})"
        + (f", read as {read[name]}" if name in read else "")
        for name, found in sorted(index.items())
    ]


@dataclass(frozen=True)
class _Recipe:
    """How the frames of a bag are read. extrinsics : rows of the (4, 4) from depth to colour; None where they are aligned."""

    path: Path
    stamp: Stamp
    depth: Topic
    lens: Lens
    scale: float
    color: Topic | None = None
    color_lens: Lens | None = None
    extrinsics: tuple[tuple[float, ...], ...] | None = None


def _frames(
    bag: Bag, index: Mapping[str, Found], depth: Stream, color: Stream | None, transforms: Transforms, options: ReadOptions
) -> list[FrameRef]:
    assert depth.lens is not None
    clock = depth.found.clock()
    recipe = _Recipe(bag.path, stamp_of(bag.path), depth.found.topic, depth.lens, depth.scale)
    partners = np.full(len(clock), -1)
    if color is not None:
        partners = partners_of(bag.path, depth.found, color.found, options.tolerance)
        lens, extrinsics = relation(bag, index, depth, color, transforms, int(clock[0]))
        recipe = replace(recipe, color=color.found.topic, color_lens=lens, extrinsics=extrinsics)
    entries = []
    for number, at in enumerate(np.argsort(clock, kind="stable").tolist()):
        time = int(clock[at])
        place = color.found.place(int(partners[at])) if color is not None and partners[at] >= 0 else None
        load = partial(
            _load, recipe, f"{number:06d}", time / 1e9, depth.found.place(at), place, transforms.pose(depth.found.frame, time)
        )
        entries.append(FrameRef(f"{number:06d}", bag.path, load, time / 1e9))
    return entries


def _load(recipe: _Recipe, name: str, time: float, depth: Place, color: Place | None, pose: Floats | None) -> FrameData:
    bag = opened(recipe.path, recipe.stamp)
    try:
        raw = depth_of(bag.message(recipe.depth, depth), recipe.scale)
        camera = recipe.lens.camera
        if raw.shape != (camera.height, camera.width):
            raise InputError(
                f"the depth image is {raw.shape[1]}x{raw.shape[0]}, the first was {camera.width}x{camera.height}",
                code="depth-shape",
            )
        metres = recipe.lens.undistorted(raw, nearest=True)
        picture = None
        if color is not None and recipe.color is not None and recipe.color_lens is not None:
            picture = recipe.color_lens.undistorted(color_of(bag.message(recipe.color, color)), nearest=False)
            if recipe.extrinsics is not None:
                picture = align_color(picture, recipe.color_lens.camera, metres, camera, np.array(recipe.extrinsics))
        return FrameData(Frame(picture, metres, camera, name, time), pose=pose)
    except InputError as error:
        raise _located(error, recipe.path, name) from None


def _clouds(path: Path, found: Found, transforms: Transforms) -> list[FrameRef]:
    clock, stamp = found.clock(), stamp_of(path)
    viewpoint = (0.0, 0.0, 0.0) if _OPTICAL in found.frame else None
    entries = []
    for number, at in enumerate(np.argsort(clock, kind="stable").tolist()):
        time, name = int(clock[at]), f"{number:06d}"
        what = (path, stamp, found.topic, name, time / 1e9, found.place(at), viewpoint, transforms.pose(found.frame, time))
        entries.append(FrameRef(name, path, partial(_load_cloud, *what), time / 1e9))
    return entries


def _load_cloud(
    path: Path,
    stamp: Stamp,
    topic: Topic,
    name: str,
    time: float,
    place: Place,
    viewpoint: tuple[float, ...] | None,
    pose: Floats | None,
) -> FrameData:
    try:
        points, colors = cloud_of(opened(path, stamp).message(topic, place))
        if not len(points):
            raise InputError(f"the cloud on {topic.name} holds no points with finite coordinates", code="cloud-empty")
        return FrameData(Cloud(points, colors, None if viewpoint is None else np.array(viewpoint), name, time), pose=pose)
    except InputError as error:
        raise _located(error, path, name) from None


def _images(path: Path, color: Stream) -> list[FrameRef]:
    clock, stamp = color.found.clock(), stamp_of(path)
    entries = []
    for number, at in enumerate(np.argsort(clock, kind="stable").tolist()):
        what = (path, stamp, color.found.topic, f"{number:06d}", int(clock[at]) / 1e9, color.found.place(at))
        entries.append(FrameRef(f"{number:06d}", path, partial(_load_image, *what), int(clock[at]) / 1e9))
    return entries


def _load_image(path: Path, stamp: Stamp, topic: Topic, name: str, time: float, place: Place) -> FrameData:
    try:
        return FrameData(Image(color_of(opened(path, stamp).message(topic, place)), name, time))
    except InputError as error:
        raise _located(error, path, name) from None


def _located(error: InputError, path: Path, name: str) -> InputError:
    return error if str(path) in str(error) else InputError(f"{path}: frame {name}: {error}", code=error.code)


def _fail(sentence: str) -> FrameData:
    raise InputError(sentence, code="bag-damaged")


def _describes_bag(metadata: Path) -> bool:
    if not metadata.is_file():
        return False
    with metadata.open("rb") as file:
        return b"rosbag2_bagfile_information" in file.read(4096)


def _nothing(bag: Bag, faults: list[str]) -> InputError:
    """Return the error that a bag without any frames is refused with."""
    there = [
        f"{topic.name} ({topic.kind}{'' if topic.encoding in ENCODINGS else ', ' + topic.encoding})"
        for topic in bag.topics.values()
    ]
    if faults and not there:
        return InputError(f"{bag.path}: nothing in it can be read: {faults[0]}", code="bag-damaged")
    return InputError(
        f"{bag.path}: has no depth images, no clouds and no colour images; "
        f"it has the topics {', '.join(sorted(there)) or '(none)'}",
        code="frames-missing",
    )
