"""Remove outliers from the depth of a mask, and average its noise away."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...config import SegmentConfig
from ...kernels import agreeing_readings, depth_differences, sigma_filter
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
        (N,) m, z coordinate in the camera's optical frame, as measured.
    filtered
        (N,) m, the same with the noise averaged away.
    """

    pixels: Ints
    depth: Floats
    filtered: Floats


def filter_readings(
    frame: Frame, mask: Bools, radius: float, distance: float, config: SegmentConfig
) -> tuple[Readings, float, int]:
    """Drop the outliers among the depth readings of a mask, and average the noise of the remaining readings away.

    A reading is kept if it agrees with at least 7 of the 24 pixels around it, or with half of those in the mask that have a
    reading. Two readings agree if they differ by less than `slope` (see Returns) per pixel of distance between them. The noise is
    averaged away over the neighbors that agree or, if the noise is large, by a sigma filter in a larger window.

    Parameters
    ----------
    frame
        the depth and the camera.
    mask
        (H, W) bool, the pixels of the object.
    radius
        m, radius of the object; 0 if unknown.
    distance
        m, median depth of the object.
    config
        section `segment` of the settings: `min_depth`, `max_depth`, `outlier_slope`.

    Returns
    -------
    readings : the readings kept, in row-major order of their pixels.
    slope : m per pixel, the largest depth step between neighboring readings of one surface: `outlier_slope`, or three times the
        measured depth noise if that is more.
    outliers : number of readings in the mask, between `min_depth` and `max_depth`, that were dropped.
    """
    noise = depth_noise(frame.depth, mask)
    slope = max(config.outlier_slope, OUTLIER_NOISE_FACTOR * noise)
    v, u, mean, outliers = agreeing_readings(
        frame.depth, mask, config.min_depth, config.max_depth, OUTLIER_WINDOW_PX, slope, OUTLIER_MIN_NEIGHBORS
    )
    half_width = filter_half_width(distance, frame.camera.fx, radius, noise)
    if half_width > OUTLIER_WINDOW_PX:
        mean = sigma_filter(frame.depth, mask, v, u, half_width, SIGMA_FILTER_NOISE_FACTOR * noise)
    return Readings(np.column_stack((u, v)), frame.depth[v, u].astype(float), mean), slope, outliers


def depth_noise(depth: Array, mask: Bools) -> float:
    """Return the depth noise in a mask, m: the median absolute difference of horizontally neighboring readings.

    The result is 0 if no two readings are horizontal neighbors.

    Parameters
    ----------
    depth
        (H, W) m, 0 = no reading.
    mask
        (H, W) bool; only readings of pixels in the mask are compared.
    """
    differences = depth_differences(depth, mask)
    return float(np.median(differences)) if len(differences) else 0.0


def filter_half_width(distance: float, focal: float, radius: float, noise: float) -> int:
    """Return the half-width in px of the averaging window that brings the depth error down to 0.3 radii.

    The window is a square of 2 * half-width + 1 pixels. A strand crosses it, so the readings averaged are taken to number the
    window's length times the strand's width, both in pixels.

    Parameters
    ----------
    distance
        m, median depth of the object.
    focal
        px, focal length.
    radius
        m, radius of the object; 0 if unknown.
    noise
        m, depth noise as `depth_noise` measures it; 0 if it could not be measured.

    Returns
    -------
    Half-width in px, at most 20; 0 (no averaging) if `radius` or `noise` is 0.
    """
    if not (radius and noise):
        return 0
    width = 2 * radius * focal / distance
    needed = CORRELATED_READINGS * (NOISE_TO_DEVIATION * noise / (MAX_DEPTH_ERROR_RADII * radius)) ** 2
    return min(MAX_FILTER_HALF_WIDTH_PX, math.ceil(needed / width / 2))
