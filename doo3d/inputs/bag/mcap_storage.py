"""Read MCAP files (mcap.dev/spec): records of op code (1 byte), length (8 bytes) and data, in chunks or outside."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from functools import partial
from typing import BinaryIO

from . import foxglove
from .records import READ_TYPES, Chunked, DamagedRecord, Message, Topic, check_chunk, read_exactly, ros2_type, unlz4, unzstd

MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15
_CHUNK_HEADER = struct.Struct("<QQQII")  # start, end, decompressed bytes, checksum, length of the compression's name
_MESSAGE_HEADER = struct.Struct("<HIQQ")  # channel, sequence, time of recording, time of publishing


class Mcap(Chunked[int]):
    """An open MCAP file: `scan` lists its messages, `read` returns the bytes of one."""

    def scan(self) -> Iterator[Message]:
        """Yield the messages of the types that doo3d reads; see Storage."""
        self._schemas: dict[int, str] = {}
        try:
            for op, at, length in self.records(self.file, len(MAGIC), self.size):
                self.count_record()
                if op == _DATA_END:
                    return
                if op == _CHUNK:
                    yield from self.scan_chunk(at, length, partial(self._first_record, at))
                else:
                    yield from self.record(self.file, -1, op, at, length)
            self.faults.append("has no end record, the recorder did not close it")
        except DamagedRecord as error:
            self.faults.append(str(error))

    def records(self, file: BinaryIO, at: int, end: int) -> Iterator[tuple[int, int, int]]:
        """Yield op code, offset of the data and its length of each record."""
        while at < end:
            head = read_exactly(file, at, 9)
            length = int.from_bytes(head[1:], "little")
            if not head[0]:
                raise DamagedRecord(f"there is no valid record at byte {at}")
            yield head[0], at + 9, length
            if at + 9 + length > end:
                raise DamagedRecord(f"ends in the middle of the record at byte {at}")
            at += 9 + length

    def record(self, source: BinaryIO, chunk: int, head: int, at: int, length: int) -> Iterator[Message]:
        """Yield the message of a record; see Chunked."""
        if head == _SCHEMA:
            data = read_exactly(source, at, length)
            self._schemas[int.from_bytes(data[:2], "little")] = _string(data, 2)[0]
        elif head == _CHANNEL:
            data = read_exactly(source, at, length)
            number, schema = struct.unpack_from("<HH", data)
            name, next_at = _string(data, 4)
            kind, encoding = ros2_type(self._schemas.get(schema, "")), _string(data, next_at)[0]
            if kind in foxglove.KINDS and encoding in foxglove.SERIALIZATIONS:
                kind, encoding = foxglove.KINDS[kind], f"{kind} {encoding}"
            self.add_topic(number, Topic(name, kind, encoding))
        elif head == _MESSAGE:
            channel, _, time, _ = _MESSAGE_HEADER.unpack(read_exactly(source, at, _MESSAGE_HEADER.size))
            topic = self.channels.get(channel)
            if topic and topic.kind in READ_TYPES:
                yield Message(topic, time, (self.number, chunk, at + _MESSAGE_HEADER.size, length - _MESSAGE_HEADER.size))

    def _chunk_header(self, at: int) -> tuple[int, int, str, int]:
        """Return decompressed bytes, checksum, the compression's name ("" for none) and the offset of the records."""
        _, _, size, checksum, letters = _CHUNK_HEADER.unpack(read_exactly(self.file, at, _CHUNK_HEADER.size))
        if letters > 16:
            raise DamagedRecord("its header is invalid")
        name = read_exactly(self.file, at + _CHUNK_HEADER.size, letters).decode("utf-8", "replace")
        return size, checksum, name, at + _CHUNK_HEADER.size + letters + 8

    def _first_record(self, at: int) -> int | None:
        _, _, name, begin = self._chunk_header(at)
        return None if name else begin

    def decompress(self, at: int) -> bytes:
        """Return the decompressed content of a chunk, after checking its size and checksum; see Chunked."""
        size, checksum, name, begin = self._chunk_header(at)
        data = read_exactly(self.file, begin, int.from_bytes(read_exactly(self.file, begin - 8, 8), "little"))
        if name not in ("lz4", "zstd"):
            raise DamagedRecord(f"is compressed by {name!r}, only lz4 and zstd can be read")
        check_chunk(size)
        content = unzstd(data) if name == "zstd" else unlz4(data)
        if len(content) != size or (checksum and zlib.crc32(content) != checksum):
            raise DamagedRecord("its checksum does not match")
        return content


def _string(data: bytes, at: int) -> tuple[str, int]:
    """Return the length-prefixed text at byte `at`, and the offset after it."""
    size = int.from_bytes(data[at : at + 4], "little")
    return data[at + 4 : at + 4 + size].decode("utf-8", "replace"), at + 4 + size
