"""Define planes, and handle rigid motions as 4x4 matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .arrays import Array, Floats, set_sealed

TOLERANCE = 1e-3
"""Greatest deviation from a rigid motion that counts as rounding; rotations are made orthonormal, so that segments keep their
length."""

POSE_FORMS = "4x4 or x,y,z,qx,qy,qz,qw"
MAX_POSE_NUMBERS = 1000
"""Greatest number of values that the error counts; a pose has at most 16."""


@dataclass(frozen=True)
class Plane:
    """A plane in space: the points p with normal @ p = height.

    Attributes
    ----------
    normal
        (3,) unit, towards the side on which the sensor and the object are.
    height
        height of the plane above the origin of the coordinates along `normal`, m. In a camera's coordinates it is negative: minus
        the distance of the camera from the plane.
    """

    normal: Floats
    height: float

    def __post_init__(self) -> None:
        set_sealed(self, normal=np.asarray(self.normal, dtype=float))

    def transformed(self, pose: Floats) -> Plane:
        """Return the plane after a rigid motion, a (4, 4) matrix: (p_new, 1) = pose @ (p, 1)."""
        normal = pose[:3, :3] @ self.normal
        return Plane(normal, float(self.height + normal @ pose[:3, 3]))

    def to_dict(self) -> dict[str, Any]:
        """Return the plane as plain values, ready for JSON: "normal" (three numbers) and "height" in m."""
        return {"normal": self.normal.tolist(), "height": self.height}


def in_frame_of(pose: Floats, points: Floats) -> Floats:
    """Transform points (N, 3) m by a pose (4, 4): p_new = pose @ p."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def as_pose(numbers: ArrayLike | str, name: str = "pose") -> Floats:
    """Convert the numbers of a pose to a 4x4 matrix.

    Parameters
    ----------
    numbers
        the 16 numbers of a 4x4 matrix, row by row, or the seven numbers x y z qx qy qz qw (position in m and unit quaternion), as
        an array, nested lists, or a text with commas or blanks.
    name
        name of the pose, for errors.

    Returns
    -------
    (4, 4) float64
        the pose T with (p_out, 1) = T @ (p_in, 1), m. Its rotation is exactly orthonormal.

    Raises
    ------
    InputError : there are neither 7 nor 16 finite numbers, or they differ from a rigid motion by more than 0.001.
    """
    values = _floats(numbers, name)
    if values.size == 7:
        return _from_quaternion(values.ravel(), name)
    if values.size == 16:
        return _from_matrix(values.reshape(4, 4), name)
    raise InputError(f"{name}: {values.size} numbers, expected {POSE_FORMS}", code="pose-invalid")


def _floats(given: ArrayLike | str | Sequence[str], name: str) -> Floats:
    try:
        values = np.asarray(given.replace(",", " ").split() if isinstance(given, str) else given)
        if values.dtype.kind not in "biufSUO" or values.size > MAX_POSE_NUMBERS:
            raise InputError(
                f"{name}: is {values.size} values of type {values.dtype}, expected {POSE_FORMS}", code="pose-invalid"
            )
        values = values.astype(float)
    except (ValueError, TypeError, OverflowError):
        raise InputError(f"{name}: holds a value that is not a number", code="pose-invalid") from None
    if not np.isfinite(values).all():
        raise InputError(f"{name}: holds a number that is not finite", code="pose-invalid")
    return values


def _from_quaternion(numbers: Floats, name: str) -> Floats:
    from scipy.spatial.transform import Rotation

    length = float(np.linalg.norm(numbers[3:]))
    if abs(length - 1) > TOLERANCE:
        raise InputError(f"{name}: the quaternion qx,qy,qz,qw has length {length:.6g}, expected 1", code="pose-invalid")
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(numbers[3:]).as_matrix()
    pose[:3, 3] = numbers[:3]
    return pose


def _from_matrix(matrix: Array, name: str) -> Floats:
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
