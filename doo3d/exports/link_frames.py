"""Compute the orientations of a chain's segments as rigid links."""

import numpy as np
from scipy.spatial.transform import Rotation

from ..geometry.polyline import TINY, unit
from ..types import Floats


def link_frames(joints: Floats, start: Floats | None = None) -> Floats:
    """Return the orientation of each segment of a chain as a rotation matrix, with minimal twist (parallel transport).

    Parameters
    ----------
    joints
        (N + 1, 3) m, the joints in order; segment k of the N segments leads from joint k to joint k + 1.
    start
        (3, 3) rotation that is turned to the first segment, such as the orientation in the frame before; None for the identity.

    Returns
    -------
    (N, 3, 3) float64
        a rotation R for each segment, from the segment's own coordinates to those of the joints: p_joints = R @ p_segment. The
        third column of R, the segment's z axis, is its unit direction from joint k to joint k + 1. Each R is that of the previous
        segment turned by the smallest angle that aligns the z axes; the first is `start` turned in the same way.
    """
    frames = []
    frame = np.eye(3) if start is None else start
    for direction in unit(np.diff(joints, axis=0)):
        frame = _orthonormal(_shortest_rotation(frame, direction) @ frame, direction)
        frames.append(frame)
    return np.array(frames)


def _orthonormal(frame: Floats, direction: Floats) -> Floats:
    """Remove the rounding errors of a (3, 3) rotation; its third column becomes exactly the unit vector `direction`.

    Otherwise rounding errors would grow along a chain that turns back and forth.
    """
    first = unit(frame[:, 0] - (frame[:, 0] @ direction) * direction)
    return np.column_stack((first, np.cross(direction, first), direction))


def relative_rotations(frames: Floats) -> Rotation:
    """Return the rotation of each segment of a chain relative to the previous segment.

    Parameters
    ----------
    frames
        (N, 3, 3), the orientation of each of N segments, as returned by `link_frames`.

    Returns
    -------
    Rotation
        N rotations (scipy). Rotation k maps from the coordinates of segment k to those of segment k - 1; rotation 0 maps from the
        coordinates of segment 0 to those of the joints.
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
