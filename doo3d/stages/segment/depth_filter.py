"""Remove outliers from the depth of a mask, and average its noise away."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...config import SegmentConfig
from ...geometry.mask import bounding_box
from ...kernels import count_agreeing_neighbors, sigma_filter
from ...types import Array, Bools, Floats, Frame, Ints

OUTLIER_WINDOW_PX = 2
"""px; half-width of the window in which a depth reading is compared with its neighbors: 5 x 5, less than a thin cable."""

OUTLIER_NOISE_FACTOR = 3.0
"""Times the measured depth noise that `outlier_slope` is at least: three deviations."""

OUTLIER_MIN_NEIGHBORS = 7
"""Neighbors of the 24 in the window that must agree with a reading, or half of those there are; fewer make a flying point."""

SIGMA_FILTER_NOISE_FACTOR = 5.0
"""Times the depth noise by which a reading may differ from another and still be averaged with it."""

CORRELATED_READINGS = 4
"""Neighboring readings that err alike, so that averaging counts them as one: those of a stereo camera do over 2 px."""

NOISE_TO_DEVIATION = 1.2
"""Standard deviations per `depth_noise`: 1.05 for independent normal errors; neighbors err alike and so differ by less."""

MAX_FILTER_HALF_WIDTH_PX = 20
"""px; widest half-width of the window of the sigma filter."""

MAX_DEPTH_ERROR_RADII = 0.3
"""Radii; largest error of the averaged depth: less than half a voxel, so that noise breaks no strand apart."""


class Readings(NamedTuple):
    """Depth readings at N pixels of the object.

    Attributes
    ----------
    pixels
        (N, 2) int64 (u, v).
    depth
        (N,) m, as measured.
    filtered
        (N,) m, with the noise averaged away.
    """

    pixels: Ints
    depth: Floats
    filtered: Floats


def filter_readings(frame: Frame, mask: Bools, radius: float, config: SegmentConfig) -> tuple[Readings, float, int]:
    """Drop the outliers among the depth readings of a mask, and average the noise of the others away.

    A reading is kept if at least 7 of the 24 neighbors around it, or half of those that have a reading, agree with it. They
    agree if they differ by less than the slope below, per pixel of distance. The noise is averaged away over the neighbors that
    agree or, if it is large, by a sigma filter in a larger window.

    Parameters
    ----------
    frame
        the depth and the camera.
    mask
        (H, W) bool, the pixels of the object.
    radius
        m, half-width of the mask; 0 if unknown.
    config
        section `segment` of the settings: range of depths, `outlier_slope`.

    Returns
    -------
    readings : those kept, in row-major order of the pixels.
    slope : m per pixel, the largest depth step between neighboring readings that still counts as one surface.
    outliers : number of readings dropped, of those within the range of depths.
    """
    v, u = np.divmod(np.flatnonzero(mask), frame.camera.width)
    depth = frame.depth[v, u]
    in_range = (depth >= config.min_depth) & (depth <= config.max_depth)
    v, u = v[in_range], u[in_range]
    noise = depth_noise(frame.depth, mask)
    slope = max(config.outlier_slope, OUTLIER_NOISE_FACTOR * noise)
    agreeing, neighbors, mean = count_agreeing_neighbors(frame.depth, mask, v, u, OUTLIER_WINDOW_PX, slope)
    kept = agreeing >= np.minimum(OUTLIER_MIN_NEIGHBORS, neighbors / 2)
    u, v, mean = u[kept], v[kept], mean[kept]
    half_width = filter_half_width(frame, mask, radius, noise)
    if half_width > OUTLIER_WINDOW_PX:
        mean = sigma_filter(frame.depth, mask, v, u, half_width, SIGMA_FILTER_NOISE_FACTOR * noise)
    readings = Readings(np.column_stack((u, v)), frame.depth[v, u].astype(float), mean)
    return readings, slope, len(kept) - len(u)


def depth_noise(depth: Array, mask: Bools) -> float:
    """Return the depth noise in a mask, m: the median absolute difference of horizontally neighboring readings.

    It is 0 if no two readings are neighbors.

    Parameters
    ----------
    depth
        (H, W) m, 0 = no reading.
    mask
        (H, W) bool; only differences between two pixels in it count.
    """
    if not mask.any():
        return 0.0
    box = bounding_box(mask)
    readings = np.where(mask[box], depth[box], 0)
    both = (readings[:, 1:] > 0) & (readings[:, :-1] > 0)
    return float(np.median(np.abs(np.diff(readings, axis=1)[both]))) if both.any() else 0.0


def filter_half_width(frame: Frame, mask: Bools, radius: float, noise: float) -> int:
    """Return the half-width of the averaging window, in pixels, that brings the depth error down to 0.3 radii.

    The number of readings in the window is taken to be its length times the width of the strand. At most 20 px; 0 if the
    radius or the noise is unknown.

    Parameters
    ----------
    frame
        the depth and the camera.
    mask
        (H, W) bool, the pixels of the object.
    radius
        m, half-width of the mask; 0 if unknown.
    noise
        m, median depth difference of horizontal neighbors.
    """
    if not (radius and noise):
        return 0
    readings = frame.depth[mask]
    width = 2 * radius * frame.camera.fx / float(np.median(readings[readings > 0]))
    needed = CORRELATED_READINGS * (NOISE_TO_DEVIATION * noise / (MAX_DEPTH_ERROR_RADII * radius)) ** 2
    return min(MAX_FILTER_HALF_WIDTH_PX, math.ceil(needed / width / 2))
