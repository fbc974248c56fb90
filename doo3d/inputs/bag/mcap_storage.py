"""MCAP files (mcap.dev/spec): records of one byte op code, eight bytes length and data; messages are in chunks or outside."""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Iterator
from typing import BinaryIO

from ...errors import require
from .records import READ_TYPES, Chunked, DamagedRecord, Message, Topic, check_chunk, complete, read_exactly, ros2_type

MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15
_CHUNK_HEADER = struct.Struct("<QQQII")  # start, end, decompressed bytes, checksum, length of the compression's name
_MESSAGE_HEADER = struct.Struct("<HIQQ")  # channel, sequence, time of recording, time of publishing


class Mcap(Chunked):
    """An open MCAP file: `scan` lists its messages, `read` returns the bytes of one."""

    def scan(self) -> Iterator[Message]:
        """Yield a Message (topic, time, location; not the content) for each message of a type that doo3d reads, in file order.

        The scan fills `topics` with all topics of the file, and `faults` with the damage found; damage raises no error.
        """
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
            self.faults.append("has no end record, the recorder did not close it")
        except DamagedRecord as error:
            self.faults.append(str(error))

    def _chunk(self, at: int, length: int, schemas: dict[int, str], channels: dict[int, Topic]) -> Iterator[Message]:
        try:
            _, _, name, begin = self._chunk_header(at)
            chunk = at if name else -1
            source = self.source(chunk)
            first, end = (0, len(self.chunk_content(chunk))) if name else (begin, min(at + length, self.size))
            for op, start, size in _records(source, first, end):
                if start + size <= end:
                    yield from self._record(source, chunk, op, start, size, schemas, channels)
        except DamagedRecord as error:
            if at + length <= self.size:  # else the file ends here, reported once by `scan`
                self.faults.append(f"has a damaged chunk at byte {at} ({error}), its messages are lost")

    def _record(
        self, source: BinaryIO, chunk: int, op: int, at: int, length: int, schemas: dict[int, str], channels: dict[int, Topic]
    ) -> Iterator[Message]:
        if op == _SCHEMA:
            data = read_exactly(source, at, length)
            schemas[int.from_bytes(data[:2], "little")] = _string(data, 2)[0]
        elif op == _CHANNEL:
            data = read_exactly(source, at, length)
            number, schema = struct.unpack_from("<HH", data)
            name, next_at = _string(data, 4)
            if number not in channels:
                channels[number] = Topic(name, ros2_type(schemas.get(schema, "")), _string(data, next_at)[0])
                self.topics.append(channels[number])
        elif op == _MESSAGE:
            channel, _, time, _ = _MESSAGE_HEADER.unpack(read_exactly(source, at, _MESSAGE_HEADER.size))
            topic = channels.get(channel)
            if topic and topic.kind in READ_TYPES:
                yield Message(topic, time, (self.number, chunk, at + _MESSAGE_HEADER.size, length - _MESSAGE_HEADER.size))

    def _chunk_header(self, at: int) -> tuple[int, int, str, int]:
        """Return decompressed bytes, checksum, the compression's name ("" for none) and the offset of the records."""
        _, _, size, checksum, letters = _CHUNK_HEADER.unpack(read_exactly(self.file, at, _CHUNK_HEADER.size))
        if letters > 16:
            raise DamagedRecord("its header is invalid")
        name = read_exactly(self.file, at + _CHUNK_HEADER.size, letters).decode("utf-8", "replace")
        return size, checksum, name, at + _CHUNK_HEADER.size + letters + 8

    def decompress(self, at: int) -> bytes:
        """Return the decompressed content of a chunk, which is a series of records, after checking its size and checksum.

        `at` is the byte offset in the file of the chunk record's data, after the record's op code and length.

        Raises
        ------
        DamagedRecord : the chunk is damaged, or compressed by another method than lz4 and zstd.
        """
        size, checksum, name, begin = self._chunk_header(at)
        data = read_exactly(self.file, begin, int.from_bytes(read_exactly(self.file, begin - 8, 8), "little"))
        if name not in ("lz4", "zstd"):
            raise DamagedRecord(f"is compressed by {name!r}, only lz4 and zstd can be read")
        check_chunk(size)
        content = unzstd(data) if name == "zstd" else unlz4(data)
        if len(content) != size or (checksum and zlib.crc32(content) != checksum):
            raise DamagedRecord("its checksum does not match")
        return content


def unzstd(data: bytes) -> bytes:
    """Decompress Zstandard data.

    Raises
    ------
    DamagedRecord : the data cannot be decompressed. MissingDependency : backports.zstd is not installed (Python before 3.14).
    """
    zstd = require("compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd", "bags")
    try:
        return bytes(complete(zstd.ZstdDecompressor(), data))
    except (zstd.ZstdError, ValueError, EOFError) as error:
        raise DamagedRecord(f"cannot be decompressed: {error}") from None


def unlz4(data: bytes) -> bytes:
    """Decompress LZ4 data; the errors are those of `unzstd`."""
    try:
        return bytes(complete(require("lz4.frame", "bags").LZ4FrameDecompressor(), data))
    except (RuntimeError, ValueError, EOFError) as error:
        raise DamagedRecord(f"cannot be decompressed: {error}") from None


def _records(file: BinaryIO, at: int, end: int) -> Iterator[tuple[int, int, int]]:
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


def _string(data: bytes, at: int) -> tuple[str, int]:
    """Return the length-prefixed text at byte `at`, and the offset after it."""
    size = int.from_bytes(data[at : at + 4], "little")
    return data[at + 4 : at + 4 + size].decode("utf-8", "replace"), at + 4 + size
