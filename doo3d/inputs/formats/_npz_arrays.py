"""Arrays in an NPZ file: their names and headers, and their data read part by part."""

from __future__ import annotations

import math
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import IO, Any, Literal

import numpy as np

from ...errors import InputError
from ...guard.limits import check_pixels
from ...types import Array

STACKS = {"depth": 2, "color": 3, "mask": 2}  # arrays read frame by frame; dimensions of one frame's part
SMALL = {"K": 2, "depth_scale": 0, "pose": 2, "timestamps": 0}  # arrays read as a whole; dimensions of one frame's part
_ALIASES = {  # other names of the arrays, in lower case, tried in this order
    "depth": ("depths", "depth_image", "depth_images", "depth_map"),
    "color": ("rgb", "image", "images", "colors", "color_image"),
    "mask": ("masks", "segmentation"),
    "K": ("k", "intrinsics", "intrinsic", "intrinsic_matrix", "camera_matrix", "cam_k", "camera_intrinsics"),
    "pose": ("poses", "camera_pose", "camera_poses"),
    "timestamps": ("timestamp",),
}
_MAX_PART_BYTES = 1 << 28  # of one frame's part of a stack, and of a small array as a whole
_MAX_FRAMES = 1_000_000  # nine hours at 30 Hz
_MAX_ZIP_RATIO = 1100  # bytes that a byte of a ZIP unpacks to at most (deflate: 1032)
_DAMAGE_ERRORS = (zipfile.BadZipFile, zlib.error, ValueError, EOFError, OSError, RuntimeError, NotImplementedError)


@dataclass(frozen=True)
class ArrayHeader:
    """The header of an array in the file.

    stored : name in the file. shape, dtype : of the array. part_ndim : dimensions of one frame's part. order : C for row by
    row, F for column by column.
    """

    stored: str
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


def array_names(path: Path) -> list[str]:
    """Return the names of the arrays in an NPZ file; raise InputError if it is damaged."""
    try:
        with zipfile.ZipFile(path) as opened:
            return [name.removesuffix(".npy") for name in opened.namelist()]
    except _DAMAGE_ERRORS as error:
        raise InputError(f"{path}: is cut off or not an NPZ of plain arrays ({error})", code="file-damaged") from None


def find_arrays(path: Path) -> dict[str, ArrayHeader]:
    """Return the headers of the arrays that make up frames, under the names of `STACKS` and `SMALL`.

    An array of another usual name counts only if it has the shape and type of its kind.

    Raises
    ------
    InputError : the file, or an array of one of the names themselves, is damaged or has another shape or type.
    """
    names = array_names(path)
    lower = {name.lower(): name for name in reversed(names)}
    found = {}
    for name in (*STACKS, *SMALL):
        if name in names:
            found[name] = array_header(path, name, name)
            continue
        for alias in _ALIASES.get(name, ()):
            if alias in lower and (header := _header_or_none(path, name, lower[alias])) is not None:
                found[name] = header
                break
    return found


def has_depth(path: Path) -> bool:
    """Return whether an NPZ file has an array of depth; raise InputError if it is damaged."""
    names = {name.lower() for name in array_names(path)}
    return "depth" in names or any(alias in names for alias in _ALIASES["depth"])


def _header_or_none(path: Path, name: str, stored: str) -> ArrayHeader | None:
    try:
        header = array_header(path, name, stored)
    except InputError:
        return None
    is_color = header.dtype == np.uint8 and header.shape[-1] == 3
    return header if name != "color" or is_color else None


def _read_header(file: IO[bytes], where: str, name: str, stored: str) -> ArrayHeader:
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(file)
    if dtype.hasobject:
        raise InputError(
            f"{where}: holds Python objects, expected numbers: give one array, all frames of one size", code="array-type"
        )
    ndim = (STACKS | SMALL)[name]
    if name == "K" and shape and shape[-1] == 4 and tuple(shape) != (4, 4):
        ndim -= 1  # fx, fy, cx, cy
    header = ArrayHeader(stored, tuple(shape), dtype, ndim, "F" if fortran else "C")
    if fortran and header.stacked and name in STACKS:
        raise InputError(f"{where}: is stored column by column: save np.ascontiguousarray of it", code="array-order")
    return header


def array_header(path: Path, name: str, stored: str) -> ArrayHeader:
    """Read the header of the array called `stored` in the file and `name` here.

    Raises
    ------
    InputError : the array is damaged or not of numbers, or has neither the dimensions of one frame nor one more.
    """
    where = f"{path}: {stored}"
    try:
        with zipfile.ZipFile(path) as opened, opened.open(f"{stored}.npy") as file:
            header = _read_header(file, where, name, stored)
    except _DAMAGE_ERRORS as error:
        raise InputError(f"{where}: is cut off or damaged ({error})", code="file-damaged") from None
    ndim = header.part_ndim
    if len(header.shape) not in (ndim, ndim + 1) or 0 in header.shape:
        raise InputError(
            f"{where}: has shape {header.shape}, expected {ndim} dimensions for one frame, {ndim + 1} for several",
            code="array-shape",
        )
    total = header.part_bytes * (header.shape[0] if header.stacked else 1)
    if (header.part_bytes if name in STACKS else total) > _MAX_PART_BYTES or total > _MAX_ZIP_RATIO * path.stat().st_size:
        raise InputError(f"{where}: has shape {header.shape}, too large for this file or for any frame", code="array-too-large")
    if header.stacked and header.shape[0] > _MAX_FRAMES:
        raise InputError(f"{where}: has shape {header.shape}, more frames than a recording has", code="array-too-large")
    if name in STACKS:
        check_pixels(header.part[1], header.part[0], where)
    return header


class ArrayStack:
    """An array in the file, read part by part; parts requested in order are read without decompressing anew.

    np.load unpacks an array as a whole: 3.7 GB for the depth of 1000 frames of 1280x720 float32, even for a single frame.
    """

    def __init__(self, path: Path, name: str, stored: str) -> None:
        self._path, self._name, self._stored, self._header = path, name, stored, array_header(path, name, stored)
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
                raise InputError(f"{self._path}: {self._stored} is cut off or damaged ({error})", code="file-damaged") from None
            self._at += length
        return np.frombuffer(data, np.uint8)

    def _open(self) -> None:
        self.close()
        self._archive = zipfile.ZipFile(self._path)
        self._file = self._archive.open(f"{self._stored}.npy")
        _read_header(self._file, f"{self._path}: {self._stored}", self._name, self._stored)
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
