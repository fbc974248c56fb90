"""Read the arrays in an NPZ file: names, headers, and data part by part."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from threading import Lock
from typing import IO

import numpy as np

from ...errors import InputError
from ...guard.guarding import guarded
from ...guard.limits import check_pixels
from ...types import Array
from ..support.arrays import read_header

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
_FREE_FRAMES, _MIN_FRAME_BYTES = 1000, 8  # that any file may have, and its bytes for each further one: 90x90 px of one value
MAX_ZIP_RATIO = 1100  # bytes that a byte of a ZIP unpacks to at most (deflate: 1032)


def array_names(path: Path) -> list[str]:
    """Return the names of the arrays in an NPZ file; raise InputError if it is damaged."""
    with guarded(path), zipfile.ZipFile(path) as opened:
        return [name.removesuffix(".npy") for name in opened.namelist()]


def has_depth(path: Path) -> bool:
    """Return whether an NPZ file has an array of depth; raise InputError if it is damaged."""
    return not {"depth", *_ALIASES["depth"]}.isdisjoint(name.lower() for name in array_names(path))


def find_arrays(path: Path) -> dict[str, ArrayStack]:
    """Return the arrays of the frames, by the names in `STACKS` and `SMALL`.

    An array with an alternative name is accepted only if it has the shape and type of its kind.

    Raises
    ------
    InputError : the file, or an array of one of the names themselves, is damaged or has another shape or type.
    """
    names = array_names(path)
    lower = {name.lower(): name for name in reversed(names)}
    found = {}
    for name in (*STACKS, *SMALL):
        if name in names:
            found[name] = ArrayStack(path, name, name)
            continue
        for alias in _ALIASES.get(name, ()):
            try:
                array = ArrayStack(path, name, lower[alias])
            except (KeyError, InputError):
                continue
            if name != "color" or (array.dtype == np.uint8 and array.shape[-1] == 3):
                found[name] = array
                break
    return found


class ArrayStack:
    """An array in the file, read part by part; parts requested in order are decompressed only once.

    np.load would unpack the whole array: 3.7 GB for the depth of 1000 frames of 1280x720 float32, even for a single frame.

    Attributes
    ----------
    stored
        name in the file; `name` is the name in doo3d.
    shape, dtype
        shape and type of the array.
    stacked
        whether the array has one part per frame along its first axis; false if one part applies to all frames.
    part_shape, part_bytes
        shape and number of bytes of one frame's part: without the frame axis, if the array has one.

    Raises
    ------
    InputError : the array is damaged or not of numbers, or has neither the dimensions of one frame nor one more.
    """

    def __init__(self, path: Path, name: str, stored: str) -> None:
        self._path, self._name, self.stored, self._where = path, name, stored, f"{path}: {stored}"
        self._lock = Lock()
        self._file: IO[bytes] | None = None
        with guarded(self._where):
            self._opened().close()
        ndim = (STACKS | SMALL)[name]
        if name == "K" and self.shape[-1:] == (4,) and self.shape != (4, 4):
            ndim -= 1  # fx, fy, cx, cy
        self.stacked = len(self.shape) == ndim + 1
        self.part_shape = self.shape[1:] if self.stacked else self.shape
        self.part_bytes = math.prod(self.part_shape) * self.dtype.itemsize
        self._check(ndim)

    def _check(self, ndim: int) -> None:
        where, shape, is_stack = self._where, self.shape, self._name in STACKS
        if self.dtype.hasobject:
            sentence = f"{where}: holds Python objects, expected numbers: give one array, all frames of one size"
            raise InputError(sentence, code="array-type")
        if self._order == "F" and self.stacked and is_stack:
            raise InputError(f"{where}: is stored column by column: save np.ascontiguousarray of it", code="array-order")
        if len(shape) not in (ndim, ndim + 1) or 0 in shape:
            sentence = f"{where}: has shape {shape}, expected {ndim} dimensions for one frame, {ndim + 1} for several"
            raise InputError(sentence, code="array-shape")
        total, frames = math.prod(shape) * self.dtype.itemsize, shape[0] if self.stacked else 1
        at_once = self.part_bytes if is_stack else total
        max_frames = _FREE_FRAMES + self._path.stat().st_size // _MIN_FRAME_BYTES
        if at_once > _MAX_PART_BYTES or total > MAX_ZIP_RATIO * self._path.stat().st_size or frames > max_frames:
            raise InputError(f"{where}: has shape {shape}, too large for this file or for any recording", code="array-too-large")
        if is_stack:
            check_pixels(self.part_shape[1], self.part_shape[0], where)

    def _opened(self) -> IO[bytes]:
        """Open the array's file in the ZIP, and read its header."""
        with zipfile.ZipFile(self._path) as archive:  # which stays open as long as the file in it
            file = archive.open(f"{self.stored}.npy")
        try:
            self.shape, fortran, self.dtype = read_header(file)
        except BaseException:
            file.close()
            raise
        self._order, self._begin = "F" if fortran else "C", file.tell()
        return file

    def close(self) -> None:
        """Close the file."""
        if (file := getattr(self, "_file", None)) is not None:
            file.close()
        self._file = None

    __del__ = close

    def part(self, index: int) -> Array:
        """Return the part of the array for frame number `index` (from 0), or the part that all frames share.

        Raises
        ------
        InputError : the file is cut off or damaged.
        """
        data = self._bytes_at(index * self.part_bytes if self.stacked else 0, self.part_bytes)
        return data.view(self.dtype).reshape(self.part_shape, order="F" if self._order == "F" else "C")

    def numbers(self, count: int) -> Array:
        """Read a small array as (count, ...) float, one part for each frame."""
        if not np.issubdtype(self.dtype, np.number) or np.issubdtype(self.dtype, np.complexfloating):
            raise InputError(f"{self._where} has type {self.dtype}, expected numbers", code="array-type")
        data = self._bytes_at(0, math.prod(self.shape) * self.dtype.itemsize).view(self.dtype)
        self.close()
        values = data.reshape(self.shape, order="F" if self._order == "F" else "C").astype(float)
        return values if self.stacked else np.broadcast_to(values, (count, *self.shape))

    def _bytes_at(self, start: int, length: int) -> Array:
        with self._lock, guarded(self._where):
            try:
                self._file = self._file or self._opened()
                self._file.seek(self._begin + start)
                return np.frombuffer(self._read(length), np.uint8)
            except Exception:
                self.close()
                raise

    def _read(self, length: int) -> bytes:
        data = self._file.read(length) if self._file else b""
        if len(data) < length:
            raise EOFError("it ends too early")
        return data
