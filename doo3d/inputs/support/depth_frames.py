"""Check cameras, matrices, poses and units in files of depth images."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...guard.guarding import read_bytes
from ...guard.parsing import parse_json
from ...types import Array, Camera, Floats
from .calibration import Pinhole as Pinhole
from .calibration import check_pinhole

_MIN_MEDIAN_DEPTH_M, _MAX_MEDIAN_DEPTH_M = 0.01, 100.0  # no depth camera's image has a median outside
_UNIT_STEP, _MIN_UNIT_SAMPLE = 16, 200  # px of the grid whose median is looked at first, and measured pixels that it must have
_MAX_ROTATION_ERROR = 1e-2  # of the entries of R Rᵀ - 1: matrices in text files are rounded
_MAX_LETTERS = 100  # of a wrong value that an error shows
_MAX_POSE_BYTES = 1 << 12  # a 4x4 matrix as text
_MAX_SHOWN = 7  # numbers of a wrong matrix that an error shows


def camera_for(pinhole: Pinhole, shape: tuple[int, ...], size: tuple[int, int] | None = None) -> Camera:
    """Return the Camera with the intrinsics `pinhole` and the size of an image.

    Parameters
    ----------
    pinhole
        the tuple (fx, fy, cx, cy) in px.
    shape
        (H, W), height and width of the image in px.
    size
        (width, height) in px that the image must have; None allows any size.

    Raises
    ------
    InputError : the image has another size than `size`, or the intrinsics are impossible.
    """
    height, width = shape
    if size is not None and size != (width, height):
        sizes = f"the depth image is {width}x{height} but its intrinsics are for {size[0]}x{size[1]}"
        remedy = "give those of this camera, --camera FILE or --input-option 'camera=[fx, fy, cx, cy]'"
        raise InputError(f"{sizes}: {remedy}", code="intrinsics-size")
    return Camera(*pinhole, width=width, height=height)


def depth_of_distance(distance: Array, camera: Camera) -> Array:
    """Convert distances from the optical center along the rays to depth along the optical axis, (H, W) float32 m."""
    u, v = (np.arange(camera.width) - camera.cx) / camera.fx, (np.arange(camera.height) - camera.cy) / camera.fy
    return np.asarray(distance / np.sqrt(1 + u**2 + v[:, None] ** 2), dtype=np.float32)


def check_unit(depth: Array, path: Path, scale: float | None) -> None:
    """Raise InputError if the median depth is below 0.01 m or above 100 m, which points to a wrong unit.

    Parameters
    ----------
    depth
        (H, W) m; pixels that are 0, negative or not finite are ignored. If no pixel is left, there is no error.
    path
        the depth image, named in the error.
    scale
        units per metre with which the file was read, named in the error; None if it depends on the type of the values.
    """
    sample = _measured(depth[::_UNIT_STEP, ::_UNIT_STEP])
    if sample.size >= _MIN_UNIT_SAMPLE and _is_plausible(float(np.median(sample))):
        return
    measured = _measured(depth)
    if measured.size and not _is_plausible(median := float(np.median(measured))):
        read = " (floats are metres by default)," if scale is None else f" with depth_scale={scale:g} (units per metre),"
        remedy = "give the right scale, such as --input-option depth_scale=1000 for millimetres"
        raise InputError(f"{path}: the median depth is {median:.3g} m{read} which is implausible: {remedy}", code="depth-unit")


def _measured(depth: Array) -> Array:
    """Return the depths that are measured, (N,) m."""
    with np.errstate(invalid="ignore"):
        return np.asarray(depth[np.isfinite(depth) & (depth > 0)])


def _is_plausible(median: float) -> bool:
    """Return whether a median depth in m is plausible for a depth camera."""
    return _MIN_MEDIAN_DEPTH_M <= median <= _MAX_MEDIAN_DEPTH_M


def check_depth_scale(value: Any, where: str, meaning: str) -> float:
    """Check the depth scale parsed from a file and return it as a float.

    Parameters
    ----------
    value
        the value in the file, of any type.
    where
        file and key, named in the error.
    meaning
        what the value should be, in words for the error, such as "units per metre above zero".

    Raises
    ------
    InputError : the value is not a finite number above zero.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < float("inf"):
        raise InputError(f"{where}: depth_scale is {value!r}, expected {meaning}", code="depth-scale-invalid")
    return float(value)


