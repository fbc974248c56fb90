"""What the storages of bags share: messages with their places in a file, found by walking over the file's records.

A walk from the front needs no index, so a recording that was cut off, or whose recorder was killed, is read by the same code
as a whole one. Only the heads of messages are read meanwhile, where the file is not compressed.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple, Protocol

Place = tuple[int, int, int, int]
"""File of the bag, byte of its chunk (-1: the chunk is not compressed), byte in the chunk or in the file, bytes."""

WANTED = {
    *(f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "CameraInfo", "PointCloud2")),
    *("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "geometry_msgs/msg/Transform", "std_msgs/msg/Float32"),
}
"""The types of message that are looked at."""


class Broken(Exception):
    """A record that cannot be one, or that goes on beyond the end of the file."""


class Topic(NamedTuple):
    """kind : the type as ROS 2 writes it. encoding : of its messages, "ros1" or "cdr"; another cannot be read."""

    name: str
    kind: str
    encoding: str


class Message(NamedTuple):
    """time : ns, when it was recorded."""

    topic: Topic
    time: int
    place: Place


class Storage(Protocol):
    """A file of a bag. topics : known after `scan`. faults : what `scan` found broken, a sentence without subject each."""

    path: Path
    topics: list[Topic]
    faults: list[str]

    def scan(self) -> Iterator[Message]: ...

    def read(self, place: Place, limit: int | None = None) -> bytes: ...

    def close(self) -> None: ...


def normal(kind: str) -> str:
    """The type of a message as ROS 2 writes it: sensor_msgs/msg/Image."""
    parts = kind.split("/")
    return f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else kind


class Chunked:
    """A file whose messages lie in chunks. The chunk that was last unpacked is kept, no other.

    number : of the file in its bag.
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        self.path, self.number = path, number
        self.topics: list[Topic] = []
        self.faults: list[str] = []
        self.size = path.stat().st_size
        self.file: BinaryIO = path.open("rb")
        self._unpacked: tuple[int, bytes] = (-1, b"")

    def close(self) -> None:
        """Let go of the file."""
        if hasattr(self, "file"):
            self.file.close()

    __del__ = close

    def unpack(self, at: int) -> bytes:
        """The content of the compressed chunk whose record begins at byte `at`; raises Broken."""
        raise NotImplementedError

    def inside(self, at: int) -> bytes:
        """The same, kept from the last call."""
        if self._unpacked[0] != at:
            self._unpacked = (at, self.unpack(at))
        return self._unpacked[1]

    def read(self, place: Place, limit: int | None = None) -> bytes:
        """The bytes of a message, or the first `limit`; raises Broken where there are fewer."""
        _, chunk, at, length = place
        wanted = length if limit is None else min(limit, length)
        if chunk >= 0:
            return self.inside(chunk)[at : at + wanted]
        return exactly(self.file, at, wanted)

    def source(self, chunk: int) -> BinaryIO:
        """What the records of a chunk are read from."""
        return self.file if chunk < 0 else BytesIO(self.inside(chunk))


def exactly(file: BinaryIO, at: int, count: int) -> bytes:
    """`count` bytes from byte `at`; raises Broken where the file ends before."""
    file.seek(at)
    data = file.read(count)
    if len(data) != count:
        raise Broken(f"ends in the middle of what begins at byte {at}")
    return data
