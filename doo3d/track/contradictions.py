"""Tell where the camera contradicts the shape of an object: where it should be in view, and another surface is seen."""

from __future__ import annotations

import cv2
import numpy as np

from ..camera.background import BackgroundView
from ..types import Bools, Floats
from .strand_ends import occluder_margin


def contradicted(joints: Floats, view: BackgroundView | None, radius: float) -> Bools:
    """Return which joints the camera contradicts, (M + 1,) bool.

    These are joints in front of the background, or on it, where no object is seen: neither they nor the cells of the view next to
    them are on an object or behind something nearer.

    Parameters
    ----------
    joints
        (M + 1, 3) m, in the camera frame.
    view
        small view of the background; None if unknown: nothing is contradicted.
    radius
        m, of the object; NaN if unknown.
    """
    if view is None:
        return np.zeros(len(joints), dtype=bool)
    fx, fy, cx, cy = view.intrinsics
    height, width = view.gray.shape
    depth = np.maximum(joints[:, 2], np.finfo(float).tiny)
    pixels = np.clip(np.rint(joints[:, :2] / depth[:, None] * (fx, fy) + (cx, cy)), -1, (width, height)).astype(int)
    inside = ((pixels >= 0) & (pixels < (width, height))).all(axis=1) & (joints[:, 2] > 0)
    column, row = np.where(inside[:, None], pixels, 0).T
    around = np.ones((3, 3), dtype=np.uint8)
    inverse = view.inverse.astype(np.float32)
    nearest = cv2.dilate(inverse, around)
    known = cv2.erode(((view.gray > 0) & (inverse > 0)).view(np.uint8), around) > 0
    return np.asarray(inside & known[row, column] & (nearest[row, column] * (depth - occluder_margin(radius)) < 1))