def pinhole_of(matrix: Any, where: str) -> Pinhole:
    """Return (fx, fy, cx, cy) of a camera matrix [fx, 0, cx; 0, fy, cy; 0, 0, 1], row by row or column by column.

    The matrix is nine numbers in any nesting (a list of 9, or 3x3); None counts as missing. `where` is file and key, named in the
    error.

    Raises
    ------
    InputError : the matrix is missing, or not of this form with fx and fy above zero.
    """
    code = "intrinsics-missing" if matrix is None else "intrinsics-invalid"
    form = "fx, 0, cx, 0, fy, cy, 0, 0, 1"
    return check_pinhole(numbers(matrix, 9, f"{where}, expected a camera matrix ({form})", code).tolist(), where)


def pose_of(rotation: Any, translation: Any, where: str) -> Floats:
    """Return the (4, 4) transform [R, t; 0, 0, 0, 1] of a rotation matrix and a translation.

    Parameters
    ----------
    rotation
        R, nine numbers row by row, or 3x3.
    translation
        t, three numbers; their unit is kept.
    where
        file and key, named in the error.

    Raises
    ------
    InputError : a wrong number of values, or R is no rotation matrix.
    """
    pose = np.eye(4)
    pose[:3, :3] = numbers(rotation, 9, f"{where}: rotation").reshape(3, 3)
    pose[:3, 3] = numbers(translation, 3, f"{where}: translation")
    return check_pose(pose, where)


def check_pose(pose: Any, where: str) -> Floats:
    """Check that `pose` is a rigid transform and return it as a (4, 4) float array.

    `where` is the file and the key that the pose comes from, named in the error.

    Raises
    ------
    InputError : `pose` is not 16 finite numbers (in any nesting, row by row), its upper left 3x3 part is no rotation matrix,
        or its last row is not 0, 0, 0, 1, each within 0.01.
    """
    values = numbers(pose, 16, f"{where}, expected a 4x4 matrix").reshape(4, 4)
    rotation = values[:3, :3]
    rigid = np.allclose(rotation @ rotation.T, np.eye(3), atol=_MAX_ROTATION_ERROR) and np.linalg.det(rotation) > 0
    if not rigid or (np.abs(values[3] - (0, 0, 0, 1)) > _MAX_ROTATION_ERROR).any():
        raise InputError(f"{where}: is not a rotation and a translation, with 0, 0, 0, 1 as its last row", code="pose-invalid")
    return values


def read_frame_pose(file: Path) -> Floats | None:
    """Read a file of one pose, (4, 4) camera to world, m; None if it is not finite, which marks lost tracking.

    Raises
    ------
    InputError : the file cannot be read, or holds no pose.
    """
    try:
        values = np.array(read_bytes(file, _MAX_POSE_BYTES).decode("utf-8-sig", "replace").split(), dtype=float)
    except ValueError:
        raise InputError(f"{file}: expected a 4x4 matrix, camera to world", code="pose-invalid") from None
    return None if values.size == 16 and not np.isfinite(values).all() else check_pose(values, str(file))


def numbers(given: Any, count: int, where: str, code: str = "pose-invalid") -> Floats:
    """Return values parsed from a file as `count` finite numbers, (count,) float.

    Parameters
    ----------
    given
        the numbers, in any nesting; nested lists are flattened row by row.
    count
        the expected number of values.
    where
        file and key, named in the error.
    code
        machine-readable code of the InputError, such as "pose-invalid" if the numbers are a pose.

    Raises
    ------
    InputError : another number of values, or a value that is not a finite number.
    """
    try:
        values = np.asarray(given, dtype=float).ravel()
    except (TypeError, ValueError, OverflowError):
        values = np.zeros(0)
    if isinstance(given, str) or values.size != count or not np.isfinite(values).all():
        got = "lists of several lengths"
        with suppress(ValueError):
            got = repr(given)[:_MAX_LETTERS] if np.size(given) <= _MAX_SHOWN else f"{np.size(given)} values"
        raise InputError(f"{where}: expected {count} finite numbers, got {got}", code=code)
    return values


def json_object(data: bytes, where: str) -> dict[str, Any]:
    """Parse UTF-8 JSON text whose top level is an object into a dict; `where` is the file, named in the error.

    Raises
    ------
    InputError : the text is not JSON, or its top level is not an object.
    """
    values = parse_json(data, where)
    if not isinstance(values, dict):
        raise InputError(f"{where}: expected a JSON object, got {type(values).__name__}", code="json-invalid")
    return values
