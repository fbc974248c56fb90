"""Read the size of an image from its header, before the image is decoded."""

import mmap
import re
import struct
from pathlib import Path

from .guarding import read_bytes
from .limits import current_limits

Size = tuple[int, int]
"""Width and height of an image, px."""

_JPEG_MARKER = re.compile(rb"\xff([^\x00\x01\xd0-\xd9\xff])")
MAX_SEGMENTS = 1 << 16
"""Greatest number of segments and scans of a JPEG; a color profile, depth or second image takes one for each 64 kB."""

_JPEG_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}  # markers of a frame header
_PORTABLE = re.compile(rb"P[1-6Ffx](?:\s|#[^\r\n]*[\r\n])+(\d{1,18})(?:\s|#[^\r\n]*[\r\n])+(\d{1,18})")
_PAM_SIDE = {name: re.compile(name + rb"\s+(\d{1,18})") for name in (b"WIDTH", b"HEIGHT")}
_RADIANCE = re.compile(rb"-Y\s*\+?(\d{1,18})\s*\+X\s*\+?(\d{1,18})")
_TIFF_WHOLE = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 16: "Q", 17: "q"}  # types of whole numbers
_TIFF_SIDES = {256: 0, 257: 1, 322: 0, 323: 1}  # width and height, of the picture and of its tiles
_MAX_TAGS = 4096  # of a TIFF
_WINDOW = re.compile(rb"(?:dataWindow|displayWindow)\0box2i\0")  # in the header of an EXR
_HEAD_BYTES = 1 << 16  # within which the headers of AVIF, EXR, portable maps and Radiance give the size
_MAX_PIXEL_BYTES = 16
"""Greatest number of bytes of a file per pixel: four channels of 32 bits."""

_MAX_EXTRA_BYTES = 1 << 26
"""Greatest number of further bytes of an image file: profiles, previews, the video that a phone appends."""


def read_encoded(path: str | Path, where: str | None = None) -> bytes:
    """Read an image file; refuse it if it has more bytes than the size in its header can need.

    Parameters
    ----------
    path
        the file.
    where
        name of the file in errors; None for its path.

    Raises
    ------
    InputError : the file is missing, cannot be read, is a device or a pipe, or is larger.
    """
    width, height = file_size(path) or (0, 0)
    pixels = min(width * height, current_limits().max_pixels)
    return read_bytes(path, _MAX_EXTRA_BYTES + _MAX_PIXEL_BYTES * pixels, where)


def file_size(path: str | Path) -> Size | None:
    """Return (width, height) px of an image file from its header; None if it is unknown or the file cannot be read."""
    try:
        if not Path(path).is_file():
            return None
        with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return announced_size(data)
    except (OSError, ValueError):
        return None


def announced_size(data: bytes | mmap.mmap) -> Size | None:
    """Return (width, height) px from the header of an encoded image; None if it is uncertain.

    Supported are PNG, JPEG, TIFF, BMP, GIF, WebP, EXR, JPEG 2000, AVIF and HEIF, portable maps (PNM, PFM), Radiance and Sun
    raster. If a file has several sizes, the largest is returned, since decoders differ in the image that they choose.
    """
    try:
        return _announced(data)
    except (struct.error, IndexError):  # cut off inside the header: the decoder reports it
        return None


