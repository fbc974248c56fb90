"""Decide by the poses of a camera whether it moved."""

import numpy as np

from ..errors import InputError
from ..types import Floats

MIN_CAMERA_MOTION_M, MIN_CAMERA_TURN_RAD = 0.005, np.radians(1.0)
"""Translation in m and rotation in rad below which a camera has not moved: its views show the same side of the object."""


def camera_moves(poses: Floats) -> bool:
    """Return whether a camera moves 5 mm or turns 1 degree from its first pose.

    poses : (F, 4, 4) m, F >= 1.
    """
    motion, turn = _camera_motion(poses)
    return bool(motion >= MIN_CAMERA_MOTION_M or turn >= MIN_CAMERA_TURN_RAD)


def _camera_motion(poses: Floats) -> tuple[float, float]:
    """Return the largest distance (m) and angle (rad) of poses from the first one.

    poses : (F, 4, 4) m.
    """
    motion = np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1).max()
    cos = (np.einsum("fij,ij->f", poses[:, :3, :3], poses[0, :3, :3]) - 1) / 2
    return float(motion), float(np.arccos(np.clip(cos, -1, 1)).max())


def check_camera_moved(poses: Floats) -> None:
    """Raise an InputError if a camera moved less than 5 mm and 1 degree.

    poses : (F, 4, 4) m, F >= 1 poses, camera to world.

    Raises
    ------
    InputError : the camera did not move, so that all frames show the same side of the object.
    """
    if not camera_moves(poses):
        motion, turn = _camera_motion(poses)
        raise InputError(
            f"the camera did not move ({1000 * motion:.1f} mm, {np.degrees(turn):.1f} degrees in {len(poses)} frames): every "
            "frame shows the same parts, detect in them one by one, without --fuse-views",
            code="camera-still",
        )
