"""Choose the segmentation method that fits the settings and the data."""

import math

import cv2
import numpy as np

from ...config import SegmentConfig
from ...scene.cloud_facts import CELL_SPACINGS, CloudFacts, longest_first, sampled, seeds_of, spreads
from ...types import Cloud, Frame, Image
from ..point_lines import is_sparse
from .network import IS_PACKAGED

MIN_DISC_OCCUPANCY = 0.6
"""Minimum fraction of occupied cells in the disc around a point of a cloud, for the point to lie on a surface."""

MIN_DISC_CELLS = 3
"""Minimum radius of that disc in cells. A strand fills two rows of cells through the middle of a disc: less than half of a disc
with a radius of three cells, all of a disc with a radius of one cell."""

DEPTH_STRIDE_PX = 4
"""Step in px between the rows and columns of a depth image that are examined: a surface wider than any object remains visible."""


def choose_method(data: Frame | Cloud | Image, config: SegmentConfig) -> str:
    """Return the name of the segmentation method that fits the settings and the data.

    "hsv" if color ranges are set, "background" if a reference image is set. Otherwise "network" for an image and for a frame with
    color, "strands" if no network is installed. Without color, "plane" for a scene of mostly wide surfaces such as a table, and
    "everything" for any other scene.
    """
    if config.ranges:
        return "hsv"
    if config.reference is not None:
        return "background"
    if not isinstance(data, Cloud) and data.color is not None:
        return "network" if IS_PACKAGED else "strands"
    return "plane" if is_broad(data, config) else "everything"


def is_broad(data: Frame | Cloud, config: SegmentConfig) -> bool:
    """Return whether more than half of the readings or points lie on surfaces wider than `config.max_width`, such as a table.

    False for data without readings, and if `config.max_width` is infinite.
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
    # the number of points is an upper bound of the number of occupied cells
    if not some.any() or np.mean(counts[some] > filled) <= 0.5:
        return False
    # in the plane of the first two principal axes, strands side by side have gaps between them, a surface has none
    axes = np.linalg.eigh(covariances)[1][:, :, 1:]
    begins, ends = np.searchsorted(points[:, 0], (seeds[:, 0] - radius, seeds[:, 0] + radius))
    is_filled = []
    for k in np.flatnonzero(some):
        offset = points[begins[k] : ends[k]] - seeds[k]
        offset = offset[(offset**2).sum(axis=1) <= radius**2]
        cells = np.floor((offset - means[k]) @ axes[k] / size)
        is_filled.append(len(np.unique(cells @ (1, 1j))) > filled)
    return float(np.mean(is_filled)) > 0.5 and not is_sparse(data.points)


def _is_broad_frame(frame: Frame, config: SegmentConfig) -> bool:
    """Return whether most readings of a frame lie farther than half of `config.max_width` from the edge of a surface.

    Gaps of one pixel between readings belong to a surface. A reading beyond `config.max_depth` counts as one at that depth.
    """
    depth = frame.depth[::DEPTH_STRIDE_PX, ::DEPTH_STRIDE_PX]
    seen = depth > 0
    closed = cv2.morphologyEx(seen.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    inside = cv2.distanceTransform(np.pad(closed, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
    size = DEPTH_STRIDE_PX / frame.camera.fx * np.minimum(depth, config.max_depth)
    wide = seen & (inside * size > config.max_width / 2)
    return bool(np.count_nonzero(wide) > np.count_nonzero(seen) / 2)
