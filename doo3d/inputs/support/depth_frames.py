"""Helpers for formats of depth images: frames from image files; checks of cameras, matrices, poses and units."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError, unread_code
from ...types import Array, Bools, Camera, Floats, Frame
from ..capture import FrameData
from .images import read_color, read_depth, read_mask
from .listing import with_file

Pinhole = tuple[float, float, float, float]
"""fx, fy, cx, cy in px."""
_MIN_MEDIAN_DEPTH_M, _MAX_MEDIAN_DEPTH_M = 0.01, 100.0  # no depth camera's image has a median outside
_MAX_ROTATION_ERROR = 1e-2  # of the entries of R Rᵀ - 1: matrices in text files are rounded
_MAX_SHOWN = 5  # numbers of a wrong matrix that an error shows


class ImageFiles(NamedTuple):
    """The image files of one frame.

    color : None if the capture has no colour. masks : their union is the object's pixels; none are given if the union is
    empty or the whole image.
    """

    depth: Path
    color: Path | None = None
    masks: tuple[Path, ...] = ()


class DepthSensor(NamedTuple):
    """Intrinsics and unit of a depth image whose size is known only when it is read.

    pinhole : fx, fy, cx, cy px. size : (width, height) px for which the intrinsics hold; None: that of the image.
    scale : units of the depth image per metre.
    """

    pinhole: Pinhole
    scale: float
    size: tuple[int, int] | None = None


def load_files(
    files: ImageFiles,
    sensor: DepthSensor,
    name: str,
    timestamp: float | None = None,
    pose: Floats | None = None,
    required: bool = False,
) -> FrameData:
    """Read one frame from image files.

    Parameters
    ----------
    files
        depth, and where present colour and masks.
    sensor
        intrinsics and unit of the depth image.
    name, timestamp
        of the frame; s.
    pose
        (4, 4) camera to world, m.
    required
        return the union of the masks even if it is empty or the whole image.

    Raises
    ------
    InputError : a file is missing, damaged or of another size, or the unit of depth is implausible.
    """
    depth = read_depth(files.depth, sensor.scale)
    check_unit(depth, files.depth, sensor.scale)
    try:
        camera = camera_for(sensor.pinhole, depth.shape, sensor.size)
        frame = Frame(read_color(files.color) if files.color else None, depth, camera, name, timestamp)
    except InputError as error:
        raise with_file(error, files.depth) from None
    return FrameData(frame, _mask_union(files.masks, depth.shape, required), pose)


def camera_for(pinhole: Pinhole, shape: tuple[int, ...], size: tuple[int, int] | None = None) -> Camera:
    """Return the camera of an image.

    Parameters
    ----------
    pinhole
        fx, fy, cx, cy, px.
    shape
        (H, W) of the image.
    size
        (width, height) px for which the intrinsics hold; None: that of the image.

    Raises
    ------
    InputError : the intrinsics are for another image size, or impossible.
    """
    height, width = shape
    if size is not None and size != (width, height):
        raise InputError(
            f"the depth image is {width}x{height} but the format's default intrinsics are for {size[0]}x{size[1]}: "
            "give the intrinsics of this camera, --input-option 'camera=[fx, fy, cx, cy]'",
            code="intrinsics-size",
        )
    return Camera(*pinhole, width=width, height=height)


def check_unit(depth: Array, path: Path, scale: float) -> None:
    """Check that the median depth is plausible for a depth camera.

    Parameters
    ----------
    depth
        (H, W) m; 0 and values that are not finite are no measurements.
    path
        the file, for the error.
    scale
        the units per metre with which the file was read, for the error.

    Raises
    ------
    InputError : the median is below a centimetre or above a hundred metres.
    """
    with np.errstate(invalid="ignore"):
        measured = depth[np.isfinite(depth) & (depth > 0)]
    if measured.size and not _MIN_MEDIAN_DEPTH_M <= (median := float(np.median(measured))) <= _MAX_MEDIAN_DEPTH_M:
        raise InputError(
            f"{path}: the median depth is {median:.3g} m with depth_scale={scale:g} (units per metre), which is implausible: "
            "give the right scale, such as --input-option depth_scale=1000 for millimetres",
            code="depth-unit",
        )


def check_depth_scale(value: Any, where: str, meaning: str) -> float:
    """Return the unit of a depth image as a float.

    Parameters
    ----------
    value
        as in the file.
    where
        file and key, for the error.
    meaning
        the quantity and its unit in words, for the error.

    Raises
    ------
    InputError : the value is not a number above zero.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < float("inf"):
        raise InputError(f"{where}: depth_scale is {value!r}, expected {meaning}", code="depth-scale-invalid")
    return float(value)


