"""Read recordings of the iPhone app Record3D: `.r3d` files, which are ZIP archives.

The format as its author describes it: github.com/marek-simonik/record3d, issues 7, 24, 36, 64, 93, 94 and 108.
"""

import stat
import struct
import zipfile
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...errors import InputError, require
from ...guard.guarding import guarded
from ...types import Array, Floats, Frame
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, OF_CAMERA, ReadOptions, without_color
from ..support.color_registration import scaled_to_depth
from ..support.depth_frames import Pinhole, camera_for, check_unit, json_object, numbers, pinhole_of
from ..support.images import read_color
from ..support.listing import natural_key
from .trajectory import pose_from

METADATA, FOLDER = "metadata", "rgbd/"
_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])  # from x right, y up, z backward (OpenGL) to the optical frame
_MAX_METADATA_BYTES, _MAX_IMAGE_BYTES = 1 << 28, 1 << 26  # unpacked: an hour of frames; a photograph
_MAX_PIXELS = 1 << 24  # of a depth image
_MIN_BLOCK_BYTES = 10_000  # decompressed size of an LZFSE block, but for the last one (most have 30 000)
_MAX_OVERHEAD_BYTES = 64  # of LZFSE data longer than its content: headers of blocks


class Record3DCapture:
    """A recording of the iPhone app Record3D (`.r3d`), opened as a capture.

    There is one frame per pair of files `rgbd/<n>.depth` and `rgbd/<n>.jpg`. Depth is in metres. Color and intrinsics are scaled
    to the size of the depth image. Poses are camera to world for the optical frame (x right, y down, z forward), converted from
    the app's camera frame (x right, y up, z backward). The file is a ZIP; its members are read in place, not unpacked to disk.
    """

    what: ClassVar[str] = "a recording of the app Record3D (.r3d)"
    format = "record3d"
    options: ClassVar[frozenset[str]] = OF_CAMERA | {"color=none"}

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        require("lzfse", "record3d")
        self.path = path
        archive = _open(path)
        metadata = json_object(_member(path, archive, METADATA, _MAX_METADATA_BYTES), f"{path}: {METADATA}")
        names = [name.removeprefix(FOLDER) for name in archive.namelist() if name.startswith(FOLDER)]
        stems = sorted({name.rpartition(".")[0] for name in names if name.endswith((".depth", ".jpg"))}, key=natural_key)
        if not stems:
            raise InputError(f"{path}: holds no frames, expected {FOLDER}0.depth and {FOLDER}0.jpg", code="frames-missing")
        size = _size(path, metadata, "dw", "dh") if "dw" in metadata else _size(path, metadata, "w", "h")
        changed = path.stat().st_mtime_ns
        self.frames = []
        for stem in stems:
            pinhole, time = _pinhole(path, metadata, stem, size, options), _time(metadata, stem)
            pose = _row(metadata, "poses", stem)
            load = partial(_load, path, changed, stem, size, pinhole, time, pose, without_color(options))
            self.frames.append(FrameRef(stem, path, load, time))

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a ZIP with the member `metadata` and the folder `rgbd/`, as the app writes it.

        A damaged ZIP with the suffix .r3d counts too, so that opening it reports the damage.
        """
        try:
            with guarded(path), zipfile.ZipFile(path) as opened:
                names = opened.namelist()
        except InputError:
            return path.is_file() and path.suffix.lower() == ".r3d"
        return METADATA in names and any(name.startswith(FOLDER) for name in names)


def _open(path: Path) -> zipfile.ZipFile:
    """Open the ZIP and check all its member names.

    Raises
    ------
    InputError : the file is damaged or no ZIP, or a member's path or link leads out of the archive.
    """
    with guarded(path):
        opened = zipfile.ZipFile(path)
    for member in opened.infolist():
        name = member.orig_filename.replace("\\", "/")
        if name.startswith("/") or ":" in name or ".." in name.split("/") or stat.S_ISLNK(member.external_attr >> 16):
            opened.close()
            sentence = f"{path}: holds {member.orig_filename!r}, a path or a link out of the archive: it is not safe to read"
            raise InputError(sentence, code="archive-unsafe")
    return opened


@lru_cache(maxsize=1)
def _opened(path: Path, changed: int) -> zipfile.ZipFile:
    """Return the open archive that all frames of a recording share; `changed` is the file's modification time."""
    return _open(path)


def _member(path: Path, opened: zipfile.ZipFile, name: str, max_bytes: int) -> bytes:
    """Read the member `name` of the ZIP; at most `max_bytes` are unpacked."""
    if name not in opened.namelist():
        raise InputError(f"{path}: {name} is missing", code="file-missing")
    with guarded(f"{path}: {name}"), opened.open(name) as file:
        data = file.read(max_bytes + 1)
    if len(data) > max_bytes:
        sentence = f"{path}: {name} unpacks to more than {max_bytes} bytes, too large for a recording"
        raise InputError(sentence, code="size-too-large")
    return data


