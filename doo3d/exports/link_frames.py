"""Chains as rigid links: the pose of each segment."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..geometry.polyline import TINY, unit
from ..types import Floats


def link_frames(joints: Floats) -> Floats:
    """The orientation of each segment, with as little twist from one to the next as there can be.

    Parameters
    ----------
    joints : (N + 1, 3) m.

    Returns
    -------
    (N, 3, 3): rotations whose third column is the segment's direction; each is the one before (the first: the identity),
    turned about the axis square to both directions.
    """
    frames = []
    frame = np.eye(3)
    for direction in unit(np.diff(joints, axis=0)):
        frame = _least_turn(frame, direction) @ frame
        frames.append(frame)
    return np.array(frames)


def turns(frames: Floats) -> Rotation:
    """The rotation of each segment in the frame of the one before it, from (N, 3, 3); of the first, in the world."""
    before = np.concatenate((np.eye(3)[None], frames[:-1]))
    return Rotation.from_matrix(before.transpose(0, 2, 1) @ frames)


def _least_turn(frame: Floats, after: Floats) -> Floats:
    """(3, 3): the rotation by the smallest angle that takes the third axis of `frame` to the unit vector `after`.

    Rodrigues' formula with sin K = b a' - a b', whose axis is square to both: 1 + sin K + (sin K)^2 / (1 + cos).
    """
    before = frame[:, 2]
    cosine = before @ after
    if 1 + cosine < TINY:  # straight back: half a turn about the first axis
        return np.asarray(2 * np.outer(frame[:, 0], frame[:, 0]) - np.eye(3))
    sine = np.outer(after, before) - np.outer(before, after)
    return np.asarray(np.eye(3) + sine + sine @ sine / (1 + cosine))