def _announced(data: bytes | mmap.mmap) -> Size | None:
    head = data[:_HEAD_BYTES]
    if head.startswith(b"\x89PNG\r\n\x1a\n"):
        if head[12:16] != b"IHDR":
            return None
        return _largest([struct.unpack_from(">II", head, 16)])
    if head.startswith(b"\xff\xd8\xff"):
        return _jpeg(data)
    if head[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return _tiff(data, "<" if head[:1] == b"I" else ">")
    if head.startswith(b"BM"):
        small = struct.unpack_from("<I", head, 14)[0] == 12
        width, height = struct.unpack_from("<HH" if small else "<ii", head, 18)
        return abs(width), abs(height)
    if head.startswith(b"GIF8"):
        return _largest([struct.unpack_from("<HH", head, 6)])
    if head.startswith(b"RIFF") and head[8:12] == b"WEBP":
        return _webp(head)
    if head.startswith(b"v/1\x01"):
        boxes = [struct.unpack_from("<4i", head, match.end() + 4) for match in _WINDOW.finditer(head)]
        return _largest([(right - left + 1, below - above + 1) for left, above, right, below in boxes])
    if head.startswith((b"\0\0\0\x0cjP  ", b"\xffO\xffQ")):  # a file, and a codestream alone
        streams = re.finditer(rb"\xffO\xffQ", data[:_MAX_EXTRA_BYTES])  # the boxes before it give no size that decoders use
        return _largest([struct.unpack_from(">II", data, match.end() + 4) for match in streams])
    if head[4:8] == b"ftyp":
        return _largest([struct.unpack_from(">II", head, match.end() + 4) for match in re.finditer(rb"ispe", head)])
    if head.startswith(b"\x59\xa6\x6a\x95"):
        return _largest([struct.unpack_from(">II", head, 4)])
    if head.startswith(b"P7"):
        width, height = (max((int(match[1]) for match in side.finditer(head)), default=0) for side in _PAM_SIDE.values())
        return (width, height) if b"ENDHDR" in head else None
    if match := _PORTABLE.match(head):
        return int(match[1]), int(match[2])
    if head.startswith(b"#?") and b"\n\n" in head:  # the size is in the line after the first empty one, or before
        return _largest([(int(match[2]), int(match[1])) for match in _RADIANCE.finditer(head)])
    return None


def _largest(sizes: list[Size] | list[tuple[int, ...]]) -> Size | None:
    largest = max(sizes, key=lambda size: abs(size[0] * size[1]), default=None)
    return None if largest is None else (abs(largest[0]), abs(largest[1]))


def _jpeg(data: bytes | mmap.mmap) -> Size | None:
    at = 2
    for _ in range(MAX_SEGMENTS):
        if (marker := _JPEG_MARKER.search(data, at, _MAX_EXTRA_BYTES)) is None:
            return None
        at = marker.end()
        if marker[1][0] in _JPEG_FRAMES:
            height, width = struct.unpack_from(">HH", data, at + 3)
            return width, height
        if marker[1][0] == 0xDA:  # compressed data begin without a size before
            return None
        at += int.from_bytes(data[at : at + 2], "big")
    return None


def _tiff(data: bytes | mmap.mmap, order: str) -> Size | None:
    """Return (width, height) px of the first picture of a TIFF or BigTIFF, or of its tiles if larger; None if incomplete."""
    is_big = b"+" in data[2:4]
    at = struct.unpack_from(order + ("Q" if is_big else "I"), data, 8 if is_big else 4)[0]
    count = struct.unpack_from(order + ("Q" if is_big else "H"), data, at)[0]
    step, first = (20, at + 8) if is_big else (12, at + 2)
    sides, found = [0, 0], set[int]()
    for start in range(first, first + step * min(count, _MAX_TAGS), step):
        tag, kind = struct.unpack_from(order + "HH", data, start)
        if tag in _TIFF_SIDES:
            if kind not in _TIFF_WHOLE:
                return None
            value = struct.unpack_from(order + _TIFF_WHOLE[kind], data, start + (12 if is_big else 8))[0]
            sides[_TIFF_SIDES[tag]] = max(sides[_TIFF_SIDES[tag]], abs(value))
            found.add(tag)
    return (sides[0], sides[1]) if count <= _MAX_TAGS and {256, 257} <= found else None


def _webp(data: bytes) -> Size | None:
    kind = data[12:16]
    if kind == b"VP8X":
        return int.from_bytes(data[24:27], "little") + 1, int.from_bytes(data[27:30], "little") + 1
    if kind == b"VP8L":
        bits = int.from_bytes(data[21:25], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    width, height = struct.unpack_from("<HH", data, 26)
    return width & 0x3FFF, height & 0x3FFF
