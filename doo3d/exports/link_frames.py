"""Orientations of a chain's segments as rigid links."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..geometry.polyline import TINY, unit
from ..types import Floats


def link_frames(joints: Floats) -> Floats:
    """Return the orientation of each segment, with minimal twist (parallel transport).

    Parameters
    ----------
    joints
        (N + 1, 3) m.

    Returns
    -------
    (N, 3, 3) rotations whose third column is the segment's direction. Each is the previous one (for the first: the identity),
    rotated about the axis perpendicular to both directions.
    """
    frames = []
    frame = np.eye(3)
    for direction in unit(np.diff(joints, axis=0)):
        frame = _shortest_rotation(frame, direction) @ frame
        frames.append(frame)
    return np.array(frames)


def relative_rotations(frames: Floats) -> Rotation:
    """Return the rotation of each segment (N, 3, 3) relative to the previous one; of the first, to the coordinates."""
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
