"""Bags as a whole: which files they have, what their messages say, and where each of them is. No ROS is needed."""

from __future__ import annotations

import os
import struct
from array import array
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import yaml

from ...errors import DooError, InputError, require
from ...types import Array
from . import mcap_storage as _mcap
from . import rosbag1_storage as _rosbag1
from . import sqlite_storage as _db3
from .mcap_storage import unzstd
from .records import Broken, Message, Place, Storage, Topic

METADATA = "metadata.yaml"
STORAGES: dict[bytes, Any] = {_rosbag1.MAGIC: _rosbag1.Rosbag1, _mcap.MAGIC: _mcap.Mcap, _db3.MAGIC: _db3.Db3}
SUFFIXES = (".bag", ".mcap", ".db3")
ENCODINGS = ("ros1", "cdr")  # of messages; MCAP may hold others
_HEAD = 4096  # bytes of a message in which its header is; a frame's name is not longer
Stamp = tuple[tuple[str, int, int], ...]
"""Files with the time they were changed and their size: an open bag is kept as long as this is the same."""


@dataclass
class Found:
    """The messages of one topic.

    times, stamps : ns, when recorded and what the header says (0 where there is none). places : four numbers per message.
    frame : that the header of the first message names.
    """

    topic: Topic
    frame: str = ""
    times: array[int] = field(default_factory=lambda: array("q"))
    stamps: array[int] = field(default_factory=lambda: array("q"))
    places: array[int] = field(default_factory=lambda: array("q"))

    def __len__(self) -> int:
        return len(self.times)

    def place(self, index: int) -> Place:
        """Where a message is."""
        a, b, c, d = self.places[4 * index : 4 * index + 4]
        return a, b, c, d

    @property
    def stamped(self) -> bool:
        """Whether all headers have a stamp."""
        return min(self.stamps, default=0) > 0

    def clock(self, stamped: bool = True) -> Array:
        """(messages,) int64 ns: the headers' stamps; when recorded, where headers have none or `stamped` is false."""
        return np.array(self.stamps if stamped and self.stamped else self.times, dtype=np.int64)


class Bag:
    """A bag that stays open. packed : its messages are compressed one by one."""

    def __init__(self, path: Path) -> None:
        self.path, self._lock = path, Lock()
        files, self.packed = files_of(path)
        self.storages: list[Storage] = [_storage(file, number) for number, file in enumerate(files)]

    def index(self) -> dict[str, Found]:
        """What there is of each topic that matters; reads the heads of messages alone, where the bag is not compressed."""
        found: dict[str, Found] = {}
        for storage in self.storages:
            for message in storage.scan():
                if message.topic.encoding not in ENCODINGS:
                    continue
                entry = found.setdefault(message.topic.name, Found(message.topic))
                try:
                    stamp, frame = self._head(storage, message)
                except (Broken, ValueError, IndexError, struct.error) as error:
                    storage.faults.append(f"has a damaged message on {message.topic.name} ({error})")
                    continue
                if not len(entry):
                    entry.frame = frame
                entry.times.append(message.time)
                entry.stamps.append(stamp)
                entry.places.extend(message.place)
        return found

    def _head(self, storage: Storage, message: Message) -> tuple[int, str]:
        """The stamp (ns) and the frame of a message; (0, "") for kinds without header."""
        topic = message.topic
        if not topic.kind.startswith("sensor_msgs/"):
            return 0, ""
        data = unzstd(storage.read(message.place)) if self.packed else storage.read(message.place, _HEAD)
        order = ">" if topic.encoding == "cdr" and not data[1] & 1 else "<"
        seconds, rest, letters = struct.unpack_from(f"{order}III", data, 4)  # behind a number (ROS 1), or a mark (ROS 2)
        if 16 + letters > len(data):
            raise ValueError("its header makes no sense")
        return seconds * 10**9 + rest, data[16 : 16 + letters].rstrip(b"\0").decode("utf-8", "replace").lstrip("/")

    @property
    def topics(self) -> dict[str, Topic]:
        """All topics, known after `index`."""
        return {topic.name: topic for storage in self.storages for topic in storage.topics}

    def faults(self) -> list[str]:
        """What is broken, a sentence each."""
        return [f"{storage.path}: {fault}" for storage in self.storages for fault in storage.faults]

    def message(self, topic: Topic, place: Place) -> Any:
        """A message with the fields that ROS gives it.

        Raises
        ------
        InputError : it cannot be read.
        """
        file = self.storages[place[0]].path
        try:
            with self._lock:
                data = self.storages[place[0]].read(place)
            return decoded(unzstd(data) if self.packed else data, topic)
        except Broken as error:
            raise InputError(f"{file}: {error}", code="bag-damaged") from None
        except OSError as error:
            raise InputError(f"{file}: cannot be read ({error.strerror or error})", code="file-unreadable") from None
        except DooError:
            raise
        except Exception as error:  # generated code meets arbitrary bytes here
            raise InputError(f"{file}: a message on {topic.name} is damaged ({error})", code="message-damaged") from None

    def close(self) -> None:
        """Let go of the files."""
        for storage in self.storages:
            storage.close()


