"""Interpolation of poses."""

from __future__ import annotations

import numpy as np

from ...types import Floats


def interpolate_pose(one: Floats, other: Floats, share: float) -> Floats:
    """Return the (4, 4) pose between two (4, 4) poses: linear in position, slerp in rotation.

    `share` is the fraction of the path from `one` to `other`, 0 to 1: 0 gives `one`, 1 gives `other`.
    """
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_matrix(one[:3, :3].T @ other[:3, :3]).as_rotvec()
    pose = np.eye(4)
    pose[:3, :3] = one[:3, :3] @ Rotation.from_rotvec(share * rotation).as_matrix()
    pose[:3, 3] = (1 - share) * one[:3, 3] + share * other[:3, 3]
    return pose
