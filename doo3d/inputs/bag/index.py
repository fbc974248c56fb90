"""Open a bag, index its messages and decode them, without ROS."""

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

from ...errors import InputError, require
from ...guard.guarding import check_not_pointer, check_regular, guarded, read_head
from ...guard.parsing import read_yaml
from ...types import Array
from . import foxglove
from . import mcap_storage as _mcap
from . import rosbag1_storage as _rosbag1
from . import sqlite_storage as _db3
from .records import DamagedRecord, Message, MessageLocation, Storage, Topic, unzstd

METADATA = "metadata.yaml"
STORAGES: dict[bytes, Any] = {_rosbag1.MAGIC: _rosbag1.Rosbag1, _mcap.MAGIC: _mcap.Mcap, _db3.MAGIC: _db3.Db3}
SUFFIXES = (".bag", ".mcap", ".db3")
ENCODINGS = ("ros1", "cdr")  # of messages that can be read; MCAP may hold others
_HEADER_BYTES = 4096  # of a message; enough for its header with the frame's name
Stamp = tuple[tuple[str, int, int], ...]
"""Files with modification time (ns) and size (bytes); an open bag is reused as long as they stay the same."""


@dataclass
class TopicIndex:
    """The messages of one topic of a bag, in the order of the file.

    Attributes
    ----------
    topic
        name, message type and encoding.
    frame
        frame_id (name of the coordinate frame) in the header of the first message; empty without header.
    times
        time of recording of each message, ns.
    stamps
        time in the header of each message, ns; 0 without header.
    locations
        where each message is in the bag, four numbers per message in one flat array; read with `location`.
    """

    topic: Topic
    frame: str = ""
    times: array[int] = field(default_factory=lambda: array("q"))
    stamps: array[int] = field(default_factory=lambda: array("q"))
    locations: array[int] = field(default_factory=lambda: array("q"))

    def __len__(self) -> int:
        return len(self.times)

    def location(self, index: int) -> MessageLocation:
        """Return the location in the bag of message number `index` (from 0) of the topic, for `Bag.message`.

        The result is (number of the file in the bag, byte offset of the chunk, byte offset of the message, length in bytes). The
        chunk offset is -1 if the message is not in a compressed chunk. The message offset is within the decompressed chunk or,
        without one, within the file (in SQLite: the row's number).
        """
        a, b, c, d = self.locations[4 * index : 4 * index + 4]
        return a, b, c, d

    @property
    def stamped(self) -> bool:
        """Whether every message has a time above zero in its header; false without messages."""
        return min(self.stamps, default=0) > 0

    def clock(self, stamped: bool = True) -> Array:
        """Return the time of each of the M messages, (M,) int64 ns.

        The times are those in the message headers if `stamped` is true and every message has one above zero; otherwise they are
        the times of recording.
        """
        return np.array(self.stamps if stamped and self.stamped else self.times, dtype=np.int64)


class Bag:
    """An open bag: a bag of ROS 1, ROS 2 or RealSense's SDK, in one or several files.

    Attributes
    ----------
    path
        the file or folder.
    storages
        readers of the bag's files, in order.
    compressed
        whether each message is compressed on its own (compression_mode "message" of ROS 2).

    Raises
    ------
    InputError : a file of the bag is missing, empty or of an unknown format, or the metadata is invalid.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._lock = path, Lock()
        files, self.compressed = files_of(path)
        self.storages: list[Storage] = [_open_storage(file, number) for number, file in enumerate(files)]

    def index(self) -> dict[str, TopicIndex]:
        """Scan the bag and return a dict topic name -> TopicIndex with the messages of each topic.

        A topic is listed only if its messages can be decoded and are of a type that doo3d reads: images, CameraInfo, clouds,
        transforms, RealSense's options. If the bag is not compressed, only the headers of messages are read. Damage raises no
        error; `faults` returns it.
        """
        indices: dict[str, TopicIndex] = {}
        for storage in self.storages:
            for message in storage.scan():
                if not is_readable(message.topic):
                    continue
                topic_index = indices.setdefault(message.topic.name, TopicIndex(message.topic))
                try:
                    stamp, frame = self._header(storage, message)
                except (DamagedRecord, ValueError, IndexError, struct.error) as error:
                    storage.add_fault(f"has a damaged message on {message.topic.name} ({error})")
                    continue
                if not len(topic_index):
                    topic_index.frame = frame
                topic_index.times.append(message.time)
                topic_index.stamps.append(stamp)
                topic_index.locations.extend(message.location)
        return indices

    def _header(self, storage: Storage, message: Message) -> tuple[int, str]:
        """Return the stamp (ns) and the frame_id of a message; (0, "") for types without header."""
        topic = message.topic
        if foxglove.is_foxglove(topic.encoding):
            return foxglove.header(storage.read(message.location), topic.encoding)
        if not topic.kind.startswith("sensor_msgs/"):
            return 0, ""
        data = unzstd(storage.read(message.location)) if self.compressed else storage.read(message.location, _HEADER_BYTES)
        order = ">" if topic.encoding == "cdr" and not data[1] & 1 else "<"
        # after a sequence number (ROS 1) or the CDR header (ROS 2)
        seconds, rest, letters = struct.unpack_from(f"{order}III", data, 4)
        if 16 + letters > len(data):
            raise ValueError("its header is invalid")
        return seconds * 10**9 + rest, data[16 : 16 + letters].rstrip(b"\0").decode("utf-8", "replace").lstrip("/")

    @property
    def topics(self) -> dict[str, Topic]:
        """All topics of the bag by name, also those that doo3d does not read; empty until `index` has been called."""
        return {topic.name: topic for storage in self.storages for topic in storage.topics}

    def faults(self) -> list[str]:
        """Return the damage found by `index`, one sentence with the file's path each; empty if there is none."""
        return [f"{storage.path}: {fault}" for storage in self.storages for fault in storage.faults]

    def message(self, topic: Topic, location: MessageLocation) -> Any:
        """Read and decode a message; return an object with the ROS message's fields as attributes.

        `topic` gives the message type and encoding; `location` is where the message is, from `TopicIndex.location`. Several
        threads may call this at once.

        Raises
        ------
        InputError : the message cannot be read or decoded.
        """
        storage = self.storages[location[0]]
        with guarded(storage.path):
            try:
                with self._lock:
                    data = storage.read(location)
                data = unzstd(data) if self.compressed else data
            except DamagedRecord as error:
                raise InputError(f"{storage.path}: {error}", code="bag-damaged") from None
        with guarded(f"{storage.path}: a message on {topic.name}", code="message-damaged"):
            return decode_message(data, topic)

    def close(self) -> None:
        """Close the files of the bag."""
        for storage in self.storages:
            storage.close()


