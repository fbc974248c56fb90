"""ROS 1 bag files, format 2.0 (wiki.ros.org/Bags/Format/2.0): records of header fields and data; messages are in chunks."""

from __future__ import annotations

import bz2
from collections.abc import Iterator
from typing import BinaryIO

from .mcap_storage import unlz4
from .records import READ_TYPES, Chunked, DamagedRecord, Message, Topic, complete, read_exactly, ros2_type

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG, _CHUNK, _CONNECTION = 2, 3, 5, 7  # op codes
_MAX_HEADER_BYTES = 1 << 20  # a header has a few fields


class Rosbag1(Chunked):
    """An open ROS 1 bag file (`.bag`): `scan` lists its messages, `read` returns the bytes of one."""

    def scan(self) -> Iterator[Message]:
        """Yield a Message (topic, time, location; not the content) for each message of a type that doo3d reads, in file order.

        The scan fills `topics` with all topics of the file, and `faults` with the damage found; damage raises no error.
        """
        connections: dict[int, Topic] = {}
        chunks, declared = 0, None
        try:
            for fields, at, length in _records(self.file, len(MAGIC), self.size):
                op = _number(fields, b"op")
                if op == _BAG and _number(fields, b"index_pos"):
                    declared = _number(fields, b"chunk_count")
                if op == _CHUNK:
                    chunks += 1
                    yield from self._chunk(fields, at, length, connections)
        except DamagedRecord as error:
            if declared is None or chunks < declared or at + length > self.size:
                self.faults.append(str(error))
        else:
            if declared is not None and chunks < declared:
                self.faults.append(f"ends after {chunks} of {declared} chunks")

    def _chunk(self, fields: dict[bytes, bytes], at: int, length: int, connections: dict[int, Topic]) -> Iterator[Message]:
        chunk = at if fields.get(b"compression") != b"none" else -1
        try:
            source = self.source(chunk)
            begin, end = (0, len(self.chunk_content(chunk))) if chunk >= 0 else (at, min(at + length, self.size))
            for inner, start, size in _records(source, begin, end):
                op = _number(inner, b"op")
                if op == _CONNECTION:
                    self._add_connection(inner, read_exactly(source, start, size), connections)
                elif op == _MESSAGE and start + size <= end:
                    topic = connections.get(_number(inner, b"conn"))
                    if topic and topic.kind in READ_TYPES:
                        time = inner.get(b"time", bytes(8))
                        stamp = int.from_bytes(time[:4], "little") * 10**9 + int.from_bytes(time[4:], "little")
                        yield Message(topic, stamp, (self.number, chunk, start, size))
        except DamagedRecord as error:
            if at + length <= self.size:  # else the file ends here, reported once by `scan`
                self.faults.append(f"has a damaged chunk at byte {at} ({error}), its messages are lost")

    def _add_connection(self, fields: dict[bytes, bytes], data: bytes, connections: dict[int, Topic]) -> None:
        number = _number(fields, b"conn")
        if number not in connections:
            kind = ros2_type(_fields(data).get(b"type", b"").decode("utf-8", "replace"))
            connections[number] = Topic(fields.get(b"topic", b"").decode("utf-8", "replace"), kind, "ros1")
            if connections[number] not in self.topics:
                self.topics.append(connections[number])

    def decompress(self, at: int) -> bytes:
        """Return the decompressed content of a chunk; its first bytes tell whether it is bz2 or lz4.

        `at` is the byte offset in the file of the chunk record's data, after the record's header and length.

        Raises
        ------
        DamagedRecord : the chunk is damaged.
        """
        length = int.from_bytes(read_exactly(self.file, at - 4, 4), "little")
        data = read_exactly(self.file, at, length)
        try:
            return complete(bz2.BZ2Decompressor(), data) if data.startswith(b"BZh") else unlz4(data)
        except (OSError, RuntimeError, ValueError, EOFError) as error:
            raise DamagedRecord(f"cannot be decompressed: {error}") from None


def _records(file: BinaryIO, at: int, end: int) -> Iterator[tuple[dict[bytes, bytes], int, int]]:
    """Yield header fields, offset of the data and its length of each record."""
    while at < end:
        size = int.from_bytes(read_exactly(file, at, 4), "little")
        if size > _MAX_HEADER_BYTES:
            raise DamagedRecord(f"there is no valid record at byte {at}")
        head = read_exactly(file, at + 4, size + 4)
        length = int.from_bytes(head[size:], "little")
        yield _fields(head[:size]), at + 8 + size, length
        if at + 8 + size + length > end:
            raise DamagedRecord(f"ends in the middle of the record at byte {at}")
        at += 8 + size + length


def _fields(data: bytes) -> dict[bytes, bytes]:
    """Return the fields of a header, name -> value."""
    fields, at = {}, 0
    while at < len(data):
        size = int.from_bytes(data[at : at + 4], "little")
        name, equals, value = data[at + 4 : at + 4 + size].partition(b"=")
        if not equals or at + 4 + size > len(data):
            raise DamagedRecord("its header has no fields")
        fields[name] = value
        at += 4 + size
    return fields


def _number(fields: dict[bytes, bytes], name: bytes) -> int:
    """Return a field as an unsigned integer, 0 if it is absent."""
    return int.from_bytes(fields.get(name, b""), "little")
