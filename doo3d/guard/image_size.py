"""The size that an image announces in its header, before it is decoded."""

from __future__ import annotations

import re
import struct

Size = tuple[int, int]
"""width, height in px."""

_JPEG_MARKER = re.compile(rb"\xff([^\x00\x01\xd0-\xd9\xff])")
_JPEG_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}  # markers of a frame header
_PORTABLE = re.compile(rb"P[1-7FfxX](?:\s|#[^\n]*\n)+(?:WIDTH\s+)?(\d{1,18})(?:\s|#[^\n]*\n)+(?:HEIGHT\s+)?(\d{1,18})")
_RADIANCE = re.compile(rb"[-+]Y\s+(\d{1,18})\s+[-+]X\s+(\d{1,18})")
_TIFF_TYPES = {3: "H", 4: "I", 16: "Q"}
_MAX_TAGS = 4096  # of a TIFF
_WINDOW = re.compile(rb"(?:dataWindow|displayWindow)\0box2i\0")  # in the header of an EXR
_HEAD_BYTES = 1 << 16  # within which the boxes of AVIF and JPEG 2000, and the headers of EXR, give the size


def announced_size(data: bytes) -> Size | None:
    """Return (width, height) px that the header of an encoded image announces; None if it has no header that is known.

    Known are PNG, JPEG, TIFF, BMP, GIF, WebP, EXR, JPEG 2000, AVIF and HEIF, portable maps (PNM, PFM), Radiance and Sun raster.
    Of several sizes in one file the largest counts.
    """
    try:
        return _announced(data)
    except (struct.error, IndexError):  # cut off inside the header: the decoder reports it
        return None


def _announced(data: bytes) -> Size | None:
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        if data[12:16] != b"IHDR":
            return None
        return _largest([struct.unpack_from(">II", data, 16)])
    if data.startswith(b"\xff\xd8\xff"):
        return _jpeg(data)
    if data[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return _tiff(data, "<" if data[:1] == b"I" else ">")
    if data.startswith(b"BM"):
        small = struct.unpack_from("<I", data, 14)[0] == 12
        width, height = struct.unpack_from("<HH" if small else "<ii", data, 18)
        return abs(width), abs(height)
    if data.startswith(b"GIF8"):
        return _largest([struct.unpack_from("<HH", data, 6)])
    if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        return _webp(data)
    head = data[:_HEAD_BYTES]
    if data.startswith(b"v/1\x01"):
        boxes = [struct.unpack_from("<4i", data, match.end() + 4) for match in _WINDOW.finditer(head)]
        return _largest([(right - left + 1, below - above + 1) for left, above, right, below in boxes])
    if data.startswith(b"\0\0\0\x0cjP  "):
        at = head.find(b"ihdr")
        height, width = struct.unpack_from(">II", data, at + 4) if at >= 0 else (0, 0)
        streams = [struct.unpack_from(">II", data, match.end() + 4) for match in re.finditer(rb"\xffO\xffQ", head)]
        return _largest([(width, height), *streams])
    if data[4:8] == b"ftyp":
        return _largest([struct.unpack_from(">II", data, match.end() + 4) for match in re.finditer(rb"ispe", head)])
    if data.startswith(b"\x59\xa6\x6a\x95"):
        return _largest([struct.unpack_from(">II", data, 4)])
    if match := _PORTABLE.match(head):
        return int(match[1]), int(match[2])
    if data.startswith(b"#?") and (match := _RADIANCE.search(head)):
        return int(match[2]), int(match[1])
    return None


def _largest(sizes: list[Size] | list[tuple[int, ...]]) -> Size | None:
    largest = max(sizes, key=lambda size: abs(size[0] * size[1]), default=None)
    return None if largest is None else (abs(largest[0]), abs(largest[1]))


def _jpeg(data: bytes) -> Size | None:
    at = 2
    while (marker := _JPEG_MARKER.search(data, at)) is not None:
        at = marker.end()
        if marker[1][0] in _JPEG_FRAMES:
            height, width = struct.unpack_from(">HH", data, at + 3)
            return width, height
        if marker[1][0] == 0xDA:  # compressed data begin without a size before
            return None
        at += int.from_bytes(data[at : at + 2], "big")
    return None


def _tiff(data: bytes, order: str) -> Size | None:
    """Return the size of the first picture of a TIFF or BigTIFF: its tags 256 and 257."""
    is_big = data[2:3] == b"+" or data[3:4] == b"+"
    at = struct.unpack_from(order + ("Q" if is_big else "I"), data, 8 if is_big else 4)[0]
    count = struct.unpack_from(order + ("Q" if is_big else "H"), data, at)[0]
    step, first = (20, at + 8) if is_big else (12, at + 2)
    values = {}
    for start in range(first, first + step * min(count, _MAX_TAGS), step):
        tag, kind = struct.unpack_from(order + "HH", data, start)
        if tag in (256, 257) and kind in _TIFF_TYPES:
            values[tag] = struct.unpack_from(order + _TIFF_TYPES[kind], data, start + (12 if is_big else 8))[0]
    return (values[256], values[257]) if len(values) == 2 else None


def _webp(data: bytes) -> Size | None:
    kind = data[12:16]
    if kind == b"VP8X":
        return int.from_bytes(data[24:27], "little") + 1, int.from_bytes(data[27:30], "little") + 1
    if kind == b"VP8L":
        bits = int.from_bytes(data[21:25], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    width, height = struct.unpack_from("<HH", data, 26)
    return width & 0x3FFF, height & 0x3FFF
