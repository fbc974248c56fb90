"""Tell for each segment of a chain whether depth readings support it, or whether its depth was interpolated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..types import Bools, Floats, Foreground
from .noise import DEVIATIONS, MAD_TO_DEVIATION

POSITIONS = (np.arange(5) + 0.5) / 5
"""Fractions of a segment's length at which its readings are taken."""

LATERAL_RADII = np.linspace(-0.7, 0.7, 5)
"""Radii to the side of the axis at which readings are taken; nearer to the silhouette, readings mix with the background."""

SURFACE_RADII = 0.85
"""Radii by which the seen surface is nearer than the axis, mean over LATERAL_RADII: of sqrt(1 - x^2)."""

MIN_TOLERANCE_RADII, MAX_TOLERANCE_RADII = 1.2, 2.5
"""Radii by which a reading may differ from the surface and still support it. The least is that of visibility: a table under the
object is two radii behind the surface. The most is where `strand_filter` takes a reading for that of something else."""

MIN_SUPPORT = 0.3
"""Share of a segment's samples that need a reading which agrees: a curve through fewer is an interpolation."""

MIN_READINGS = 3
"""Readings of a segment that make a median."""


class DepthSupport(NamedTuple):
    """How well the depth readings support the N segments of a chain.

    Attributes
    ----------
    share
        (N,) share of a segment's samples with a reading of the object that agrees with the segment within the least tolerance.
    is_filled
        (N,) bool, True for a segment whose depth was interpolated, since too few readings agree with it.
    residual
        (N,) radii, median difference of a segment's readings from its surface, absolute; NaN with fewer than 3 readings.
    """

    share: Floats
    is_filled: Bools
    residual: Floats


def depth_is_filled(joints: Floats, radius: float, foreground: Foreground) -> Bools:
    """Tell which segments have a depth that was interpolated along the strand, since no readings support it.

    See `depth_support`; the arguments are the same. Returns (N,) bool; all False in 2-D and for a cloud, whose points are all
    measured.
    """
    support = depth_support(joints, radius, foreground)
    return np.zeros(len(joints) - 1, dtype=bool) if support is None else support.is_filled


def depth_support(joints: Floats, radius: float, foreground: Foreground) -> DepthSupport | None:
    """Return how well the depth readings support the segments of a chain; None in 2-D and for a cloud.

    A segment is supported if enough pixels of the strip that it covers in the image are in the mask and have a reading, as the
    sensor gave it, that agrees with the segment's surface. So a strand below another one is not supported where they cross, nor
    is a strand where the sensor's depth is torn or missing and was interpolated.

    Parameters
    ----------
    joints
        (N + 1, 3) m in the camera's optical frame, the joints of a chain; (N + 1, 2) px in 2-D.
    radius
        radius of the chain, m (px in 2-D).
    foreground
        the mask, the depth and the camera of the frame.
    """
    if foreground.camera is None or foreground.depth is None or foreground.mask is None:
        return None
    axis = joints[:-1, None] + POSITIONS[:, None] * np.diff(joints, axis=0)[:, None]
    z = axis[..., 2]
    centers = foreground.camera.project(axis.reshape(-1, 3)).reshape(*axis.shape[:2], 2)
    in_view = np.asarray(np.isfinite(centers).all(axis=(1, 2)))
    along = centers[:, -1] - centers[:, 0]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    lateral = np.column_stack((-along[:, 1], along[:, 0]))
    offset = (radius * foreground.camera.fx / z)[..., None] * LATERAL_RADII
    pixels = centers[:, :, None] + offset[..., None] * lateral[:, None, None]
    u, v = np.rint(np.where(in_view[:, None, None, None], pixels, -1.0)).astype(int).transpose(3, 0, 1, 2)
    height, width = foreground.mask.shape
    inside = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    u, v = np.where(inside, u, 0), np.where(inside, v, 0)
    reading = foreground.depth[v, u]
    measured = np.asarray(inside & foreground.mask[v, u] & (reading > 0))
    error = reading - (z[..., None] - SURFACE_RADII * radius)
    residual = np.abs(error)
    deviation = MAD_TO_DEVIATION * float(np.median(residual[measured])) if measured.any() else 0.0
    least, most = MIN_TOLERANCE_RADII * radius, MAX_TOLERANCE_RADII * radius
    agreeing = measured & (residual < min(max(DEVIATIONS * deviation, least), most))
    of_segment = np.sort(np.where(measured, error, np.inf).reshape(len(error), -1), axis=1)
    count = measured.sum(axis=(1, 2))
    rows = np.arange(len(count))
    lower, upper = np.maximum(count - 1, 0) // 2, np.minimum(count // 2, of_segment.shape[1] - 1)
    middle = (of_segment[rows, lower] + of_segment[rows, upper]) / 2
    median = np.where(count >= MIN_READINGS, np.abs(middle) / radius, np.nan)
    share = (measured & (residual < least)).mean(axis=(1, 2))
    return DepthSupport(np.asarray(share), np.asarray(agreeing.mean(axis=(1, 2)) < MIN_SUPPORT), median)
