"""How noisy the depth is, and the window in which its noise averages away."""

from __future__ import annotations

import math

import numpy as np

from ...config import SegmentConfig
from ...geometry.mask import bounding_box, mask_radius
from ...types import Array, Bools, Frame

FAR = 5.0
"""Times the usual difference of readings side by side by which a reading may differ from another and be averaged with it."""


ALIKE = 4
"""Neighbouring readings that err alike, so that only as many fewer are averaged: those of a stereo camera do over 2 px."""


MOST = 20
"""px; half the widest window."""


MAX_DEPTH_ERROR_RADII = 0.3
"""Radii; largest error of the averaged depth: less than half a voxel, so that noise breaks no strand apart."""


def roughness(depth: Array, mask: Bools) -> float:
    """How far readings beside each other in the mask (H, W) usually are apart, m: the median along the rows of depth (H, W) m.

    What stands out by a few times that is no noise; farther away, where a stereo camera reads worse, it is more.
    """
    if not mask.any():
        return 0.0
    box = bounding_box(mask)
    seen = np.where(mask[box], depth[box], 0)
    both = (seen[:, 1:] > 0) & (seen[:, :-1] > 0)
    return float(np.median(np.abs(np.diff(seen, axis=1)[both]))) if both.any() else 0.0


def steady_half(error: float, mask: Bools, frame: Frame, config: SegmentConfig) -> int:
    """Half the width, px, of the window over which depth must be averaged to be known within `filtered` radii of the object.

    error : m, as of `roughness`. The window holds as much of a strand as its width lets it.
    """
    radius = mask_radius(mask, frame.depth, frame.camera.fx)
    seen = frame.depth[mask]
    if not (radius and error):
        return 0
    width = 2 * radius * frame.camera.fx / float(np.median(seen[seen > 0]))
    readings = ALIKE * (1.2 * error / (MAX_DEPTH_ERROR_RADII * radius)) ** 2
    return min(MOST, math.ceil(readings / width / 2))
