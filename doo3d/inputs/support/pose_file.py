"""Read files with one pose: the camera in a robot's base frame, as calibration programs write it."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...guard.guarding import guarded, read_bytes
from ...guard.parsing import MAX_YAML_BYTES, parse_json, parse_yaml
from ...types import Array, Floats, as_pose

PoseLike = str | Path | Array | Sequence[Any]

CAPTURE = "capture"
"""Value of the option `pose` for the capture's own pose of each frame."""

TF = "tf:"
"""Prefix of the option `pose` before the name of a coordinate frame of a bag, such as tf:base_link."""

POSE_FILES = ("pose.yaml", "pose.yml", "pose.json")
"""Names of the file with the camera's pose in the robot's base frame, searched beside the images."""

POSE_KEYS = ("pose", "transform", "transformation", "matrix", "transforms", "T")
"""Keys under which files hold the pose: a 4x4 matrix, seven numbers, or a mapping with position and rotation."""

POSITION_KEYS = ("position", "translation", "xyz", "t")
ROTATION_KEYS = ("orientation", "rotation", "quaternion", "q", "R")

_SEVEN = ("x", "y", "z", "qx", "qy", "qz", "qw")
_CODES = {"json-invalid": "pose-invalid", "yaml-invalid": "pose-invalid"}

EXPECTED = "expected `pose:` with a 4x4 matrix, x, y, z, qx, qy, qz, qw, or `position` and `orientation` (quaternion x, y, z, w)"


def read_pose(pose: PoseLike) -> Floats:
    """Convert a pose in one of several forms to a 4x4 matrix.

    Parameters
    ----------
    pose
        either the 16 numbers of a 4x4 matrix, row by row, or the seven numbers x y z qx qy qz qw (position in m and unit
        quaternion). They are given as an array or list, as a text with commas such as "0,0,1.2,1,0,0,0", or as the path of
        a text, NPY, YAML or JSON file. A YAML or JSON file may also hold position and orientation as ROS writes them.

    Returns
    -------
    (4, 4) float64
        the pose T with (p_out, 1) = T @ (p_in, 1), m. For the pose of a camera in the world, p_in is in the camera's coordinates
        and p_out in the world's. The rotation is made exactly orthonormal.

    Raises
    ------
    InputError
        the file cannot be read, there are neither 7 nor 16 finite numbers, or they differ from a rigid motion by more than 0.001.
    """
    if not isinstance(pose, str | Path):
        return as_pose(pose)
    name, exists = f"pose {pose}"[:200], False
    with suppress(OSError, ValueError):  # a text that is too long for a path
        exists = Path(pose).exists()
    if isinstance(pose, str) and "," in pose and not exists:
        return as_pose(pose, name)
    if not exists:
        raise InputError(f"{name}: cannot be read (No such file or directory), nor is it x,y,z,qx,qy,qz,qw", code="file-missing")
    try:
        with guarded(name, code="pose-invalid"):
            return as_pose(_content(Path(pose), name), name)
    except InputError as error:
        raise InputError(str(error), code=_CODES.get(error.code, error.code)) from None


def pose_file_beside(path: Path) -> Path | None:
    """Return the pose file of a capture (see POSE_FILES), in its folder or next to its file; None if there is none."""
    folder = path if path.is_dir() else path.parent
    return next((folder / name for name in POSE_FILES if (folder / name).is_file()), None)


def _content(path: Path, name: str) -> Any:
    """Read the numbers of a pose from a file, in a form that `as_pose` accepts."""
    suffix = path.suffix.lower()
    data = read_bytes(path, MAX_YAML_BYTES, name)
    if suffix == ".npy":
        return np.load(BytesIO(data), allow_pickle=False)
    if suffix == ".json":
        return _numbers(parse_json(data, name), name)
    if suffix in (".yaml", ".yml"):
        return _numbers(parse_yaml(data, name), name)
    return data.decode("utf-8-sig")


def _numbers(value: Any, name: str) -> Any:
    """Return the numbers of a pose inside the content of a YAML or JSON file."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return _numbers(value[0], name) if len(value) == 1 else value
    inner = None
    if isinstance(value, Mapping):
        if all(key in value for key in _SEVEN):
            return [value[key] for key in _SEVEN]
        position, rotation = (next((value[key] for key in keys if key in value), None) for keys in (POSITION_KEYS, ROTATION_KEYS))
        if position is not None and rotation is not None:
            return _combined(_ordered(position, "xyz"), _ordered(rotation, "xyzw"), name)
        inner = next((value[key] for key in POSE_KEYS if key in value), None)
    if inner is None:
        raise InputError(f"{name}: holds no pose: {EXPECTED}", code="pose-invalid")
    return _numbers(inner, name)


def _ordered(value: Any, keys: str) -> Any:
    """Return the values of a mapping whose keys are the letters of `keys`, in that order; other values unchanged."""
    return [value.get(key) for key in keys] if isinstance(value, Mapping) else value


def _combined(position: Any, rotation: Any, name: str) -> Any:
    """Combine a position (3,) with a quaternion (4,) to seven numbers, or with a rotation matrix (3, 3) to a 4x4 matrix."""
    try:
        position, rotation = (np.asarray(value, dtype=float) for value in (position, rotation))
    except (ValueError, TypeError, OverflowError):
        raise InputError(f"{name}: holds a value that is not a number", code="pose-invalid") from None
    if position.size != 3 or rotation.size not in (4, 9):
        sizes = f"{position.size} numbers of the position and {rotation.size} of the orientation"
        raise InputError(f"{name}: {sizes}: {EXPECTED}", code="pose-invalid")
    if rotation.size == 4:
        return np.concatenate((position.ravel(), rotation.ravel()))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.reshape(3, 3), position.ravel()
    return matrix
