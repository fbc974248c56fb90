"""Frames as arrays in an NPZ file written by `numpy.savez`: depth, K, and optionally color, mask, pose, timestamps."""

from __future__ import annotations

import math
import zipfile
import zlib
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from threading import Lock
from typing import IO, Any, ClassVar, Literal

import numpy as np

from ...errors import InputError
from ...types import Array, Floats, Frame, check_mask
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.depth_frames import Pinhole, camera_for, check_depth_scale, check_pose, check_unit, pinhole_of
from .open3d_folder import DEFAULT_DEPTH_SCALE

_STACKS = {"depth": 2, "color": 3, "mask": 2}  # arrays read frame by frame; dimensions of one frame's part
_SMALL = {"K": 2, "depth_scale": 0, "pose": 2, "timestamps": 0}  # arrays read as a whole; dimensions of one frame's part
_MAX_PART_BYTES = 1 << 28  # of one frame's part of a stack, and of a small array as a whole
_MAX_ZIP_RATIO = 1100  # bytes that a byte of a ZIP unpacks to at most (deflate: 1032)
_DAMAGE_ERRORS = (zipfile.BadZipFile, zlib.error, ValueError, EOFError, OSError, RuntimeError, NotImplementedError)


class ArraysCapture:
    """An NPZ file of arrays, opened as a capture of N frames (1 if `depth` is a single image).

    An array without the leading dimension N applies to all frames; only `color` must have it if `depth` has it. Loading a frame
    reads only that frame's part of `depth`, `color` and `mask`.

    Notes
    -----
    Arrays in the file; `depth` is required, and `K` unless the options give the camera:

    - depth : (H, W) or (N, H, W); whole numbers in `depth_scale` units per metre (1000 if absent), or floats
      in metres (divided by `depth_scale` if that is given).
    - K : (3, 3) or (N, 3, 3), [fx, 0, cx; 0, fy, cy; 0, 0, 1], px.
    - color : (H, W, 3) or (N, H, W, 3) uint8 RGB.
    - mask : (H, W) or (N, H, W), true or above zero on the object.
    - pose : (4, 4) or (N, 4, 4), camera to world, x_world = pose @ x_camera, m.
    - timestamps : one or (N,), s, increasing.
    - depth_scale : one or (N,), units per metre.
    """

    what: ClassVar[str] = "an NPZ of arrays (depth, K, with color, depth_scale, mask, pose, timestamps)"
    format = "arrays"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        changed = path.stat().st_mtime_ns
        headers = {name: _array_header(path, name) for name in _array_names(path) if name in _STACKS or name in _SMALL}
        count = _frame_count(path, headers)
        small = {name: _per_frame(path, name, headers[name], count) for name in _SMALL if name in headers}
        if "K" not in small and options.camera is None:
            raise InputError(
                f"{path}: has no K, the (3, 3) camera matrix: add it, or give --input-option 'camera=[fx, fy, cx, cy]'",
                code="intrinsics-missing",
            )
        times = _times(path, small.get("timestamps"))
        parts = tuple(name for name in _STACKS if name in headers)
        digits = max(len(str(count - 1)), 6)
        self.frames = [
            FrameRef(
                name := f"{i:0{digits}d}" if headers["depth"].stacked else path.stem,
                path,
                partial(
                    _load,
                    path,
                    changed,
                    i,
                    name,
                    parts,
                    options.camera or small["K"][i],
                    options.depth_scale or (small["depth_scale"][i].item() if "depth_scale" in small else None),
                    small["pose"][i] if "pose" in small else None,
                    times[i] if times else None,
                ),
                times[i] if times else None,
            )
            for i in range(count)
        ]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is an NPZ file with an array called `depth`."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            if file.read(4) != b"PK\x03\x04":
                return False
        try:
            return "depth" in _array_names(path)
        except InputError:
            return False