def decode_message(data: bytes, topic: Topic) -> Any:
    """Decode the bytes of a message into an object with the ROS message's fields as attributes.

    `topic` gives the message type and the encoding. Bytes after the end of the message are ignored, since RealSense's SDK appends
    some. Damaged bytes may raise any exception, because the decoders are generated code.
    """
    if foxglove.is_foxglove(topic.encoding):
        return foxglove.decode(data, topic.encoding)
    store = _types(topic.encoding)
    definition = store.get_msgdef("tf2_msgs/msg/TFMessage" if topic.kind == "tf/msg/tfMessage" else topic.kind)
    if topic.encoding == "ros1":
        return definition.deserialize_ros1(data, 0, definition.cls, store)[0]
    decode = definition.deserialize_cdr_le if data[1] & 1 else definition.deserialize_cdr_be
    return decode(data[4:], 0, definition.cls, store)[0]


def is_readable(topic: Topic) -> bool:
    """Return whether the messages of a topic can be decoded."""
    return topic.encoding in ENCODINGS or foxglove.is_foxglove(topic.encoding)


@lru_cache(maxsize=2)
def _types(encoding: str) -> Any:
    """Return the standard message types of ROS 1 or ROS 2, which are the same in all releases."""
    types = require("rosbags.typesys", "bags")
    if encoding == "cdr":
        return types.get_typestore(types.Stores.ROS2_HUMBLE)
    store = types.get_typestore(types.Stores.ROS1_NOETIC)
    store.register(types.get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    return store


def storage_class(path: Path) -> Any:
    """Return the class that reads a bag file (Rosbag1, Mcap or Db3), chosen by the file's first bytes.

    None if the file is none of these.
    """
    check_regular(path)
    head = read_head(path, 16)
    return next((storage for magic, storage in STORAGES.items() if head.startswith(magic)), None)


def _open_storage(path: Path, number: int) -> Storage:
    if not path.exists():
        raise InputError(f"{path}: is missing, but listed in {METADATA}: copy the whole bag", code="file-missing")
    storage: type[Storage] | None = storage_class(path)
    if storage is not None:
        return storage(path, number)
    if not path.stat().st_size:
        raise InputError(f"{path}: is empty", code="file-empty")
    check_not_pointer(path, read_head(path, _HEADER_BYTES))
    raise InputError(f"{path}: is no ROS 1 bag (2.0), MCAP or SQLite file: is it cut off?", code="file-damaged")


def files_of(path: Path) -> tuple[list[Path], bool]:
    """Return the files of a bag in order, and whether its messages are compressed one by one.

    `path` is a bag file or the folder of a ROS 2 bag. The files of a folder are those listed in its metadata.yaml; if that is
    missing because the recorder was killed, they are all .bag, .mcap and .db3 files in the folder, sorted by name.

    Returns
    -------
    (files, compressed): the list of paths, and true if each message is compressed on its own (ROS 2 compression_mode "message").

    Raises
    ------
    InputError : the metadata is invalid or lists no files, or the files are compressed as a whole.
    """
    if path.is_file():
        return [path], False
    metadata = path / METADATA
    if not metadata.exists():  # a killed recorder has not written it
        return sorted(file for file in path.iterdir() if file.suffix in SUFFIXES), False
    try:
        values = read_yaml(metadata)["rosbag2_bagfile_information"]
        names = [Path(str(name)).name for name in values["relative_file_paths"]]
        mode = str(values.get("compression_mode") or "").lower()
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        sentence = f"{metadata}: cannot be read as the description of a ROS 2 bag ({error!r})"
        raise InputError(sentence, code="yaml-invalid") from None
    if mode == "file":
        sentence = f"{path}: its files are compressed as a whole: decompress them first, with zstd -d or ros2 bag convert"
        raise InputError(sentence, code="bag-compressed")
    if not names:
        raise InputError(f"{metadata}: lists no files", code="bag-empty")
    return [path / name for name in names], mode == "message"


def stamp_of(path: Path) -> Stamp:
    """Return (path, modification time in ns, size in bytes) of each file of a bag, to detect a changed bag."""
    return tuple((os.fspath(file), file.stat().st_mtime_ns, file.stat().st_size) for file in files_of(path)[0])


@lru_cache(maxsize=1)
def open_bag(path: Path, stamp: Stamp) -> Bag:
    """Return the open bag at `path`; repeated calls with the same arguments return the same Bag.

    `stamp` is the result of `stamp_of(path)`: once a file of the bag has changed, the bag is opened again. Only the bag opened
    last is kept, so that all frames of a bag share one open bag in each process.
    """
    return Bag(path)
