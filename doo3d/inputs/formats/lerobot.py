"""Read data sets of LeRobot with depth stored as video: codes of 12 bits in HEVC, decoded by PyAV.

Layout: github.com/huggingface/lerobot, docs "LeRobotDataset v3.0": meta/info.json, videos/<feature>/chunk-*/file-*.mp4,
data/chunk-*/file-*.parquet; version 2 has videos/chunk-*/<feature>/episode_*.mp4.
"""

import math
from collections.abc import Iterator, Mapping
from functools import lru_cache, partial
from pathlib import Path
from threading import Lock
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...errors import InputError, require
from ...guard.file_names import is_file_name
from ...guard.guarding import guarded
from ...guard.limits import check_pixels
from ...guard.parsing import read_json
from ...types import Array, Floats, Frame
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, NONE, OF_CAMERA, ReadOptions, without_color
from ..support.camera_search import REMEDY
from ..support.color_registration import scaled_to_depth
from ..support.depth_frames import Pinhole, camera_for, check_unit

_INFO = Path("meta", "info.json")
_EXTRA = "lerobot"
_CODE_BITS = range(9, 17)  # of a pixel's depth code; LeRobot writes 12
_COLOR_NOTE = "depth is read alone: LeRobot does not align color to it; if yours is, give --input-option color_topic={}"
_MAX_REORDERED = 16  # frames by which HEVC decodes one before those that are shown earlier: the size of its buffer
_TIME_COLUMNS = ["timestamp", "episode_index"]

Stamp = tuple[int, int]  # time of change in ns and size in bytes of a file


class _Place(NamedTuple):
    """The location of a frame: video file, its stamp, and number of the frame in the video, from 0."""

    file: Path
    stamp: Stamp
    number: int


class _Coding(NamedTuple):
    """The coding of depth: depths in m of the least and the greatest code, shift in m, and whether it is logarithmic."""

    least: float
    greatest: float
    shift: float
    is_log: bool

    def metres(self, codes: Array, bits: int) -> Floats:
        """Convert depth codes of a number of bits to depth, (H, W) float32 m; code 0 (no reading) becomes depth 0."""
        largest = (1 << bits) - 1
        table = np.arange(largest + 1) / largest
        if self.is_log:
            low, high = math.log(self.least + self.shift), math.log(self.greatest + self.shift)
            table = np.exp(table * (high - low) + low) - self.shift
        else:
            table = self.least + table * (self.greatest - self.least)
        table[0] = 0
        return table.astype(np.float32)[np.minimum(codes, largest)]


class LeRobotCapture:
    """A LeRobot data set opened as a capture: its frames by number from 000000, all episodes one after the other.

    The times are those of the data set, each episode at its place in the recording. The depth feature is the one that
    `depth_topic` names, or the first. LeRobot does not align color to depth, so color is read only if `color_topic` names it.

    Raises
    ------
    InputError : no feature is depth in a video, a file is missing or damaged, or the intrinsics are not given.
    MissingDependency : PyAV or pyarrow is not installed.
    """

    what: ClassVar[str] = "a data set of LeRobot with depth as video (meta/info.json, videos/; extra lerobot, needs --camera)"
    format = "lerobot"
    options: ClassVar[frozenset[str]] = OF_CAMERA | {"color=none", "depth_topic", "color_topic"}

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        where, info = path / _INFO, read_json(path / _INFO)
        features = info["features"]
        depths = [name for name, feature in features.items() if _entries(feature).get("is_depth_map") is True]
        others = [name for name, feature in features.items() if feature.get("dtype") == "video" and name not in depths]
        depth = _chosen(options.depth_topic, depths, where)
        color = None if without_color(options) or options.color_topic == NONE else options.color_topic
        if color is not None and color not in others:
            listed = ", ".join(others) or "none"
            raise InputError(f"{where}: color_topic={color}: the color videos are {listed}", code="topic-missing")
        is_unasked = others and options.color_topic is None and not without_color(options)
        self.notes = [_COLOR_NOTE.format(others[0])] if is_unasked else []
        coding = _coding(features[depth], f"{where}: {depth}")
        if options.camera is None:
            raise InputError(f"{where}: LeRobot stores no intrinsics of its cameras: {REMEDY}", code="intrinsics-missing")
        require("av", _EXTRA)
        places, colors = _places(path, depth), None if color is None else _places(path, color)
        if colors is not None and len(colors) != len(places):
            sentence = f"{path}: {depth} has {len(places)} frames and {color} {len(colors)}: is the data set complete?"
            raise InputError(sentence, code="frame-count")
        times = _times(path, len(places), info.get("fps"))
        self.frames = []
        for i, (place, time) in enumerate(zip(places, times, strict=True)):
            load = partial(_load, f"{i:06d}", place, None if colors is None else colors[i], coding, options.camera, time)
            self.frames.append(FrameRef(f"{i:06d}", place.file, load, time))

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a folder with meta/info.json of LeRobot."""
        if not (path / _INFO).is_file():
            return False
        try:
            info = read_json(path / _INFO)
        except InputError:
            return False
        features = info.get("features") if isinstance(info, dict) and "codebase_version" in info else None
        # names of features become folders: they must lead to no other
        return isinstance(features, dict) and all(isinstance(features[name], dict) and is_file_name(name) for name in features)


def _entries(feature: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of a feature about its video, with names shortened from video.is_depth_map to is_depth_map."""
    parts = (part for part in (feature, feature.get("video_info"), feature.get("info")) if isinstance(part, dict))
    return {str(key).rpartition(".")[2]: value for part in parts for key, value in part.items()}