@dataclass(frozen=True)
class _ArrayHeader:
    """The header of an array in the file.

    shape, dtype : of the array. part_ndim : dimensions of one frame's part. order : C for row by row, F for column by column.
    """

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    part_ndim: int
    order: Literal["C", "F"]

    @property
    def stacked(self) -> bool:
        """Whether the array has one part per frame along its first axis; false if one part applies to all frames."""
        return len(self.shape) == self.part_ndim + 1

    @property
    def part(self) -> tuple[int, ...]:
        """The shape of one frame's part of the array: without the frame axis, if it has one."""
        return self.shape[1:] if self.stacked else self.shape

    @property
    def part_bytes(self) -> int:
        """Number of bytes of one frame's part of the array."""
        return math.prod(self.part) * self.dtype.itemsize


def _array_names(path: Path) -> list[str]:
    try:
        with zipfile.ZipFile(path) as opened:
            return [name.removesuffix(".npy") for name in opened.namelist()]
    except _DAMAGE_ERRORS as error:
        raise InputError(f"{path}: is cut off or not an NPZ of plain arrays ({error})", code="file-damaged") from None


def _read_header(file: IO[bytes], where: str, name: str) -> _ArrayHeader:
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(file)
    if dtype.hasobject:
        raise InputError(
            f"{where}: holds Python objects, expected numbers: give one array, all frames of one size", code="array-type"
        )
    header = _ArrayHeader(tuple(shape), dtype, (_STACKS | _SMALL)[name], "F" if fortran else "C")
    if fortran and header.stacked and name in _STACKS:
        raise InputError(f"{where}: is stored column by column: save np.ascontiguousarray of it", code="array-order")
    return header


def _array_header(path: Path, name: str) -> _ArrayHeader:
    """Read the header of an array.

    Raises
    ------
    InputError : the array is damaged or not of numbers, or has neither the dimensions of one frame nor one more.
    """
    where = f"{path}: {name}"
    try:
        with zipfile.ZipFile(path) as opened, opened.open(f"{name}.npy") as file:
            header = _read_header(file, where, name)
    except _DAMAGE_ERRORS as error:
        raise InputError(f"{where}: is cut off or damaged ({error})", code="file-damaged") from None
    ndim = header.part_ndim
    if len(header.shape) not in (ndim, ndim + 1) or 0 in header.shape:
        raise InputError(
            f"{where}: has shape {header.shape}, expected {ndim} dimensions for one frame, {ndim + 1} for several",
            code="array-shape",
        )
    total = header.part_bytes * (header.shape[0] if header.stacked else 1)
    if (header.part_bytes if name in _STACKS else total) > _MAX_PART_BYTES or total > _MAX_ZIP_RATIO * path.stat().st_size:
        raise InputError(f"{where}: has shape {header.shape}, too large for this file or for any frame", code="array-too-large")
    return header


def _frame_count(path: Path, headers: dict[str, _ArrayHeader]) -> int:
    """Return the number of frames; raise InputError if an array has neither one part per frame nor one for all."""
    depth = headers["depth"]
    count = depth.shape[0] if depth.stacked else 1
    for name, header in headers.items():
        if header.stacked and header.shape[0] != count:
            raise InputError(
                f"{path}: {name} has {header.shape[0]} parts, but there are {count} frames of depth", code="frame-count"
            )
    if "color" in headers and depth.stacked and not headers["color"].stacked:
        raise InputError(
            f"{path}: color has shape {headers['color'].shape}, expected one image for each of the {count} frames",
            code="frame-count",
        )
    return count


def _per_frame(path: Path, name: str, header: _ArrayHeader, count: int) -> Array:
    """Read a small array as (count, ...) float, one part for each frame."""
    if not np.issubdtype(header.dtype, np.number) or np.issubdtype(header.dtype, np.complexfloating):
        raise InputError(f"{path}: {name} has type {header.dtype}, expected numbers", code="array-type")
    length = math.prod(header.shape) * header.dtype.itemsize
    values = _Stack(path, name).bytes_at(0, length).view(header.dtype).reshape(header.shape, order=header.order).astype(float)
    return values if header.stacked else np.broadcast_to(values, (count, *header.shape))


def _times(path: Path, times: Array | None) -> list[float] | None:
    if times is None:
        return None
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise InputError(
            f"{path}: timestamps must increase from frame to frame and be finite, in seconds", code="times-not-rising"
        )
    seconds: list[float] = times.tolist()
    return seconds


