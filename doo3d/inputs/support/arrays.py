"""Read depth and color from files that OpenCV does not decode: arrays of numpy.save (.npy), and OpenEXR."""

import math
import os
from pathlib import Path
from typing import IO, Any

import numpy as np

from ...errors import InputError, require
from ...guard.guarding import check_not_pointer, check_regular, guarded
from ...types import Array

SATURATED = np.iinfo(np.uint16).max  # of 16-bit depth: no measurement, as 7-Scenes says and saturated sensors mean
MAX_ARRAY_BYTES = 1 << 28  # of one image
_HEAD_BYTES = 64
_DEPTH_CHANNELS = ("z", "depth", "v")  # last words of EXR's, best first: Blender's Depth.Z and Depth.V, others' Z and depth
_MAX_HEADER_BYTES = 10_000  # as NumPy allows


def read_depth_array(path: Path, scale: float, float_scale: float = 1.0) -> Array:
    """Read a depth image from a .npy file as metres along the optical axis, (H, W) float32; 0 or NaN = no measurement.

    Parameters
    ----------
    path
        file with an array (H, W) or (H, W, 1) of integers of 16 bits or more, or of floats.
    scale
        units per metre of integers, such as 1000 for millimetres.
    float_scale
        units per metre of floats.

    Raises
    ------
    InputError : the file is missing or damaged, the array has another shape or type, or floats seem to have another unit than
    metres.
    """
    array = read_array(path)
    array = array[..., 0] if array.ndim == 3 and array.shape[2] == 1 else array
    if array.ndim != 2:
        remedy = "save several frames as one NPZ, with numpy.savez(file, depth=depth, K=K)"
        raise InputError(f"{path}: has shape {array.shape}, expected one depth image (H, W): {remedy}", code="depth-shape")
    if array.dtype.kind not in "uif" or array.dtype.itemsize < 2:
        raise InputError(f"{path}: has type {array.dtype}, expected integers of 16 bits or more, or floats", code="depth-type")
    return to_metres(array, scale, float_scale)


def to_metres(array: Array, scale: float, float_scale: float = 1.0) -> Array:
    """Convert depth, integers in `scale` or floats in `float_scale` units per metre, to float32 metres.

    The largest 16-bit value counts as no reading, since cameras write it beyond their range.
    """
    if array.dtype == np.uint16 and array.max(initial=0) == SATURATED:
        array = np.where(array == SATURATED, 0, array)
    with np.errstate(all="ignore"):
        return np.asarray(array / np.float32(float_scale if array.dtype.kind == "f" else scale), dtype=np.float32)


def read_color_array(path: Path) -> Array:
    """Read a color image from a .npy file as (H, W, 3) uint8 RGB; a gray image gets three equal channels.

    Raises
    ------
    InputError : the file is missing or damaged, or is not an array (H, W), (H, W, 3) or (H, W, 4) of uint8.
    """
    array = read_array(path)
    if array.dtype != np.uint8:
        raise InputError(f"{path}: has type {array.dtype}, expected uint8", code="color-type")
    if array.ndim == 2:
        return np.dstack([array] * 3)
    if array.ndim != 3 or array.shape[2] not in (3, 4):
        raise InputError(f"{path}: has shape {array.shape}, expected (H, W, 3)", code="color-shape")
    return np.ascontiguousarray(array[..., :3])


def read_header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Read the header of a .npy file: shape, whether stored column by column, and type; raise ValueError for other files."""
    version = np.lib.format.read_magic(file)
    if version != (1, 0):  # NumPy reads the header before it looks at the length
        length = int.from_bytes(file.read(4), "little")
        if length > _MAX_HEADER_BYTES:
            raise ValueError(f"its header has {length} bytes")
        file.seek(-4, os.SEEK_CUR)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(file)
    return tuple(shape), fortran, dtype


def array_header(path: Path) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Read the header of the .npy file at a path, see `read_header`; raise OSError if it cannot be read."""
    if not path.is_file():  # such as a pipe, which may have no end
        raise OSError(f"{path} is no file")
    with path.open("rb") as file:
        return read_header(file)


def read_array(path: Path) -> Array:
    """Read the numeric array of a .npy file; raise InputError if it is damaged or larger than an image may be."""
    check_regular(path)
    with guarded(path), path.open("rb") as file:
        check_not_pointer(path, file.read(_HEAD_BYTES))
        file.seek(0)
        shape, _, dtype = read_header(file)
        announced = math.prod(shape) * dtype.itemsize
        if dtype.hasobject or dtype.names:
            raise InputError(f"{path}: holds Python objects, expected an array of numbers", code="array-type")
        if announced > MAX_ARRAY_BYTES:
            raise InputError(f"{path}: has shape {shape}, too large for one image", code="array-too-large")
        if path.stat().st_size - file.tell() < announced:
            raise InputError(f"{path}: is cut off: copy it again from where it was recorded", code="file-damaged")
        file.seek(0)
        return np.asarray(np.lib.format.read_array(file, allow_pickle=False))


def read_exr(path: Path) -> Array:
    """Read the depth of an EXR image as stored, (H, W) float32 or uint32.

    The depth is the only channel, one named Z, depth or V, or any of several equal channels, as in a gray picture.

    Raises
    ------
    InputError : the file is damaged, or has several channels of which none is depth.
    MissingDependency : the package OpenEXR is not installed.
    """
    openexr = require("OpenEXR", "exr")
    with guarded(path):
        channels = openexr.File(str(path), separate_channels=True).channels()
        images = {name: np.asarray(channel.pixels) for name, channel in channels.items()}
    last = {name.lower().rpartition(".")[2]: name for name in images}
    name = next((last[word] for word in _DEPTH_CHANNELS if word in last), None)
    if name is None and (first := next(iter(images), None)) is not None:
        equal = all(np.array_equal(image, images[first], equal_nan=True) for key, image in images.items() if key != "A")
        name = first if equal and first != "A" else None
    if name is None:
        sentence = f"{path}: has the channels {', '.join(images) or '(none)'}, expected one of depth, such as Z or depth"
        raise InputError(sentence, code="depth-shape")
    image = images[name]
    return image.astype(np.float32) if image.dtype.kind == "f" else image
