"""A recording of the iPhone app Record3D: a `.r3d` file, which is a ZIP that is read where it lies.

The format as its author describes it: github.com/marek-simonik/record3d, issues 7, 24, 36, 64, 93, 94 and 108.
"""

from __future__ import annotations

import re
import stat
import struct
import zipfile
import zlib
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np

from ...errors import InputError, require
from ...types import Array, Floats, Frame
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.depth_frames import Pinhole, camera_for, check_unit, json_object, numbers, pinhole_of
from ..support.images import read_color
from ..support.listing import natural
from .trajectory import pose_from

_OUTSIDE = re.compile(r"/|[A-Za-z]:")
METADATA, FOLDER = "metadata", "rgbd/"
_TURN = np.diag([1.0, -1.0, -1.0, 1.0])  # from x right, y up, z backward (OpenGL) to the optical frame
_MOST_METADATA, _MOST_IMAGE = 1 << 28, 1 << 26  # bytes unpacked: an hour of frames; a photograph
_MOST_PIXELS = 1 << 24  # of a depth image
_BLOCK, _SPARE = 10_000, 64  # bytes that a block of LZFSE stands for at least, but for the last (most: 30000); its head
_SHAPE = 1e-2  # by which the sides of colour and depth may differ in proportion


class Record3DCapture:
    """The frames of a recording by their number: depth in metres, colour scaled down to its size, intrinsics with it.

    The poses, of a camera with y up that looks along -z, are turned into the optical frame's. Nothing is unpacked to disk.
    """

    what: ClassVar[str] = "a recording of the app Record3D (.r3d)"
    format = "record3d"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        require("lzfse", "record3d")
        self.path = path
        recorded = _open(path)
        about = json_object(_member(path, recorded, METADATA, _MOST_METADATA), f"{path}: {METADATA}")
        names = [name.removeprefix(FOLDER) for name in recorded.namelist() if name.startswith(FOLDER)]
        stems = sorted({name.rpartition(".")[0] for name in names if name.endswith((".depth", ".jpg"))}, key=natural)
        if not stems:
            raise InputError(f"{path}: holds no frames, expected {FOLDER}0.depth and {FOLDER}0.jpg", code="frames-missing")
        size = _size(path, about, "dw", "dh") if "dw" in about else _size(path, about, "w", "h")
        changed = path.stat().st_mtime_ns
        self.frames = []
        for stem in stems:
            pinhole, time, pose = _pinhole(path, about, stem, size, options), _time(about, stem), _row(about, "poses", stem)
            self.frames.append(FrameRef(stem, path, partial(_load, path, changed, stem, size, pinhole, time, pose), time))

    @staticmethod
    def can_read(path: Path) -> bool:
        """Whether `path` is a ZIP with metadata and frames as the app writes them, or failing that is called so."""
        if not path.is_file():
            return False
        try:
            with zipfile.ZipFile(path) as opened:
                names = opened.namelist()
            return METADATA in names and any(name.startswith(FOLDER) for name in names)
        except (zipfile.BadZipFile, ValueError, NotImplementedError):
            return path.suffix.lower() == ".r3d"


def _open(path: Path) -> zipfile.ZipFile:
    """The ZIP, after a look at all its names.

    Raises
    ------
    InputError : it is cut off or none, or holds a name or a link that leads out of it.
    """
    try:
        opened = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        raise InputError(f"{path}: is cut off or not a recording of Record3D ({error})", code="file-damaged") from None
    for member in opened.infolist():
        name = member.orig_filename.replace("\\", "/")
        if name.startswith("/") or ":" in name or ".." in name.split("/") or stat.S_ISLNK(member.external_attr >> 16):
            opened.close()
            raise InputError(
                f"{path}: holds {member.orig_filename!r}, a path or a link that leads out of it: it is not safe to read",
                code="archive-unsafe",
            )
    return opened


@lru_cache(maxsize=1)
def _opened(path: Path, changed: int) -> zipfile.ZipFile:
    """One open file for all entries of a recording; `changed` tells one that was written anew."""
    return _open(path)


def _member(path: Path, opened: zipfile.ZipFile, name: str, most: int) -> bytes:
    """What is in the file `name` of the ZIP; never more than `most` bytes are unpacked."""
    try:
        with opened.open(name) as file:
            data = file.read(most + 1)
    except KeyError:
        raise InputError(f"{path}: {name} is missing", code="file-missing") from None
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, RuntimeError, NotImplementedError) as error:
        raise InputError(f"{path}: {name} is damaged ({error})", code="file-damaged") from None
    if len(data) > most:
        raise InputError(f"{path}: {name} unpacks to more than {most} bytes, which no recording has", code="size-too-large")
    return data


def _load(
    path: Path, changed: int, stem: str, size: tuple[int, int], pinhole: Pinhole, time: float | None, pose: Any
) -> FrameData:
    opened = _opened(path, changed)
    where = f"{path}: {FOLDER}{stem}"
    depth = _depth(path, opened, stem, size)
    check_unit(depth, path, 1.0)
    data = _member(path, opened, f"{FOLDER}{stem}.jpg", _MOST_IMAGE)
    color = read_color(path / FOLDER / f"{stem}.jpg", data=data)
    if abs(color.shape[1] * size[1] / (color.shape[0] * size[0]) - 1) > _SHAPE:
        raise InputError(
            f"{where}: colour is {color.shape[1]}x{color.shape[0]}, depth {size[0]}x{size[1]}: not the same view",
            code="color-size",
        )
    if color.shape[:2] != depth.shape:
        color = cv2.resize(color, size, interpolation=cv2.INTER_AREA)
    frame = Frame(np.asarray(color), depth, camera_for(pinhole, depth.shape), stem, time)
    return FrameData(frame, pose=None if pose is None else _pose(pose, f"{path}: {METADATA}: poses: frame {stem}"))


