"""Tell whether what was measured is mostly of wide surfaces, such as a table."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ..config import SegmentConfig
from ..scene.cloud_facts import CELL_SPACINGS, CloudFacts, longest_first, sampled, seeds_of, spreads
from ..types import Cloud, Frame
from .sparse_strands import is_sparse

MIN_BROAD_FRACTION = 0.5
"""A scene is broad when more than this fraction of it belongs to surfaces wider than `segment.max_width`."""

MIN_DISC_OCCUPANCY = 0.6
"""A point of a cloud lies on a surface when more than this fraction of the disc around it is occupied."""

MIN_DISC_CELLS = 3
"""Radius of that disc in cells at least. A strand fills two rows of cells through the middle of a disc: of a disc of three cells
radius less than half, of one of one cell all."""

DEPTH_STRIDE_PX = 4
"""px; every so many rows and columns of a depth image are looked at, since a surface wider than any object shows in them too."""


def is_broad(data: Frame | Cloud, config: SegmentConfig) -> bool:
    """Tell whether more than half of the readings or points lie on surfaces wider than `config.max_width`, such as a table.

    False for data without readings, and if objects of any width are looked for.
    """
    if not math.isfinite(config.max_width):
        return False
    if isinstance(data, Frame):
        return _is_broad_frame(data, config)
    points = longest_first(sampled(data.points))
    seeds, points = seeds_of(points), np.ascontiguousarray(points[np.argsort(points[:, 0])])
    size = CELL_SPACINGS * CloudFacts(points).spacing
    radius = max(config.max_width, MIN_DISC_CELLS * size)
    filled = MIN_DISC_OCCUPANCY * np.pi * radius**2 / size**2
    counts, means, covariances = spreads(points, seeds, radius)
    some = counts > 8
    # as many cells are occupied as there are points, at most
    if not some.any() or np.mean(counts[some] > filled) <= MIN_BROAD_FRACTION:
        return False
    # strands side by side leave gaps in the plane of the first two principal axes, a surface none
    axes = np.linalg.eigh(covariances)[1][:, :, 1:]
    begins, ends = np.searchsorted(points[:, 0], (seeds[:, 0] - radius, seeds[:, 0] + radius))
    is_filled = []
    for k in np.flatnonzero(some):
        offset = points[begins[k] : ends[k]] - seeds[k]
        offset = offset[(offset**2).sum(axis=1) <= radius**2]
        cells = np.floor((offset - means[k]) @ axes[k] / size)
        is_filled.append(len(np.unique(cells @ (1, 1j))) > filled)
    return float(np.mean(is_filled)) > MIN_BROAD_FRACTION and not is_sparse(data.points)


def _is_broad_frame(frame: Frame, config: SegmentConfig) -> bool:
    """Tell whether most readings of a frame lie farther than half of `config.max_width` from the edge of a surface.

    Gaps of one pixel between readings belong to a surface. Beyond `config.max_depth` a pixel has the size of one there.
    """
    depth = frame.depth[::DEPTH_STRIDE_PX, ::DEPTH_STRIDE_PX]
    seen = depth > 0
    closed = cv2.morphologyEx(seen.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    inside = cv2.distanceTransform(np.pad(closed, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
    size = DEPTH_STRIDE_PX / frame.camera.fx * np.minimum(depth, config.max_depth)
    wide = seen & (inside * size > config.max_width / 2)
    return bool(np.count_nonzero(wide) > MIN_BROAD_FRACTION * np.count_nonzero(seen))
