"""Common parts of the bag storages: messages with their locations in a file, found by a scan over the file's records.

A scan from the front needs no index, so a recording that was cut off, or whose recorder was killed, is read by the same code
as a complete one. If the file is not compressed, the scan reads only the headers of messages.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, Protocol

MessageLocation = tuple[int, int, int, int]
"""Number of the file, offset of its chunk (-1: not compressed), offset in the chunk or in the file, length; bytes."""

READ_TYPES = {
    *(f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "CameraInfo", "PointCloud2")),
    *("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "geometry_msgs/msg/Transform", "std_msgs/msg/Float32"),
}
"""Message types that are read; others are skipped."""

MAX_CHUNK_BYTES = 1 << 28
"""Bytes of a decompressed chunk: recorders begin a new one at 1 to 16 MB, unless a single message is larger."""

_PIECE_BYTES = 1 << 22  # read or decompressed at once without a look at the size: both take the memory for what they may return


class DamagedRecord(Exception):
    """Raised for a record of a bag file that is malformed, or longer than the rest of the file."""


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


class Storage(Protocol):
    """The interface of one open file of a bag.

    Attributes
    ----------
    path
        the file.
    topics
        all topics in the file; complete after `scan`.
    faults
        damage found by `scan`: phrases to be put after the file's name, such as "ends after 3 of 7 chunks".
    """

    path: Path
    topics: list[Topic]
    faults: list[str]

    def scan(self) -> Iterator[Message]:
        """Yield the messages of the types that doo3d reads, in file order, without their content; fill `topics` and `faults`."""

    def read(self, location: MessageLocation, limit: int | None = None) -> bytes:
        """Return the bytes of one message, or only its first `limit` bytes; `location` is that of a Message from `scan`."""

    def close(self) -> None:
        """Close the file."""


def ros2_type(kind: str) -> str:
    """Return a message type in ROS 2 notation: sensor_msgs/Image becomes sensor_msgs/msg/Image.

    A type that is in this notation already is returned unchanged.
    """
    parts = kind.split("/")
    return f"{parts[0]}/msg/{parts[-1]}" if len(parts) == 2 else kind


class Chunked:
    """Base class of open bag files whose messages lie in chunks, blocks compressed as a whole (ROS 1 and MCAP).

    The chunk decompressed last is kept in memory.

    Attributes
    ----------
    path, file, size
        path of the bag file, the open binary file, and its size in bytes.
    number
        number of this file in its bag, from 0.
    topics, faults
        filled by `scan`: all topics, and the damage found.
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
        """Return the decompressed content of a chunk; each subclass defines this for its format.

        `at` is the byte offset in the file of the chunk record's data.

        Raises
        ------
        DamagedRecord : the chunk is damaged, or its compression is unknown.
        """
        raise NotImplementedError

    def chunk_content(self, at: int) -> bytes:
        """Return the decompressed content of a chunk, kept in memory until another chunk is requested.

        `at` is the byte offset in the file of the chunk record's data.

        Raises
        ------
        DamagedRecord : the chunk cannot be decompressed.
        """
        if self._cached_chunk[0] != at:
            self._cached_chunk = (at, self.decompress(at))
        return self._cached_chunk[1]

    def read(self, location: MessageLocation, limit: int | None = None) -> bytes:
        """Return the bytes of one message, or only its first `limit` bytes; `location` is that of a Message from `scan`.

        Raises
        ------
        DamagedRecord : the file ends before the end of the message, or its chunk cannot be decompressed.
        """
        _, chunk, at, length = location
        count = length if limit is None else min(limit, length)
        if chunk >= 0:
            return self.chunk_content(chunk)[at : at + count]
        return read_exactly(self.file, at, count)

    def source(self, chunk: int) -> BinaryIO:
        """Return a binary file from which to read records: a chunk's decompressed content, or the bag file itself.

        `chunk` is the byte offset in the bag file of the chunk record's data; -1 returns the bag file, for records that are not
        compressed.

        Raises
        ------
        DamagedRecord : the chunk cannot be decompressed.
        """
        return self.file if chunk < 0 else BytesIO(self.chunk_content(chunk))


def complete(decompressor: Any, data: bytes) -> bytes:
    """Return what data decompress to, by a decompressor of bz2, lz4 or zstd; at most `MAX_CHUNK_BYTES`.

    Raises
    ------
    DamagedRecord : they decompress to more. EOFError : they are cut off.
    """
    content = bytearray(decompressor.decompress(data, _PIECE_BYTES))
    while not decompressor.eof:
        piece = b"" if decompressor.needs_input else decompressor.decompress(b"", _PIECE_BYTES)
        if not piece:
            raise EOFError("it ends too early")
        content += piece
        check_chunk(len(content))
    return bytes(content)


def check_chunk(size: int) -> None:
    """Raise DamagedRecord if a chunk decompresses to more bytes than recorders write into one."""
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