def _depth(path: Path, opened: zipfile.ZipFile, stem: str, size: tuple[int, int]) -> Array:
    """(H, W) float32 m."""
    where, length = f"{path}: {FOLDER}{stem}.depth", 4 * size[0] * size[1]
    data = _member(path, opened, f"{FOLDER}{stem}.depth", length + _SPARE)
    announced, blocks = _announced(data)
    # a block that lies about itself still unpacks to 24 MB at most, so not more of them than this image needs
    if announced > length or blocks > length // _BLOCK + 2:
        raise InputError(f"{where}: unpacks to more than an image of {size[0]}x{size[1]}", code="size-too-large")
    lzfse = require("lzfse", "record3d")
    try:
        raw = lzfse.decompress(data)
    except lzfse.error:
        raise InputError(f"{where}: is cut off or damaged", code="file-damaged") from None
    if len(raw) != length:
        raise InputError(
            f"{where}: has {len(raw)} bytes, expected {length} for {size[0]}x{size[1]} float32 metres", code="depth-shape"
        )
    return np.frombuffer(raw, "<f4").reshape(size[1], size[0])


def _announced(data: bytes) -> tuple[int, int]:
    """The bytes that LZFSE data says it unpacks to, and how many blocks it has, by the heads of the blocks.

    LZFSE data holds no total to check, and lzfse.decompress knows no limit: a small file could otherwise fill the memory.

    github.com/lzfse/lzfse, src/lzfse_internal.h: each head is a mark and the unpacked length; then what its payload needs.
    """
    total, blocks, at = 0, 0, 0
    while at + 32 <= len(data) or data[at : at + 4] in (b"bvx-", b"bvxn"):
        mark, head = data[at : at + 4], data[at + 4 : at + 32].ljust(28, b"\0")
        length, packed = struct.unpack_from("<2I", head)
        if mark == b"bvx-":
            at += 8 + length
        elif mark == b"bvxn":
            at += 12 + packed
        elif mark == b"bvx2":
            literals, matches, own = struct.unpack_from("<3Q", head, 4)
            at += max(own & 0xFFFFFFFF, 32) + (literals >> 20 & 0xFFFFF) + (matches >> 40 & 0xFFFFF)
        else:
            break
        total, blocks = total + length, blocks + 1
    return total, blocks


def _size(path: Path, about: dict[str, Any], *keys: str) -> tuple[int, int]:
    sides = [about.get(key) for key in keys]
    if not all(isinstance(side, int) and not isinstance(side, bool) and side > 0 for side in sides):
        raise InputError(
            f"{path}: {METADATA}: {', '.join(keys)} are {sides}, expected whole numbers of pixels", code="intrinsics-invalid"
        )
    width, height = int(sides[0] or 0), int(sides[1] or 0)
    if width * height > _MOST_PIXELS:
        raise InputError(
            f"{path}: {METADATA}: {', '.join(keys)}: {width}x{height} is larger than any depth image", code="size-too-large"
        )
    return width, height


def _row(about: dict[str, Any], key: str, stem: str) -> Any:
    """What the metadata has in the list `key` for a frame; None where it has nothing."""
    rows = about.get(key)
    inside = isinstance(rows, list) and stem.isdecimal() and int(stem) < len(rows)
    return rows[int(stem)] if inside and rows is not None else None


def _time(about: dict[str, Any], stem: str) -> float | None:
    """s since the first frame, as the recording says or by its frame rate."""
    time, rate = _row(about, "frameTimestamps", stem), about.get("fps")
    if isinstance(time, int | float):
        return float(time)
    return int(stem) / rate if isinstance(rate, int | float) and rate > 0 and stem.isdecimal() else None


def _pinhole(path: Path, about: dict[str, Any], stem: str, size: tuple[int, int], options: ReadOptions) -> Pinhole:
    """In pixels of the depth: what the metadata says is in pixels of the colour, and is scaled as the author does."""
    if options.camera is not None:
        return options.camera
    width, height = _size(path, about, "w", "h")
    own = _row(about, "perFrameIntrinsicCoeffs", stem)
    where = f"{path}: {METADATA}"
    if own is not None:
        fx, fy, cx, cy = numbers(own, 4, f"{where}: perFrameIntrinsicCoeffs: frame {stem}", "intrinsics-invalid").tolist()
    else:
        fx, fy, cx, cy = pinhole_of(about.get("K"), f"{where}: K", columns=True)
    across, down = size[0] / width, size[1] / height
    return fx * across, fy * down, cx * across, cy * down


def _pose(row: Any, where: str) -> Floats:
    """(4, 4) camera to world of qx, qy, qz, qw, x, y, z."""
    values = numbers(row, 7, where)
    return pose_from(values[:4], values[4:], where) @ _TURN
