"""MCAP files (mcap.dev/spec): records of one byte op code, eight bytes length and data; messages lie in chunks or free."""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Iterator
from typing import BinaryIO

from ...errors import require
from .records import WANTED, Broken, Chunked, Message, Topic, exactly, normal

MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15
_HEAD = struct.Struct("<QQQII")  # of a chunk: start, end, bytes unpacked, checksum, length of the compression's name
_STAMPS = struct.Struct("<HIQQ")  # of a message: channel, sequence, when recorded, when published


class Mcap(Chunked):
    """One `.mcap` file."""

    def scan(self) -> Iterator[Message]:
        """All messages of the types that matter, in the order of the file; fills `topics` and `faults` meanwhile."""
        schemas: dict[int, str] = {}
        channels: dict[int, Topic] = {}
        try:
            for op, at, length in _records(self.file, len(MAGIC), self.size):
                if op == _DATA_END:
                    return
                if op == _CHUNK:
                    yield from self._chunk(at, length, schemas, channels)
                else:
                    yield from self._record(self.file, -1, op, at, length, schemas, channels)
            self.faults.append("ends without its end mark, it was not closed")
        except Broken as error:
            self.faults.append(str(error))

    def _chunk(self, at: int, length: int, schemas: dict[int, str], channels: dict[int, Topic]) -> Iterator[Message]:
        try:
            _, _, name, begin = self._head(at)
            chunk = at if name else -1
            source = self.source(chunk)
            first, end = (0, len(self.inside(chunk))) if name else (begin, min(at + length, self.size))
            for op, start, size in _records(source, first, end):
                if start + size <= end:
                    yield from self._record(source, chunk, op, start, size, schemas, channels)
        except Broken as error:
            if at + length <= self.size:  # else the file ends here, which is said once
                self.faults.append(f"has a damaged chunk at byte {at} ({error}), what lay in it is lost")

    def _record(
        self, source: BinaryIO, chunk: int, op: int, at: int, length: int, schemas: dict[int, str], channels: dict[int, Topic]
    ) -> Iterator[Message]:
        if op == _SCHEMA:
            data = exactly(source, at, length)
            schemas[int.from_bytes(data[:2], "little")] = _string(data, 2)[0]
        elif op == _CHANNEL:
            data = exactly(source, at, length)
            number, schema = struct.unpack_from("<HH", data)
            name, next_at = _string(data, 4)
            if number not in channels:
                channels[number] = Topic(name, normal(schemas.get(schema, "")), _string(data, next_at)[0])
                self.topics.append(channels[number])
        elif op == _MESSAGE:
            channel, _, time, _ = _STAMPS.unpack(exactly(source, at, _STAMPS.size))
            topic = channels.get(channel)
            if topic and topic.kind in WANTED:
                yield Message(topic, time, (self.number, chunk, at + _STAMPS.size, length - _STAMPS.size))

    def _head(self, at: int) -> tuple[int, int, str, int]:
        """Bytes unpacked, checksum, the compression's name ("" for none) and the first byte of the records."""
        _, _, size, checksum, letters = _HEAD.unpack(exactly(self.file, at, _HEAD.size))
        if letters > 16:
            raise Broken("its head makes no sense")
        name = exactly(self.file, at + _HEAD.size, letters).decode("utf-8", "replace")
        return size, checksum, name, at + _HEAD.size + letters + 8

    def unpack(self, at: int) -> bytes:
        """The content of the chunk whose data begins at byte `at`, its checksum compared."""
        size, checksum, name, begin = self._head(at)
        data = exactly(self.file, begin, int.from_bytes(exactly(self.file, begin - 8, 8), "little"))
        if name not in ("lz4", "zstd"):
            raise Broken(f"is packed by {name!r}, lz4 and zstd can be read")
        content = unzstd(data) if name == "zstd" else _unlz4(data)
        if len(content) != size or (checksum and zlib.crc32(content) != checksum):
            raise Broken("its checksum does not fit")
        return content


def unzstd(data: bytes) -> bytes:
    """What was packed by Zstandard; raises Broken."""
    zstd = require("compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd", "bags")
    try:
        return bytes(zstd.decompress(data))
    except (zstd.ZstdError, ValueError, EOFError) as error:
        raise Broken(f"cannot be unpacked: {error}") from None


def _unlz4(data: bytes) -> bytes:
    try:
        return bytes(require("lz4.frame", "bags").decompress(data))
    except (RuntimeError, ValueError, EOFError) as error:
        raise Broken(f"cannot be unpacked: {error}") from None


def _records(file: BinaryIO, at: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Op code, first byte of the data, and its length, of one record after the other."""
    while at < end:
        head = exactly(file, at, 9)
        length = int.from_bytes(head[1:], "little")
        if not head[0]:
            raise Broken(f"what begins at byte {at} is no record")
        yield head[0], at + 9, length
        if at + 9 + length > end:
            raise Broken(f"ends in the middle of what begins at byte {at}")
        at += 9 + length


def _string(data: bytes, at: int) -> tuple[str, int]:
    """A text behind its length, and the byte after it."""
    size = int.from_bytes(data[at : at + 4], "little")
    return data[at + 4 : at + 4 + size].decode("utf-8", "replace"), at + 4 + size