class _Stack:
    """An array in the file, read part by part; parts requested in order are read without decompressing anew.

    np.load unpacks an array as a whole: 3.7 GB for the depth of 1000 frames of 1280x720 float32, even for a single frame.
    """

    def __init__(self, path: Path, name: str) -> None:
        self._path, self._name, self._header = path, name, _array_header(path, name)
        self._archive: zipfile.ZipFile | None = None
        self._file: IO[bytes] | None = None
        self._at = 0
        self._lock = Lock()

    def part(self, index: int) -> Array:
        """Return the part of the array for frame number `index` (from 0), or the part that all frames share.

        Raises
        ------
        InputError : the file is cut off or damaged.
        """
        header = self._header
        data = self.bytes_at(index * header.part_bytes if header.stacked else 0, header.part_bytes)
        return data.view(header.dtype).reshape(header.part, order=header.order)

    def bytes_at(self, start: int, length: int) -> Array:
        """Return `length` bytes of the array's data from byte offset `start` on, as (length,) uint8.

        Raises
        ------
        InputError : the file is cut off or damaged.
        """
        with self._lock:
            try:
                if self._file is None or start < self._at:
                    self._open()
                assert self._file is not None
                while self._at < start:
                    self._at += len(self._read(min(start - self._at, 1 << 20)))
                data = self._read(length)
            except _DAMAGE_ERRORS as error:
                self.close()
                raise InputError(f"{self._path}: {self._name} is cut off or damaged ({error})", code="file-damaged") from None
            self._at += length
        return np.frombuffer(data, np.uint8)

    def _open(self) -> None:
        self.close()
        self._archive = zipfile.ZipFile(self._path)
        self._file = self._archive.open(f"{self._name}.npy")
        _read_header(self._file, f"{self._path}: {self._name}", self._name)
        self._at = 0

    def _read(self, length: int) -> bytes:
        assert self._file is not None
        data = self._file.read(length)
        if len(data) < length:
            raise EOFError("it ends too early")
        return data

    def close(self) -> None:
        """Close the file."""
        for opened in (self._file, self._archive):
            if opened is not None:
                opened.close()
        self._file = self._archive = None


@lru_cache(maxsize=len(_STACKS))
def _stack(path: Path, changed: int, name: str) -> _Stack:
    """Return one reader for all frames of a file, also of frames unpickled here; `changed`, its time, tells a new version."""
    return _Stack(path, name)


def _load(
    path: Path,
    changed: int,
    index: int,
    name: str,
    parts: tuple[str, ...],
    intrinsics: Pinhole | Floats,
    scale: float | None,
    pose: Floats | None,
    time: float | None,
) -> FrameData:
    where = f"{path}: frame {index}"
    arrays = {part: _stack(path, changed, part).part(index) for part in parts}
    depth = _metres(arrays["depth"], scale, where)
    check_unit(depth, path, scale or 1.0)
    pinhole = pinhole_of(intrinsics, f"{where}: K") if isinstance(intrinsics, np.ndarray) else intrinsics
    try:
        frame = Frame(arrays.get("color"), depth, camera_for(pinhole, depth.shape), name, time)
        mask = check_mask(arrays["mask"], depth.shape) if "mask" in arrays else None
    except InputError as error:
        raise InputError(f"{where}: {error}", code=error.code) from None
    return FrameData(frame, mask, None if pose is None else check_pose(pose, f"{where}: pose"))


def _metres(depth: Array, scale: float | None, where: str) -> Array:
    """Return depth as float32 metres; `scale` is the units per metre, None for the default of its type."""
    if scale is not None:
        check_depth_scale(scale, where, "units per metre above zero (1000 for millimetres)")
    if np.issubdtype(depth.dtype, np.integer):
        return np.asarray(depth / np.float32(scale or DEFAULT_DEPTH_SCALE), dtype=np.float32)
    if not np.issubdtype(depth.dtype, np.floating):
        raise InputError(f"{where}: depth has type {depth.dtype}, expected whole numbers or floats", code="depth-type")
    return np.asarray(depth / (scale or 1.0), dtype=np.float32)
