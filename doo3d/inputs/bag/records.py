"""Scan the records of bag files for messages and their locations: common base of the bag storages.

A scan from the front needs no index, so that a recording that was cut off, or whose recorder was killed, is read by the same code
as a complete one. If the file is not compressed, the scan reads only the headers of messages.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, Generic, NamedTuple, TypeVar

from ...errors import require

R = TypeVar("R")  # what a format says of a record: its op code, or its fields

MessageLocation = tuple[int, int, int, int]
"""Location of a message: number of the file, offset of its chunk (-1 if not compressed), offset in the chunk or file, length
(bytes)."""

READ_TYPES = {
    *(f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "CameraInfo", "PointCloud2")),
    *("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "geometry_msgs/msg/Transform", "std_msgs/msg/Float32"),
}
"""Supported message types; others are skipped."""

MAX_CHUNK_BYTES = 1 << 28
"""Greatest size of a decompressed chunk in bytes; recorders start a new one at 1 to 16 MB, unless a single message is larger."""

_MAX_TOPICS = 4096  # of a file: robots have some hundreds
_MAX_FAULTS = 20  # of a file that are described
_FREE_RECORDS, _MIN_RECORD_BYTES = 10_000, 4
"""Allowed number of records in any file, and bytes of the file per further record; repeated messages compress to about 10
bytes."""

_FREE_BYTES, _MAX_RATIO = 1 << 28, 200
"""Allowed unpacked bytes of any file, and greatest compression ratio beyond them; depth images compress to a third or a tenth."""

_PIECE_BYTES = 1 << 22  # read or decompressed at once without a look at the size: both take the memory for what they may return


class DamagedRecord(Exception):
    """The error for a record of a bag file that is malformed, or longer than the rest of the file."""


class Topic(NamedTuple):
    """A topic of a bag.

    Attributes
    ----------
    name
        name of the topic, such as "/camera/depth/image_raw".
    kind
        message type in ROS 2 notation, such as "sensor_msgs/msg/Image".
    encoding
        serialization of the messages: "ros1" or "cdr" (ROS 2). Messages in any other encoding cannot be read.
    """

    name: str
    kind: str
    encoding: str


class Message(NamedTuple):
    """A message found by a scan of a bag, without its content.

    Attributes
    ----------
    topic
        the topic it was sent on.
    time
        time of recording, ns.
    location
        where the message is in the bag, to be passed to `Storage.read`: (number of the file in the bag, byte offset of the chunk,
        byte offset of the message, length in bytes). The chunk offset is -1 if the message is not in a compressed chunk. The
        message offset is within the decompressed chunk or, without one, within the file (in SQLite: the row's number).
    """

    topic: Topic
    time: int
    location: MessageLocation


class Storage:
    """Base class of the open files of a bag.

    Parameters
    ----------
    path, number
        the file, and its number in its bag, from 0.

    Attributes
    ----------
    size
        number of bytes of the file.
    topics
        all topics in the file; complete after `scan`.
    faults
        descriptions of the first damage found by `scan`, as phrases that follow the file's name, such as "ends after 3 of 7
        chunks".
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        self.path, self.number, self.size = path, number, path.stat().st_size
        self.topics: list[Topic] = []
        self.faults: list[str] = []
        self._records = 0

    def count_record(self) -> None:
        """Count a record or row in `scan`; raise DamagedRecord if there are more than the file can hold."""
        self._records += 1
        if self._records > _FREE_RECORDS + self.size // _MIN_RECORD_BYTES:
            raise DamagedRecord(f"holds more than {self._records - 1} records, too many for its size")

    def add_fault(self, fault: str) -> None:
        """Add a description of damage, unless there are many already."""
        if len(self.faults) < _MAX_FAULTS:
            self.faults.append(fault)

    def scan(self) -> Iterator[Message]:
        """Yield the messages of the types that doo3d reads, in file order, without their content; fill `topics` and `faults`.

        Damage raises no error.
        """
        raise NotImplementedError

    def read(self, location: MessageLocation, limit: int | None = None) -> bytes:
        """Return the bytes of one message, or only its first `limit` bytes; `location` is that of a Message from `scan`.

        Raises
        ------
        DamagedRecord : the file ends before the end of the message, or is damaged there.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Close the file."""


def ros2_type(kind: str) -> str:
    """Return a message type in ROS 2 notation: sensor_msgs/Image becomes sensor_msgs/msg/Image.

    A type that is in this notation already is returned unchanged.
    """
    parts = kind.split("/")
    return f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else kind


class Chunked(Storage, Generic[R]):
    """Base class of open bag files whose messages lie in chunks, blocks compressed as a whole (ROS 1 and MCAP).

    The last decompressed chunk is kept in memory. A record is a tuple: header in the form of the format, offset and length of its
    data.
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        super().__init__(path, number)
        self.file: BinaryIO = path.open("rb")
        self.channels: dict[int, Topic] = {}
        self._unpacked = 0
        self._cached_chunk: tuple[int, bytes] = (-1, b"")

    def close(self) -> None:
        """Close the file."""
        if hasattr(self, "file"):
            self.file.close()

    __del__ = close

    def records(self, file: BinaryIO, at: int, end: int) -> Iterator[tuple[R, int, int]]:
        """Yield the records of a file or a decompressed chunk from byte `at` to `end`; raise DamagedRecord at damage."""
        raise NotImplementedError

    def record(self, source: BinaryIO, chunk: int, head: R, at: int, length: int) -> Iterator[Message]:
        """Yield the message of a record if its type is supported; remember schemas and topics."""
        raise NotImplementedError

    def decompress(self, at: int) -> bytes:
        """Decompress the chunk whose record's data starts at byte `at` of the file; raise DamagedRecord if it is damaged."""
        raise NotImplementedError

    def add_topic(self, number: int, topic: Topic) -> None:
        """Remember the topic of a channel, unless it has one; raise DamagedRecord if there are too many."""
        if len(self.channels) >= _MAX_TOPICS and number not in self.channels:
            raise DamagedRecord(f"declares more than {_MAX_TOPICS} topics")
        if self.channels.setdefault(number, topic) is topic and topic not in self.topics:
            self.topics.append(topic)

    def scan_chunk(self, at: int, length: int, first: Callable[[], int | None]) -> Iterator[Message]:
        """Yield the messages of the chunk whose record has `length` bytes of data at byte `at` of the file.

        `first` returns the offset of the chunk's first record in the file, or None if the chunk is compressed.
        """
        try:
            begin = first()
            content = self._chunk_content(at) if begin is None else None
            self._unpacked += len(content or b"")
            if self._unpacked > _FREE_BYTES + _MAX_RATIO * self.size:
                raise DamagedRecord(f"the file unpacks to more than {_FREE_BYTES + _MAX_RATIO * self.size} bytes")
            source, end = (self.file, min(at + length, self.size)) if content is None else (BytesIO(content), len(content))
            for head, start, size in self.records(source, begin or 0, end):
                self.count_record()
                if start + size <= end:
                    yield from self.record(source, at if begin is None else -1, head, start, size)
        except DamagedRecord as error:
            if at + length <= self.size:  # else the file ends here, reported once by `scan`
                self.add_fault(f"has a damaged chunk at byte {at} ({error}), its messages are lost")

    def _chunk_content(self, at: int) -> bytes:
        """Return the decompressed content of a chunk, kept in memory until another chunk is requested."""
        if self._cached_chunk[0] != at:
            self._cached_chunk = (at, self.decompress(at))
        return self._cached_chunk[1]

    def read(self, location: MessageLocation, limit: int | None = None) -> bytes:
        """Return the bytes of one message; see Storage."""
        _, chunk, at, length = location
        count = length if limit is None else min(limit, length)
        return self._chunk_content(chunk)[at : at + count] if chunk >= 0 else read_exactly(self.file, at, count)


def decompress(data: bytes, decompressor: Any) -> bytes:
    """Decompress data with a decompressor of bz2, lz4 or zstd, to at most `MAX_CHUNK_BYTES`.

    Raises
    ------
    DamagedRecord : the data decompress to more, are cut off or damaged.
    """
    try:
        content = bytearray(decompressor.decompress(data, _PIECE_BYTES))
        while not decompressor.eof:
            piece = b"" if decompressor.needs_input else decompressor.decompress(b"", _PIECE_BYTES)
            if not piece:
                raise DamagedRecord("cannot be decompressed: it ends too early")
            content += piece
            check_chunk(len(content))
    except DamagedRecord:
        raise
    except Exception as error:  # each library has its own
        raise DamagedRecord(f"cannot be decompressed: {error}") from None
    return bytes(content)


def unzstd(data: bytes) -> bytes:
    """Decompress Zstandard data.

    Raises DamagedRecord if it is damaged, MissingDependency without the package backports.zstd (Python < 3.14).
    """
    zstd = require("compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd", "bags")
    return decompress(data, zstd.ZstdDecompressor())


def unlz4(data: bytes) -> bytes:
    """Decompress LZ4 data; the errors are those of `unzstd`."""
    return decompress(data, require("lz4.frame", "bags").LZ4FrameDecompressor())


def check_chunk(size: int) -> None:
    """Raise DamagedRecord if the decompressed size of a chunk (bytes) exceeds `MAX_CHUNK_BYTES`."""
    if size > MAX_CHUNK_BYTES:
        raise DamagedRecord(f"decompresses to more than {MAX_CHUNK_BYTES} bytes")


def read_exactly(file: BinaryIO, at: int, count: int) -> bytes:
    """Return `count` bytes of a binary file, starting at byte offset `at`.

    Raises
    ------
    DamagedRecord : the file has fewer bytes.
    """
    # a read takes the memory for as many bytes as it may return
    data = b""
    if count <= _PIECE_BYTES or at + count <= file.seek(0, os.SEEK_END):
        file.seek(at)
        data = file.read(count)
    if len(data) != count:
        raise DamagedRecord(f"ends in the middle of the record at byte {at}")
    return data
