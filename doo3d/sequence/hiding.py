"""Move hidden parts of an object behind what hides them: a joint that a frame does not show is not in plain view."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..geometry.curves import runs
from ..kernels import fit_joints
from ..types import Bools, Floats
from .background import BackgroundView
from .registration import PLACE_WEIGHT, TOLERANCE_SHARE, TURN_WEIGHT, to_lengths
from .tips import occluder_margin


def behind_occluders(joints: Floats, seen: Bools, view: BackgroundView, length: float, radius: float) -> Floats:
    """Return the joints of an object with hidden parts moved out of plain view.

    A hidden joint in plain view is moved in the image to the nearest place that something hides, and the object is fitted to it
    and to what is seen, as to strands. Parts that nothing near hides stay: there the frame lost its depth, or the object.

    Parameters
    ----------
    joints
        (M + 1, 3) m, in the camera's frame.
    seen
        (M + 1,) bool, which joints the frame shows.
    view
        what lies behind and before the object, a small image.
    length, radius
        of the object, m.
    """
    moved = joints.copy()
    margin, inverse = occluder_margin(radius), view.inverse.astype(float)
    focal, middle = view.intrinsics[:2], view.intrinsics[2:]
    pixels = joints[:, :2] / np.maximum(joints[:, 2:], margin) * focal + middle
    rows, columns = np.rint(pixels[:, ::-1]).astype(np.int64).T
    height, width = inverse.shape
    inside = (joints[:, 2] > margin) & (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    for first, end in runs(~seen):
        nearest = float(np.median(joints[first:end, 2])) - margin
        hides = inverse > 1 / max(nearest, margin)
        at = first + np.flatnonzero(inside[first:end])
        place = rows[at], columns[at]
        at = at[(inverse[place] > 0) & ~hides[place] & (view.gray[place] > 0)]
        if not len(at) or not hides.any():
            continue
        to = distance_transform_edt(~hides, return_distances=False, return_indices=True)[::-1, rows[at], columns[at]].T
        off = (to - pixels[at]) * joints[at, 2:] / focal
        near = np.linalg.norm(off, axis=1) <= TOLERANCE_SHARE * length
        moved[at[near], :2] += off[near]
    is_moved = (moved != joints).any(axis=1)
    if not is_moved.any():
        return joints
    known = np.flatnonzero(seen | is_moved)
    segment = length / (len(joints) - 1)
    samples = moved[known], known * segment, np.zeros((len(known), 3))
    return to_lengths(fit_joints(joints, *samples, segment, TURN_WEIGHT, PLACE_WEIGHT), segment, seen)
