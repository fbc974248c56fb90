"""Orientations of a chain's segments as rigid links."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..geometry.polyline import TINY, unit
from ..types import Floats


def link_frames(joints: Floats) -> Floats:
    """Return the orientation of each segment of a chain as a rotation matrix, with minimal twist (parallel transport).

    Parameters
    ----------
    joints
        (N + 1, 3) m, the joints in order; a segment leads from each joint to the next.

    Returns
    -------
    (N, 3, 3) float64
        rotations from a segment's own coordinates to those of the joints: p_joints = R @ p_segment. The third column, the
        segment's z axis, is its unit direction. Each rotation is the previous one turned by the smallest angle that aligns the
        z axes; the first is the identity turned in the same way.
    """
    frames = []
    frame = np.eye(3)
    for direction in unit(np.diff(joints, axis=0)):
        frame = _shortest_rotation(frame, direction) @ frame
        frames.append(frame)
    return np.array(frames)


def relative_rotations(frames: Floats) -> Rotation:
    """Return the rotation of each segment relative to the previous one.

    Parameters
    ----------
    frames
        (N, 3, 3), the orientation of each segment: R in p_joints = R @ p_segment.

    Returns
    -------
    Rotation
        N rotations, from the coordinates of segment k to those of segment k - 1; of segment 0, to the coordinates of the joints.
    """
    previous = np.concatenate((np.eye(3)[None], frames[:-1]))
    return Rotation.from_matrix(previous.transpose(0, 2, 1) @ frames)


def _shortest_rotation(frame: Floats, direction: Floats) -> Floats:
    """Return the (3, 3) rotation by the smallest angle from the third axis of `frame` to the unit vector `direction`.

    Rodrigues' formula with sin K = b a' - a b', whose axis is perpendicular to both: 1 + sin K + (sin K)^2 / (1 + cos).
    """
    axis = frame[:, 2]
    cosine = axis @ direction
    if 1 + cosine < TINY:  # opposite directions: half a turn about the first axis
        return np.asarray(2 * np.outer(frame[:, 0], frame[:, 0]) - np.eye(3))
    sine = np.outer(direction, axis) - np.outer(axis, direction)
    return np.asarray(np.eye(3) + sine + sine @ sine / (1 + cosine))