def pinhole_of(matrix: Any, where: str, columns: bool = False) -> Pinhole:
    """Return fx, fy, cx, cy of a camera matrix.

    Parameters
    ----------
    matrix
        9 numbers, or 3x3.
    where
        file and key, for the error.
    columns
        the numbers are in column-major order.

    Raises
    ------
    InputError : the matrix is missing, or not [fx, 0, cx, 0, fy, cy, 0, 0, 1].
    """
    code = "intrinsics-missing" if matrix is None else "intrinsics-invalid"
    form = "fx, 0, 0, 0, fy, 0, cx, cy, 1" if columns else "fx, 0, cx, 0, fy, cy, 0, 0, 1"
    values = numbers(matrix, 9, f"{where}, expected a camera matrix ({form})", code).reshape(3, 3)
    values = values.T if columns else values
    if (values[2] != (0, 0, 1)).any() or values[1, 0] or values[0, 0] <= 0 or values[1, 1] <= 0:
        listed = ", ".join(f"{value:g}" for value in values.ravel())
        raise InputError(
            f"{where}: [{listed}], row by row, is not a camera matrix, expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]",
            code="intrinsics-invalid",
        )
    return values[0, 0].item(), values[1, 1].item(), values[0, 2].item(), values[1, 2].item()


def pose_of(rotation: Any, translation: Any, where: str) -> Floats:
    """Return the pose (4, 4) of a rotation matrix and a translation.

    Parameters
    ----------
    rotation
        9 numbers row by row, or 3x3.
    translation
        3 numbers.
    where
        file and key, for the error.

    Raises
    ------
    InputError : a wrong number of values, or the matrix is no rotation.
    """
    pose = np.eye(4)
    pose[:3, :3] = numbers(rotation, 9, f"{where}: rotation").reshape(3, 3)
    pose[:3, 3] = numbers(translation, 3, f"{where}: translation")
    return check_pose(pose, where)


def check_pose(pose: Any, where: str) -> Floats:
    """Return a rigid transform as (4, 4) float; `where` is the file and key, for the error.

    Raises
    ------
    InputError : the values are not 16 finite numbers, or not a rotation and a translation.
    """
    values = numbers(pose, 16, f"{where}, expected a 4x4 matrix").reshape(4, 4)
    rotation = values[:3, :3]
    rigid = np.allclose(rotation @ rotation.T, np.eye(3), atol=_MAX_ROTATION_ERROR) and np.linalg.det(rotation) > 0
    if not rigid or (np.abs(values[3] - (0, 0, 0, 1)) > _MAX_ROTATION_ERROR).any():
        raise InputError(f"{where}: is not a rotation and a translation, with 0, 0, 0, 1 as its last row", code="pose-invalid")
    return values


def numbers(given: Any, count: int, where: str, code: str = "pose-invalid") -> Floats:
    """Return `count` finite numbers as (count,) float.

    Parameters
    ----------
    given
        the numbers, in any nesting.
    count
        the expected number of values.
    where
        file and key, for the error.
    code
        the error's code, by the purpose of the numbers.

    Raises
    ------
    InputError : another number of values, or a value that is not a finite number.
    """
    try:
        values = np.asarray(given, dtype=float).ravel()
    except (TypeError, ValueError):
        values = np.zeros(0)
    if isinstance(given, str) or values.size != count or not np.isfinite(values).all():
        got = repr(given) if np.size(given) <= _MAX_SHOWN else f"{np.size(given)} values"
        raise InputError(f"{where}: expected {count} finite numbers, got {got}", code=code)
    return values


def read_json(path: Path) -> dict[str, Any]:
    """Return the object in a JSON file.

    Raises
    ------
    InputError : the file is missing, is not JSON, or holds no object.
    """
    try:
        return json_object(path.read_bytes(), str(path))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})", code=unread_code(error)) from None


def json_object(data: bytes, where: str) -> dict[str, Any]:
    """Return the object in JSON text (UTF-8); `where` is the file, for the error.

    Raises
    ------
    InputError : the text is not JSON, or holds no object.
    """
    try:
        values = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: is not valid JSON ({error})", code="json-invalid") from None
    if not isinstance(values, dict):
        raise InputError(f"{where}: expected a JSON object, got {type(values).__name__}", code="json-invalid")
    return values


def _mask_union(masks: Sequence[Path], shape: tuple[int, ...], required: bool) -> Bools | None:
    if not masks:
        return None
    union = np.zeros(shape, bool)
    for mask in masks:
        union |= read_mask(mask, shape)
    return union if required or (union.any() and not union.all()) else None
