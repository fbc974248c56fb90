"""Poses between poses."""

from __future__ import annotations

import numpy as np

from ...types import Floats


def interpolate_pose(one: Floats, other: Floats, share: float) -> Floats:
    """Return the pose (4, 4) at a share, 0 to 1, of the way from one to another: along the line, and of the turn (slerp)."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_matrix(one[:3, :3].T @ other[:3, :3]).as_rotvec()
    pose = np.eye(4)
    pose[:3, :3] = one[:3, :3] @ Rotation.from_rotvec(share * turn).as_matrix()
    pose[:3, 3] = (1 - share) * one[:3, 3] + share * other[:3, 3]
    return pose