def _load(
    path: Path, changed: int, stem: str, size: tuple[int, int], pinhole: Pinhole, time: float | None, pose: Any, is_bare: bool
) -> FrameData:
    opened = _opened(path, changed)
    depth = _depth(path, opened, stem, size)
    check_unit(depth, path, 1.0)
    color = None if is_bare else _color(path, opened, stem, size)
    frame = Frame(color, depth, camera_for(pinhole, depth.shape), stem, time)
    return FrameData(frame, pose=None if pose is None else _pose(pose, f"{path}: {METADATA}: poses: frame {stem}"))


def _color(path: Path, opened: zipfile.ZipFile, stem: str, size: tuple[int, int]) -> Array:
    """Read the color of a frame, (H, W, 3) uint8 RGB, scaled to the size (W, H) of the depth."""
    data = _member(path, opened, f"{FOLDER}{stem}.jpg", _MAX_IMAGE_BYTES)
    return scaled_to_depth(read_color(path / FOLDER / f"{stem}.jpg", data=data), size[::-1], f"{path}: {FOLDER}{stem}")


def _depth(path: Path, opened: zipfile.ZipFile, stem: str, size: tuple[int, int]) -> Array:
    """Read the depth of a frame, (H, W) float32 m; `size` is (W, H)."""
    where, length = f"{path}: {FOLDER}{stem}.depth", 4 * size[0] * size[1]
    data = _member(path, opened, f"{FOLDER}{stem}.depth", length + _MAX_OVERHEAD_BYTES)
    declared, blocks = _declared_size(data)
    # a block with a false header can decompress to 24 MB, so no more blocks than this image needs are accepted
    if declared > length or blocks > length // _MIN_BLOCK_BYTES + 2:
        raise InputError(f"{where}: decompresses to more than an image of {size[0]}x{size[1]}", code="size-too-large")
    lzfse = require("lzfse", "record3d")
    try:
        raw = lzfse.decompress(data)
    except lzfse.error:
        raise InputError(f"{where}: is cut off or damaged", code="file-damaged") from None
    if len(raw) != length:
        sentence = f"{where}: has {len(raw)} bytes, expected {length} for {size[0]}x{size[1]} float32 metres"
        raise InputError(sentence, code="depth-shape")
    return np.frombuffer(raw, "<f4").reshape(size[1], size[0])


def _declared_size(data: bytes) -> tuple[int, int]:
    """Return the decompressed size, bytes, and the number of blocks of LZFSE data, from the headers of its blocks.

    LZFSE data has no total size, and lzfse.decompress no limit: without this check a small file could fill the memory.

    Source: github.com/lzfse/lzfse, src/lzfse_internal.h. Each header has a magic number and the decompressed size, then fields
    about its payload.
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


def _size(path: Path, metadata: dict[str, Any], *keys: str) -> tuple[int, int]:
    """Return (width, height) px from two keys of the metadata."""
    where, sides = f"{path}: {METADATA}: {', '.join(keys)}", [metadata.get(key) for key in keys]
    if not all(isinstance(side, int) and not isinstance(side, bool) and side > 0 for side in sides):
        raise InputError(f"{where} are {sides}, expected whole numbers of pixels", code="intrinsics-invalid")
    width, height = int(sides[0] or 0), int(sides[1] or 0)
    if width * height > _MAX_PIXELS:
        raise InputError(f"{where}: {width}x{height} is larger than any depth image", code="size-too-large")
    return width, height


def _row(metadata: dict[str, Any], key: str, stem: str) -> Any:
    """Return the frame's element of the list `key` in the metadata; None if there is none."""
    rows = metadata.get(key)
    return rows[int(stem)] if isinstance(rows, list) and stem.isdecimal() and int(stem) < len(rows) else None


def _time(metadata: dict[str, Any], stem: str) -> float | None:
    """Return the time since the first frame in s, from the timestamps or the frame rate; None if both are missing."""
    time, rate = _row(metadata, "frameTimestamps", stem), metadata.get("fps")
    if isinstance(time, int | float):
        return float(time)
    return int(stem) / rate if isinstance(rate, int | float) and rate > 0 and stem.isdecimal() else None


def _pinhole(path: Path, metadata: dict[str, Any], stem: str, size: tuple[int, int], options: ReadOptions) -> Pinhole:
    """Return fx, fy, cx, cy in pixels of the depth, scaled from the metadata's, which are in pixels of the color."""
    if options.camera is not None:
        return options.camera
    width, height = _size(path, metadata, "w", "h")
    per_frame, where = _row(metadata, "perFrameIntrinsicCoeffs", stem), f"{path}: {METADATA}"
    if per_frame is None:
        given = pinhole_of(metadata.get("K"), f"{where}: K")
    else:
        given = numbers(per_frame, 4, f"{where}: perFrameIntrinsicCoeffs: frame {stem}", "intrinsics-invalid").tolist()
    scale_x, scale_y = size[0] / width, size[1] / height
    return given[0] * scale_x, given[1] * scale_y, given[2] * scale_x, given[3] * scale_y


def _pose(row: Any, where: str) -> Floats:
    """Return the pose (4, 4) camera to world of a row qx, qy, qz, qw, x, y, z."""
    values = numbers(row, 7, where)
    return pose_from(values[:4], values[4:], where) @ _FROM_OPENGL