def decoded(data: bytes, topic: Topic) -> Any:
    """The message in `data`. Bytes behind its end do not matter: RealSense's SDK writes some that ROS does not know."""
    store = _types(topic.encoding)
    definition = store.get_msgdef("tf2_msgs/msg/TFMessage" if topic.kind == "tf/msg/tfMessage" else topic.kind)
    if topic.encoding == "ros1":
        return definition.deserialize_ros1(data, 0, definition.cls, store)[0]
    decode = definition.deserialize_cdr_le if data[1] & 1 else definition.deserialize_cdr_be
    return decode(data[4:], 0, definition.cls, store)[0]


@lru_cache(maxsize=2)
def _types(encoding: str) -> Any:
    """The standard messages of ROS 1 or ROS 2; they have been the same in all its releases."""
    types = require("rosbags.typesys", "bags")
    if encoding == "cdr":
        return types.get_typestore(types.Stores.ROS2_HUMBLE)
    store = types.get_typestore(types.Stores.ROS1_NOETIC)
    store.register(types.get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    return store


def kind_of(path: Path) -> Any:
    """The class that reads a file, by its first bytes; None where it is no file of a bag."""
    with path.open("rb") as file:
        head = file.read(16)
    return next((storage for magic, storage in STORAGES.items() if head.startswith(magic)), None)


def _storage(path: Path, number: int) -> Storage:
    if not path.exists():
        raise InputError(f"{path}: is missing, though the {METADATA} beside it names it", code="file-missing")
    storage = kind_of(path)
    if storage is None:
        empty = not path.stat().st_size
        raise InputError(
            f"{path}: {'is empty' if empty else 'is no ROS 1 bag (2.0), MCAP or SQLite file: is it cut off?'}",
            code="file-empty" if empty else "file-damaged",
        )
    found: Storage = storage(path, number)
    return found


def files_of(path: Path) -> tuple[list[Path], bool]:
    """The files of a bag in their order, and whether their messages are compressed one by one.

    Raises
    ------
    InputError : the metadata makes no sense, or the bag is compressed as whole files.
    """
    if path.is_file():
        return [path], False
    metadata = path / METADATA
    if not metadata.exists():  # a recorder that was killed has not written it
        return sorted(file for file in path.iterdir() if file.suffix in SUFFIXES), False
    try:
        said = yaml.safe_load(metadata.read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
        names = [Path(str(name)).name for name in said["relative_file_paths"]]
    except (yaml.YAMLError, UnicodeDecodeError, KeyError, TypeError) as error:
        raise InputError(
            f"{metadata}: cannot be read as the description of a ROS 2 bag ({error!r})", code="yaml-invalid"
        ) from None
    mode = str(said.get("compression_mode") or "").lower()
    if mode == "file":
        raise InputError(
            f"{path}: its files are compressed as a whole: unpack them first, with zstd -d or ros2 bag convert",
            code="bag-compressed",
        )
    if not names:
        raise InputError(f"{metadata}: names no files", code="bag-empty")
    return [path / name for name in names], mode == "message"


def stamp_of(path: Path) -> Stamp:
    """What tells a bag from what it was before."""
    stats = [(file, file.stat()) for file in files_of(path)[0]]
    return tuple((os.fspath(file), stat.st_mtime_ns, stat.st_size) for file, stat in stats)


@lru_cache(maxsize=1)
def opened(path: Path, stamp: Stamp) -> Bag:
    """One bag for all its entries, also where they come from another process; `stamp` tells a changed one."""
    return Bag(path)
