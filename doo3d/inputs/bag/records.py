"""Common parts of the bag storages: messages with their locations in a file, found by a scan over the file's records.

A scan from the front needs no index, so a recording that was cut off, or whose recorder was killed, is read by the same code
as a complete one. If the file is not compressed, the scan reads only the headers of messages.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple, Protocol

MessageLocation = tuple[int, int, int, int]
"""Number of the file, offset of its chunk (-1: not compressed), offset in the chunk or in the file, length; bytes."""

READ_TYPES = {
    *(f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "CameraInfo", "PointCloud2")),
    *("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "geometry_msgs/msg/Transform", "std_msgs/msg/Float32"),
}
"""Message types that are read; others are skipped."""


class DamagedRecord(Exception):
    """A record that is malformed, or longer than the rest of the file."""


class Topic(NamedTuple):
    """A topic. kind : message type in ROS 2 notation. encoding : of its messages, "ros1" or "cdr"; others cannot be read."""

    name: str
    kind: str
    encoding: str


class Message(NamedTuple):
    """A message of a topic. time : of recording, ns. location : in the bag."""

    topic: Topic
    time: int
    location: MessageLocation


class Storage(Protocol):
    """A file of a bag. topics : known after `scan`. faults : damage found by `scan`, a sentence without subject each."""

    path: Path
    topics: list[Topic]
    faults: list[str]

    def scan(self) -> Iterator[Message]: ...

    def read(self, location: MessageLocation, limit: int | None = None) -> bytes: ...

    def close(self) -> None: ...


def ros2_type(kind: str) -> str:
    """Return a message type in ROS 2 notation, such as sensor_msgs/msg/Image."""
    parts = kind.split("/")
    return f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else kind


class Chunked:
    """A file with messages in chunks; the chunk decompressed last is cached.

    number : of the file in its bag.
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        self.path, self.number = path, number
        self.topics: list[Topic] = []
        self.faults: list[str] = []
        self.size = path.stat().st_size
        self.file: BinaryIO = path.open("rb")
        self._cached_chunk: tuple[int, bytes] = (-1, b"")

    def close(self) -> None:
        """Close the file."""
        if hasattr(self, "file"):
            self.file.close()

    __del__ = close

    def decompress(self, at: int) -> bytes:
        """Return the content of the compressed chunk at byte `at`; raises DamagedRecord."""
        raise NotImplementedError

    def chunk_content(self, at: int) -> bytes:
        """Return the content of the compressed chunk at byte `at`, from the cache if it was the last one."""
        if self._cached_chunk[0] != at:
            self._cached_chunk = (at, self.decompress(at))
        return self._cached_chunk[1]

    def read(self, location: MessageLocation, limit: int | None = None) -> bytes:
        """Return the bytes of a message, or the first `limit`; raises DamagedRecord if there are fewer."""
        _, chunk, at, length = location
        count = length if limit is None else min(limit, length)
        if chunk >= 0:
            return self.chunk_content(chunk)[at : at + count]
        return read_exactly(self.file, at, count)

    def source(self, chunk: int) -> BinaryIO:
        """Return the file object from which to read the records of a chunk: the file, or its decompressed content."""
        return self.file if chunk < 0 else BytesIO(self.chunk_content(chunk))


def read_exactly(file: BinaryIO, at: int, count: int) -> bytes:
    """Return `count` bytes from byte `at`; raises DamagedRecord if the file ends before."""
    file.seek(at)
    data = file.read(count)
    if len(data) != count:
        raise DamagedRecord(f"ends in the middle of the record at byte {at}")
    return data
