"""What the formats of depth images share: a shot from image files, and cameras, matrices and units that can be."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...types import Array, Bools, Camera, Floats, Frame
from ..capture import FrameData
from .images import read_color, read_depth, read_mask

Pinhole = tuple[float, float, float, float]
"""fx, fy, cx, cy in px."""
_NEAR, _FAR = 0.01, 100.0  # m: the middle depth of no depth camera's image lies outside
_TURN = 1e-2  # by which R Rᵀ may differ from 1: matrices in text files are rounded
_SHOWN = 5  # numbers of a wrong matrix that an error shows


class Files(NamedTuple):
    """The image files of one frame.

    depth, color : None for a colour that the capture does not have. masks : their union is the object's pixels, where it is
    neither nothing nor everything.
    """

    depth: Path
    color: Path | None = None
    masks: tuple[Path, ...] = ()


class Sensor(NamedTuple):
    """The camera of an image whose size is known when it is read.

    pinhole : fx, fy, cx, cy px. size : (width, height) px that these numbers are for; None where it is the image's own.
    scale : units of the depth image per metre.
    """

    pinhole: Pinhole
    scale: float
    size: tuple[int, int] | None = None


def load_files(
    files: Files, sensor: Sensor, name: str, timestamp: float | None = None, pose: Floats | None = None, required: bool = False
) -> FrameData:
    """One shot from image files; `required` masks are given as they are.

    Raises
    ------
    InputError : a file is not there, cut off or of another size, or the depth is in a unit that makes no sense.
    """
    depth = read_depth(files.depth, sensor.scale)
    check_unit(depth, files.depth, sensor.scale)
    try:
        camera = camera_for(sensor.pinhole, depth.shape, sensor.size)
        frame = Frame(read_color(files.color) if files.color else None, depth, camera, name, timestamp)
    except InputError as error:
        text = str(error)
        raise error if str(files.depth.parent.parent) in text else InputError(f"{files.depth}: {text}", code=error.code) from None
    return FrameData(frame, _union(files.masks, depth.shape, required), pose)


def camera_for(pinhole: Pinhole, shape: tuple[int, ...], size: tuple[int, int] | None = None) -> Camera:
    """The camera of an image of `shape` (H, W).

    Raises
    ------
    InputError : the numbers are for another size, or no camera has them.
    """
    height, width = shape
    if size is not None and size != (width, height):
        raise InputError(
            f"the depth is {width}x{height} but the format's own intrinsics are for {size[0]}x{size[1]}: "
            "give those of this camera, --input-option 'camera=[fx, fy, cx, cy]'",
            code="intrinsics-size",
        )
    return Camera(*pinhole, width=width, height=height)


def check_unit(depth: Array, path: Path, scale: float) -> None:
    """Depth (H, W) m of `scale` units per metre; the middle of what was measured must be what a depth camera sees.

    Raises
    ------
    InputError : it lies nearer than a centimetre or farther than a hundred metres.
    """
    with np.errstate(invalid="ignore"):
        measured = depth[np.isfinite(depth) & (depth > 0)]
    if measured.size and not _NEAR <= (middle := float(np.median(measured))) <= _FAR:
        raise InputError(
            f"{path}: the depth is {middle:.3g} m in the middle with depth_scale={scale:g} (units per metre), which makes no "
            "sense: give the right one, --input-option depth_scale=1000 for millimetres",
            code="depth-unit",
        )


def pinhole_of(matrix: Any, where: str, columns: bool = False) -> Pinhole:
    """fx, fy, cx, cy of a camera matrix of 9 numbers row by row (or column by column), or 3x3.

    Raises
    ------
    InputError : it is no camera matrix.
    """
    code = "intrinsics-missing" if matrix is None else "intrinsics-invalid"
    form = "fx, 0, 0, 0, fy, 0, cx, cy, 1" if columns else "fx, 0, cx, 0, fy, cy, 0, 0, 1"
    values = numbers(matrix, 9, f"{where}, expected a camera matrix ({form})", code).reshape(3, 3)
    values = values.T if columns else values
    if (values[2] != (0, 0, 1)).any() or values[1, 0] or values[0, 0] <= 0 or values[1, 1] <= 0:
        shown = ", ".join(f"{value:g}" for value in values.ravel())
        raise InputError(
            f"{where}: [{shown}] row by row is not a camera matrix, expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]",
            code="intrinsics-invalid",
        )
    return values[0, 0].item(), values[1, 1].item(), values[0, 2].item(), values[1, 2].item()


def pose_of(rotation: Any, translation: Any, where: str) -> Floats:
    """(4, 4) from a rotation matrix, 9 numbers row by row or 3x3, and a translation (3,).

    Raises
    ------
    InputError : not so many numbers, or the matrix is no rotation.
    """
    pose = np.eye(4)
    pose[:3, :3] = numbers(rotation, 9, f"{where}: rotation").reshape(3, 3)
    pose[:3, 3] = numbers(translation, 3, f"{where}: translation")
    return check_pose(pose, where)


def check_pose(pose: Any, where: str) -> Floats:
    """(4, 4) float of a rotation and a translation.

    Raises
    ------
    InputError : it is not that.
    """
    values = numbers(pose, 16, f"{where}, expected a 4x4 matrix").reshape(4, 4)
    turn = values[:3, :3]
    rigid = np.allclose(turn @ turn.T, np.eye(3), atol=_TURN) and np.linalg.det(turn) > 0
    if not rigid or (np.abs(values[3] - (0, 0, 0, 1)) > _TURN).any():
        raise InputError(f"{where}: is not a rotation and a translation, with 0, 0, 0, 1 as its last row", code="pose-invalid")
    return values


def numbers(given: Any, count: int, where: str, code: str = "pose-invalid") -> Floats:
    """(count,) float, finite.

    Parameters
    ----------
    given : the numbers, in any nesting.
    count : how many they have to be.
    where : file and key, for the error.
    code : of the error, by what the numbers are for.

    Raises
    ------
    InputError : something else.
    """
    try:
        values = np.asarray(given, dtype=float).ravel()
    except (TypeError, ValueError):
        values = np.zeros(0)
    if isinstance(given, str) or values.size != count or not np.isfinite(values).all():
        got = repr(given) if np.size(given) <= _SHOWN else f"{np.size(given)} of them"
        raise InputError(f"{where}: expected {count} finite numbers, got {got}", code=code)
    return values


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file.

    Raises
    ------
    InputError : not there, not JSON, or not an object.
    """
    try:
        return json_object(path.read_bytes(), str(path))
    except FileNotFoundError:
        raise InputError(f"{path}: is missing", code="file-missing") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})", code="file-unreadable") from None


def json_object(data: bytes, where: str) -> dict[str, Any]:
    """The object in the text of a JSON file.

    Raises
    ------
    InputError : it is not JSON, or not an object.
    """
    try:
        values = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: is not valid JSON ({error})", code="json-invalid") from None
    if not isinstance(values, dict):
        raise InputError(f"{where}: expected a JSON object, got {type(values).__name__}", code="json-invalid")
    return values


def _union(masks: Sequence[Path], shape: tuple[int, ...], required: bool) -> Bools | None:
    if not masks:
        return None
    union = np.zeros(shape, bool)
    for mask in masks:
        union |= read_mask(mask, shape)
    return union if required or (union.any() and not union.all()) else None
