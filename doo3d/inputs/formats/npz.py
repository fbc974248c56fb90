"""Frames as arrays in an NPZ file, as `numpy.savez` writes it: depth, K, and where there, color, mask, pose, timestamps."""

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
from ..support.depth_frames import Pinhole, camera_for, check_pose, check_unit, pinhole_of
from .open3d_folder import DEFAULT_DEPTH_SCALE

_STACKS = {"depth": 2, "color": 3, "mask": 2}  # dimensions of one frame's part; these are read frame by frame
_SMALL = {"K": 2, "depth_scale": 0, "pose": 2, "timestamps": 0}
_MOST = 1 << 28  # bytes of one frame's part, and of all parts of a small array
_DENSEST = 1100  # bytes that a byte of a ZIP unpacks to at most (deflate: 1032)
_BROKEN = (zipfile.BadZipFile, zlib.error, ValueError, EOFError, OSError, RuntimeError, NotImplementedError)


class ArraysCapture:
    """The frames of an NPZ file; of each only its own part of the arrays is in memory.

    depth : (H, W) or (N, H, W); whole numbers in `depth_scale` units per metre (1000 where it is not there), or floats in
    metres. K : (3, 3) or (N, 3, 3). color : (H, W, 3) or (N, H, W, 3) uint8 RGB. mask : (H, W) or (N, H, W).
    pose : (4, 4) or (N, 4, 4), camera to world, m. timestamps : one or (N,), s.
    """

    what: ClassVar[str] = "an NPZ of arrays (depth, K, with color, depth_scale, mask, pose, timestamps)"
    format = "arrays"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        changed = path.stat().st_mtime_ns
        heads = {name: _head(path, name) for name in _names(path) if name in _STACKS or name in _SMALL}
        count = _count(path, heads)
        small = {name: _per_frame(path, name, heads[name], count) for name in _SMALL if name in heads}
        if "K" not in small and options.camera is None:
            raise InputError(
                f"{path}: has no K, the (3, 3) camera matrix: add it, or say --input-option 'camera=[fx, fy, cx, cy]'",
                code="intrinsics-missing",
            )
        times = _times(path, small.get("timestamps"))
        parts = tuple(name for name in _STACKS if name in heads)
        digits = max(len(str(count - 1)), 6)
        self.frames = [
            FrameRef(
                name := f"{i:0{digits}d}" if heads["depth"].stacked else path.stem,
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
        """Whether `path` is an NPZ file with an array called depth."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            if file.read(4) != b"PK\x03\x04":
                return False
        try:
            return "depth" in _names(path)
        except InputError:
            return False


@dataclass(frozen=True)
class _Head:
    """shape, dtype : of an array, from its first bytes. least : dimensions of one frame's part. order : C for row by row, F."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    least: int
    order: Literal["C", "F"]

    @property
    def stacked(self) -> bool:
        """Whether there is a part for each frame, and not one for all."""
        return len(self.shape) == self.least + 1

    @property
    def part(self) -> tuple[int, ...]:
        """The shape of one frame's part."""
        return self.shape[1:] if self.stacked else self.shape

    @property
    def length(self) -> int:
        """Bytes of one frame's part."""
        return math.prod(self.part) * self.dtype.itemsize


def _names(path: Path) -> list[str]:
    try:
        with zipfile.ZipFile(path) as opened:
            return [name.removesuffix(".npy") for name in opened.namelist()]
    except _BROKEN as error:
        raise InputError(f"{path}: is cut off or not an NPZ of plain arrays ({error})", code="file-damaged") from None


def _read_head(file: IO[bytes], where: str, name: str) -> _Head:
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(file)
    if dtype.hasobject:
        raise InputError(
            f"{where}: holds Python objects, expected numbers: give one array, all frames of one size", code="array-type"
        )
    head = _Head(tuple(shape), dtype, (_STACKS | _SMALL)[name], "F" if fortran else "C")
    if fortran and head.stacked and name in _STACKS:
        raise InputError(f"{where}: is stored column by column: save np.ascontiguousarray of it", code="array-order")
    return head


def _head(path: Path, name: str) -> _Head:
    """The shape and type of an array.

    Raises
    ------
    InputError : it is damaged, or not one of numbers; or has neither a frame's dimensions nor one more.
    """
    where = f"{path}: {name}"
    try:
        with zipfile.ZipFile(path) as opened, opened.open(f"{name}.npy") as file:
            head = _read_head(file, where, name)
    except _BROKEN as error:
        raise InputError(f"{where}: is cut off or damaged ({error})", code="file-damaged") from None
    least = head.least
    if len(head.shape) not in (least, least + 1) or 0 in head.shape:
        raise InputError(
            f"{where}: has shape {head.shape}, expected {least} dimensions for one frame, {least + 1} for several",
            code="array-shape",
        )
    whole = head.length * (head.shape[0] if head.stacked else 1)
    if (head.length if name in _STACKS else whole) > _MOST or whole > _DENSEST * path.stat().st_size:
        raise InputError(f"{where}: has shape {head.shape}, which is too large for this file, or for any", code="array-too-large")
    return head


def _count(path: Path, heads: dict[str, _Head]) -> int:
    """How many frames there are; every array has one part per frame, or is one for all."""
    depth = heads["depth"]
    count = depth.shape[0] if depth.stacked else 1
    for name, head in heads.items():
        if head.stacked and head.shape[0] != count:
            raise InputError(
                f"{path}: {name} has {head.shape[0]} parts, but there are {count} frames of depth", code="frame-count"
            )
    if "color" in heads and depth.stacked and not heads["color"].stacked:
        raise InputError(
            f"{path}: color has shape {heads['color'].shape}, expected one image for each of the {count} frames",
            code="frame-count",
        )
    return count


def _per_frame(path: Path, name: str, head: _Head, count: int) -> Array:
    """(count, ...) float, one for each frame."""
    if not np.issubdtype(head.dtype, np.number) or np.issubdtype(head.dtype, np.complexfloating):
        raise InputError(f"{path}: {name} has type {head.dtype}, expected numbers", code="array-type")
    length = math.prod(head.shape) * head.dtype.itemsize
    values = _Stack(path, name).bytes_at(0, length).view(head.dtype).reshape(head.shape, order=head.order).astype(float)
    return values if head.stacked else np.broadcast_to(values, (count, *head.shape))


def _times(path: Path, times: Array | None) -> list[float] | None:
    if times is None:
        return None
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise InputError(f"{path}: timestamps must rise from frame to frame, finite numbers in seconds", code="times-not-rising")
    found: list[float] = times.tolist()
    return found


class _Stack:
    """An array in the file that is read part by part, without going back as long as the parts are asked for in order.

    np.load unpacks an array as a whole: 3.7 GB for the depth of 1000 frames of 1280x720 float32 that are asked for one by one.
    """

    def __init__(self, path: Path, name: str) -> None:
        self._path, self._name, self._head = path, name, _head(path, name)
        self._archive: zipfile.ZipFile | None = None
        self._file: IO[bytes] | None = None
        self._at = 0
        self._lock = Lock()

    def part(self, index: int) -> Array:
        """That of the frame; the one for all where there is but one."""
        head = self._head
        data = self.bytes_at(index * head.length if head.stacked else 0, head.length)
        return data.view(head.dtype).reshape(head.part, order=head.order)

    def bytes_at(self, start: int, length: int) -> Array:
        """(length,) uint8 from `start` on, counted behind the head."""
        with self._lock:
            try:
                if self._file is None or start < self._at:
                    self._open()
                assert self._file is not None
                while self._at < start:
                    self._at += len(self._read(min(start - self._at, 1 << 20)))
                data = self._read(length)
            except _BROKEN as error:
                self.close()
                raise InputError(f"{self._path}: {self._name} is cut off or damaged ({error})", code="file-damaged") from None
            self._at += length
        return np.frombuffer(data, np.uint8)

    def _open(self) -> None:
        self.close()
        self._archive = zipfile.ZipFile(self._path)
        self._file = self._archive.open(f"{self._name}.npy")
        _read_head(self._file, f"{self._path}: {self._name}", self._name)
        self._at = 0

    def _read(self, length: int) -> bytes:
        assert self._file is not None
        data = self._file.read(length)
        if len(data) < length:
            raise EOFError("it ends too early")
        return data

    def close(self) -> None:
        """Let go of the file."""
        for opened in (self._file, self._archive):
            if opened is not None:
                opened.close()
        self._file = self._archive = None


@lru_cache(maxsize=len(_STACKS))
def _stack(path: Path, changed: int, name: str) -> _Stack:
    """One reader for all entries of a file, also where they come from another process; `changed` tells a changed file."""
    return _Stack(path, name)


def _load(
    path: Path,
    changed: int,
    index: int,
    name: str,
    parts: tuple[str, ...],
    lens: Pinhole | Floats,
    scale: float | None,
    pose: Floats | None,
    time: float | None,
) -> FrameData:
    where = f"{path}: frame {index}"
    found = {part: _stack(path, changed, part).part(index) for part in parts}
    depth = _metres(found["depth"], scale, where)
    check_unit(depth, path, scale or 1.0)
    pinhole = pinhole_of(lens, f"{where}: K") if isinstance(lens, np.ndarray) else lens
    try:
        frame = Frame(found.get("color"), depth, camera_for(pinhole, depth.shape), name, time)
        mask = check_mask(found["mask"], depth.shape) if "mask" in found else None
    except InputError as error:
        raise InputError(f"{where}: {error}", code=error.code) from None
    return FrameData(frame, mask, None if pose is None else check_pose(pose, f"{where}: pose"))


def _metres(depth: Array, scale: float | None, where: str) -> Array:
    if scale is not None and not 0 < scale < float("inf"):
        raise InputError(
            f"{where}: depth_scale is {scale}, expected units per metre above zero (1000 for millimetres)",
            code="depth-scale-invalid",
        )
    if np.issubdtype(depth.dtype, np.integer):
        return np.asarray(depth / np.float32(scale or DEFAULT_DEPTH_SCALE), dtype=np.float32)
    if not np.issubdtype(depth.dtype, np.floating):
        raise InputError(f"{where}: depth has type {depth.dtype}, expected whole numbers or floats", code="depth-type")
    return np.asarray(depth / (scale or 1.0), dtype=np.float32)
