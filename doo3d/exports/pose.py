"""Poses, and chains transformed by them from the camera's coordinates to the world's."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ..errors import InputError, unread_code
from ..types import Array, Detection, Floats

PoseLike = str | Path | Array | Sequence[float]
TOLERANCE = 1e-3  # of a rotation written with few digits; it is made orthonormal, so that segments keep their length


def read_pose(pose: PoseLike) -> Floats:
    """Return a pose, given in one of several forms, as a 4x4 matrix.

    Parameters
    ----------
    pose
        either the 16 numbers of a 4x4 matrix, row by row, or the seven numbers x y z qx qy qz qw (position in m and unit
        quaternion). They are given as an array or list, as a text with commas such as "0,0,1.2,1,0,0,0", or as the path of a text
        or NPY file.

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
    name, numbers = _numbers(pose)
    if numbers.size == 7:
        return _from_quaternion(name, numbers.ravel())
    if numbers.size == 16:
        return _from_matrix(name, numbers.reshape(4, 4))
    raise InputError(f"{name}: {numbers.size} numbers, expected 4x4 or x,y,z,qx,qy,qz,qw", code="pose-invalid")


def transformed(detection: Detection, pose: Floats) -> Detection:
    """Return a copy of a 3-D detection in the world's coordinates.

    The joints of the chains and the points of the crossings are transformed and `coordinates` is "world"; lengths, radii and
    everything else are unchanged.

    Parameters
    ----------
    detection
        a 3-D detection, for example in the camera's coordinates.
    pose
        (4, 4) matrix, m, from the detection's coordinates to the world's: (p_world, 1) = pose @ (p, 1). Its rotation must be
        orthonormal, as `read_pose` makes it.

    Raises
    ------
    InputError
        the detection is 2-D.
    """
    if detection.mode == "2d":
        raise InputError(f"frame {detection.frame} is 2-D, in pixels: a pose moves 3-D results", code="results-2d")
    rotation, translation = pose[:3, :3], pose[:3, 3]
    return dataclasses.replace(
        detection,
        coordinates="world",
        chains=tuple(dataclasses.replace(chain, joints=chain.joints @ rotation.T + translation) for chain in detection.chains),
        crossings=tuple(dataclasses.replace(each, point=rotation @ each.point + translation) for each in detection.crossings),
    )


def _numbers(pose: PoseLike) -> tuple[str, Floats]:
    if isinstance(pose, str) and not Path(pose).exists() and "," in pose:
        return f"pose {pose}", _parsed(f"pose {pose}", pose)
    if isinstance(pose, str | Path):
        name = f"pose {pose}"
        try:
            if Path(pose).suffix == ".npy":
                return name, _parsed(name, np.load(pose))
            return name, _parsed(name, Path(pose).read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(
                f"{name}: cannot be read ({error.strerror}), nor is it x,y,z,qx,qy,qz,qw", code=unread_code(error)
            ) from None
        except (ValueError, EOFError) as error:
            raise InputError(f"{name}: cannot be read ({error})", code="pose-invalid") from None
    return "pose", _parsed("pose", pose)


def _parsed(name: str, given: str | Array | Sequence[float]) -> Floats:
    try:
        items = given.replace(",", " ").split() if isinstance(given, str) else given
        numbers = np.asarray(items, dtype=float)
    except (ValueError, TypeError):
        raise InputError(f"{name}: holds a value that is not a number", code="pose-invalid") from None
    if not np.isfinite(numbers).all():
        raise InputError(f"{name}: holds a number that is not finite", code="pose-invalid")
    return numbers


def _from_quaternion(name: str, numbers: Floats) -> Floats:
    length = float(np.linalg.norm(numbers[3:]))
    if abs(length - 1) > TOLERANCE:
        raise InputError(f"{name}: the quaternion qx,qy,qz,qw has length {length:.6g}, expected 1", code="pose-invalid")
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(numbers[3:]).as_matrix()
    pose[:3, 3] = numbers[:3]
    return pose


def _from_matrix(name: str, matrix: Floats) -> Floats:
    if np.abs(matrix[3] - (0, 0, 0, 1)).max() > TOLERANCE:
        raise InputError(
            f"{name}: the last row is {matrix[3].tolist()}, expected 0 0 0 1 (the translation is the last column)",
            code="pose-invalid",
        )
    left, scale, right = np.linalg.svd(matrix[:3, :3])
    if np.linalg.det(matrix[:3, :3]) < 0:
        raise InputError(f"{name}: its upper left 3x3 is a reflection, expected a rotation", code="pose-invalid")
    if np.abs(scale - 1).max() > TOLERANCE:
        shown = ", ".join(f"{value:.6g}" for value in scale)
        raise InputError(f"{name}: its upper left 3x3 scales (singular values {shown}), expected a rotation", code="pose-invalid")
    pose = np.eye(4)
    pose[:3, :3] = left @ right  # the nearest rotation
    pose[:3, 3] = matrix[:3, 3]
    return pose