def _chosen(wanted: str | None, depth: list[str], where: Path) -> str:
    """Return the name of the depth feature to read."""
    if not depth:
        remedy = "for a camera without depth give one of the videos with -c image"
        raise InputError(f"{where}: no feature is a depth map (is_depth_map): {remedy}", code="depth-missing")
    if wanted is not None and wanted not in depth:
        raise InputError(f"{where}: depth_topic={wanted}: the depth features are {', '.join(depth)}", code="topic-missing")
    return wanted or depth[0]


def _coding(feature: Mapping[str, Any], where: str) -> _Coding:
    entries = _entries(feature)
    if feature.get("dtype") != "video":
        sentence = "is stored as images, and only depth in a video is read: save depth in metres with numpy.savez"
        raise InputError(f"{where}: {sentence}('capture.npz', depth=depth, K=K)", code="encoding-unsupported")
    numbers = [entries.get("depth_min"), entries.get("depth_max"), entries.get("shift", 0.0)]
    is_log = entries.get("use_log")
    valid = all(isinstance(each, int | float) and math.isfinite(each) for each in numbers) and isinstance(is_log, bool)
    if not valid or not 0 <= numbers[0] < numbers[1] or numbers[2] < 0 or (is_log and numbers[0] + numbers[2] <= 0):
        shown = ", ".join(f"{key}={entries.get(key)!r:.40}" for key in ("depth_min", "depth_max", "shift", "use_log"))
        raise InputError(f"{where}: {shown}: expected metres, depth_min below depth_max", code="depth-scale-invalid")
    least, greatest, shift = map(float, numbers)
    return _Coding(least, greatest, shift, bool(is_log))


def _places(path: Path, feature: str) -> list[_Place]:
    """Return the place of every frame of a feature, file after file."""
    folder = path / "videos"
    places = [folder / feature, *(chunk / feature for chunk in sorted(folder.glob("chunk-*")))]  # of version 3, and of version 2
    files = [file for place in places for file in sorted(place.rglob("*.mp4"))]
    if not files:
        raise InputError(f"{folder / feature}: holds no video (.mp4) of this feature", code="file-missing")
    stamps = {file: (file.stat().st_mtime_ns, file.stat().st_size) for file in files}
    return [_Place(*each, number) for each in stamps.items() for number in range(len(_presentation_times(*each)))]


