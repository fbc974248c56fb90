"""ROS 1 bag files, format 2.0 (wiki.ros.org/Bags/Format/2.0): records of header fields and data; messages lie in chunks."""

from __future__ import annotations

import bz2
from collections.abc import Iterator
from typing import BinaryIO

from ...errors import require
from .records import WANTED, Broken, Chunked, Message, Topic, exactly, normal

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG, _CHUNK, _CONNECTION = 2, 3, 5, 7  # op codes
_MAX_HEADER = 1 << 20  # bytes; a header has a few fields


class Rosbag1(Chunked):
    """One `.bag` file."""

    def scan(self) -> Iterator[Message]:
        """All messages of the types that matter, in the order of the file; fills `topics` and `faults` meanwhile."""
        connections: dict[int, Topic] = {}
        chunks, stated = 0, None
        try:
            for fields, at, length in _records(self.file, len(MAGIC), self.size):
                op = _number(fields, b"op")
                if op == _BAG and _number(fields, b"index_pos"):
                    stated = _number(fields, b"chunk_count")
                if op == _CHUNK:
                    chunks += 1
                    yield from self._chunk(fields, at, length, connections)
        except Broken as error:
            if stated is None or chunks < stated or at + length > self.size:
                self.faults.append(str(error))
        else:
            if stated is not None and chunks < stated:
                self.faults.append(f"ends after {chunks} of {stated} chunks")

    def _chunk(self, fields: dict[bytes, bytes], at: int, length: int, connections: dict[int, Topic]) -> Iterator[Message]:
        chunk = at if fields.get(b"compression") != b"none" else -1
        try:
            source = self.source(chunk)
            begin, end = (0, len(self.inside(chunk))) if chunk >= 0 else (at, min(at + length, self.size))
            for inner, start, size in _records(source, begin, end):
                op = _number(inner, b"op")
                if op == _CONNECTION:
                    self._connect(inner, exactly(source, start, size), connections)
                elif op == _MESSAGE and start + size <= end:
                    topic = connections.get(_number(inner, b"conn"))
                    if topic and topic.kind in WANTED:
                        time = inner.get(b"time", bytes(8))
                        stamp = int.from_bytes(time[:4], "little") * 10**9 + int.from_bytes(time[4:], "little")
                        yield Message(topic, stamp, (self.number, chunk, start, size))
        except Broken as error:
            if at + length <= self.size:  # else the file ends here, which is said once
                self.faults.append(f"has a damaged chunk at byte {at} ({error}), what lay in it is lost")

    def _connect(self, fields: dict[bytes, bytes], data: bytes, connections: dict[int, Topic]) -> None:
        number = _number(fields, b"conn")
        if number not in connections:
            kind = normal(_fields(data).get(b"type", b"").decode("utf-8", "replace"))
            connections[number] = Topic(fields.get(b"topic", b"").decode("utf-8", "replace"), kind, "ros1")
            if connections[number] not in self.topics:
                self.topics.append(connections[number])

    def unpack(self, at: int) -> bytes:
        """The content of a chunk whose data begins at byte `at`; how it is packed its own first bytes tell."""
        length = int.from_bytes(exactly(self.file, at - 4, 4), "little")
        data = exactly(self.file, at, length)
        try:
            return bz2.decompress(data) if data.startswith(b"BZh") else bytes(require("lz4.frame", "bags").decompress(data))
        except (OSError, RuntimeError, ValueError, EOFError) as error:
            raise Broken(f"cannot be unpacked: {error}") from None


def _records(file: BinaryIO, at: int, end: int) -> Iterator[tuple[dict[bytes, bytes], int, int]]:
    """Header fields, first byte of the data, and its length, of one record after the other."""
    while at < end:
        size = int.from_bytes(exactly(file, at, 4), "little")
        if size > _MAX_HEADER:
            raise Broken(f"what begins at byte {at} is no record")
        head = exactly(file, at + 4, size + 4)
        length = int.from_bytes(head[size:], "little")
        yield _fields(head[:size]), at + 8 + size, length
        if at + 8 + size + length > end:
            raise Broken(f"ends in the middle of what begins at byte {at}")
        at += 8 + size + length


def _fields(data: bytes) -> dict[bytes, bytes]:
    fields, at = {}, 0
    while at < len(data):
        size = int.from_bytes(data[at : at + 4], "little")
        name, equals, value = data[at + 4 : at + 4 + size].partition(b"=")
        if not equals or at + 4 + size > len(data):
            raise Broken("a header without fields")
        fields[name] = value
        at += 4 + size
    return fields


def _number(fields: dict[bytes, bytes], name: bytes) -> int:
    return int.from_bytes(fields.get(name, b""), "little")
