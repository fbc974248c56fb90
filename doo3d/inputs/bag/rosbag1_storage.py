"""Read ROS 1 bag files, format 2.0 (wiki.ros.org/Bags/Format/2.0): records of header fields and data, in chunks."""

from __future__ import annotations

import bz2
from collections.abc import Iterator
from functools import partial
from typing import BinaryIO

from .records import READ_TYPES, Chunked, DamagedRecord, Message, Topic, decompress, read_exactly, ros2_type, unlz4

_Fields = dict[bytes, bytes]
"""Fields in the header of a record: name -> value."""
MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG, _CHUNK, _CONNECTION = 2, 3, 5, 7  # op codes
_MAX_HEADER_BYTES = 1 << 20  # a header has a few fields


class Rosbag1(Chunked[_Fields]):
    """An open ROS 1 bag file (`.bag`): `scan` lists its messages, `read` returns the bytes of one."""

    def scan(self) -> Iterator[Message]:
        """Yield the messages of the types that doo3d reads; see Storage."""
        chunks, declared, at, length = 0, None, 0, 0
        try:
            for fields, at, length in self.records(self.file, len(MAGIC), self.size):
                self.count_record()
                op = _number(fields, b"op")
                if op == _BAG and _number(fields, b"index_pos"):
                    declared = _number(fields, b"chunk_count")
                if op == _CHUNK:
                    chunks += 1
                    is_plain = fields.get(b"compression") == b"none"
                    yield from self.scan_chunk(at, length, partial({True: at, False: None}.get, is_plain))
        except DamagedRecord as error:
            if declared is None or chunks < declared or at + length > self.size:
                self.faults.append(str(error))
        else:
            if declared is not None and chunks < declared:
                self.faults.append(f"ends after {chunks} of {declared} chunks")

    def records(self, file: BinaryIO, at: int, end: int) -> Iterator[tuple[_Fields, int, int]]:
        """Yield header fields, offset of the data and its length of each record."""
        while at < end:
            size = int.from_bytes(read_exactly(file, at, 4), "little")
            if not 0 < size <= _MAX_HEADER_BYTES:
                raise DamagedRecord(f"there is no valid record at byte {at}")
            head = read_exactly(file, at + 4, size + 4)
            length = int.from_bytes(head[size:], "little")
            yield _fields(head[:size]), at + 8 + size, length
            if at + 8 + size + length > end:
                raise DamagedRecord(f"ends in the middle of the record at byte {at}")
            at += 8 + size + length

    def record(self, source: BinaryIO, chunk: int, head: _Fields, at: int, length: int) -> Iterator[Message]:
        """Yield the message of a record; see Chunked."""
        op, number = _number(head, b"op"), _number(head, b"conn")
        if op == _CONNECTION:
            kind = _fields(read_exactly(source, at, length)).get(b"type", b"").decode("utf-8", "replace")
            self.add_topic(number, Topic(head.get(b"topic", b"").decode("utf-8", "replace"), ros2_type(kind), "ros1"))
        elif op == _MESSAGE and (topic := self.channels.get(number)) and topic.kind in READ_TYPES:
            time = head.get(b"time", bytes(8))
            stamp = int.from_bytes(time[:4], "little") * 10**9 + int.from_bytes(time[4:], "little")
            yield Message(topic, stamp, (self.number, chunk, at, length))

    def decompress(self, at: int) -> bytes:
        """Decompress a chunk, whose first bytes identify bz2 or lz4; see Chunked."""
        data = read_exactly(self.file, at, int.from_bytes(read_exactly(self.file, at - 4, 4), "little"))
        return decompress(data, bz2.BZ2Decompressor()) if data.startswith(b"BZh") else unlz4(data)


def _fields(data: bytes) -> _Fields:
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


def _number(fields: _Fields, name: bytes) -> int:
    """Return a field as an unsigned integer, 0 if it is absent."""
    return int.from_bytes(fields.get(name, b""), "little")