def _times(path: Path, count: int, fps: Any) -> list[float | None]:
    """Return the times of the frames in s, from the parquet files or else the frame rate; None without both."""
    rate = float(fps) if isinstance(fps, int | float) and 0 < fps < math.inf else None
    files = sorted((path / "data").rglob("*.parquet"))
    if not files:
        return [None if rate is None else i / rate for i in range(count)]
    parquet = require("pyarrow.parquet", _EXTRA)
    with guarded(path / "data"):
        opened = [parquet.ParquetFile(file) for file in files]
        rows = sum(file.metadata.num_rows for file in opened)
        if rows != count:
            sentence = f"has {rows} rows for {count} frames: is the data set complete?"
            raise InputError(f"{path / 'data'}: {sentence}", code="frame-count")
        tables = [file.read(_TIME_COLUMNS) for file in opened]
        stamps, episodes = (np.concatenate([table[name].to_numpy() for table in tables]) for name in _TIME_COLUMNS)
        begins = np.r_[True, np.diff(episodes) != 0]
        step = 1 / rate if rate else 0.0
        starts = np.cumsum([0.0, *(stamps[np.flatnonzero(begins)[1:] - 1] + step)])
        return [float(time) for time in stamps + starts[np.cumsum(begins) - 1]]


def _load(name: str, depth: _Place, color: _Place | None, coding: _Coding, pinhole: Pinhole, time: float | None) -> FrameData:
    metres = coding.metres(*_codes(_video(depth.file, depth.stamp).frame(depth.number), depth.file))
    check_unit(metres, depth.file, 1.0)
    image = None if color is None else _color(color, metres.shape)
    return FrameData(Frame(image, metres, camera_for(pinhole, metres.shape), name, time))


def _codes(decoded: Any, file: Path) -> tuple[Array, int]:
    """Return the depth codes of a decoded frame, (H, W) uint16, from its gray or luma plane, and their number of bits."""
    component, plane = decoded.format.components[0], decoded.planes[0]
    if component.bits not in _CODE_BITS or decoded.format.is_rgb or decoded.format.is_big_endian:
        sentence = f"{file}: has pixels of the format {decoded.format.name}, expected depth codes such as gray12le"
        raise InputError(sentence, code="encoding-unsupported")
    codes = np.frombuffer(plane, np.uint16).reshape(plane.height, plane.line_size // 2)
    return codes[: decoded.height, : decoded.width], component.bits


def _color(place: _Place, shape: tuple[int, ...]) -> Array:
    """Return a color image (H, W, 3) uint8 RGB, scaled to the shape of the depth image."""
    image = _video(place.file, place.stamp).frame(place.number).to_ndarray(format="rgb24")
    return scaled_to_depth(image, shape, str(place.file))


@lru_cache(maxsize=64)
def _presentation_times(file: Path, stamp: Stamp) -> tuple[int, ...]:
    """Read the presentation times of a video's frames without decoding, in the video's time unit, increasing."""
    with guarded(file), require("av", _EXTRA).open(str(file)) as container:
        stream = container.streams.video[0]
        check_pixels(stream.width, stream.height, str(file))
        times = sorted(packet.pts for packet in container.demux(stream) if packet.size and packet.pts is not None)
    if not times:
        raise InputError(f"{file}: holds no complete frame", code="video-empty")
    return tuple(times)


class _Video:
    """A video that stays open, so that the next frame is read without decoding those before it again."""

    def __init__(self, file: Path, stamp: Stamp) -> None:
        self._file, self._times, self._lock = file, _presentation_times(file, stamp), Lock()
        self._container: Any = None
        self._decoded: Iterator[Any] = iter(())
        self._next = -1

    def frame(self, number: int) -> Any:
        """Return the decoded PyAV frame with a number.

        Raises
        ------
        InputError : the frame cannot be decoded.
        """
        with self._lock, guarded(self._file):
            if self._container is None:
                self._container = require("av", _EXTRA).open(str(self._file))
            stream = self._container.streams.video[0]
            if number != self._next:
                self._container.seek(self._times[max(number - _MAX_REORDERED, 0)], stream=stream)
                self._decoded = self._container.decode(stream)
            self._next = number + 1
            for decoded in self._decoded:
                if decoded.pts == self._times[number]:
                    return decoded
            self._next = -1
        raise InputError(f"{self._file}: frame {number} cannot be decoded: is the file cut off?", code="file-damaged")


@lru_cache(maxsize=2)
def _video(file: Path, stamp: Stamp) -> _Video:
    """Return the reader that all frames of a video share, also unpickled ones; `stamp` identifies the file's version."""
    return _Video(file, stamp)
