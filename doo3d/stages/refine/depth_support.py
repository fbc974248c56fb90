"""Tell for each segment of a chain whether depth readings support it, or whether its depth was interpolated."""

from __future__ import annotations

import numpy as np

from ...types import Bools, Floats, Foreground

POSITIONS = (np.arange(5) + 0.5) / 5
"""Fractions of a segment's length at which its readings are taken."""

LATERAL_RADII = np.linspace(-0.7, 0.7, 5)
"""Radii to the side of the axis at which readings are taken; nearer to the silhouette, readings mix with the background."""

SURFACE_RADII = 0.85
"""Radii by which the seen surface is nearer than the axis, mean over LATERAL_RADII: of sqrt(1 - x^2)."""

MIN_TOLERANCE_RADII, MAX_TOLERANCE_RADII = 1.2, 2.5
"""Radii by which a reading may differ from the surface and still support it. The least is that of visibility: a table under the
object is two radii behind the surface. The most is where `strand_filter` takes a reading for that of something else."""

TOLERANCE_DEVIATIONS = 3.0
"""Standard deviations of the readings on the whole chain that the tolerance is, between these limits: noise is no error."""

MIN_SUPPORT = 0.3
"""Share of a segment's samples that need a reading which agrees: a curve through fewer is an interpolation."""

MAD_TO_DEVIATION = 1.4826
"""Standard deviations per median absolute deviation of normal errors."""


def depth_is_filled(joints: Floats, radius: float, foreground: Foreground) -> Bools:
    """Tell which segments have a depth that was interpolated along the strand, since no readings support it.

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

    Returns
    -------
    (N,) bool; all False in 2-D and for a cloud, whose points are all measured.
    """
    if foreground.camera is None or foreground.depth is None or foreground.mask is None:
        return np.zeros(len(joints) - 1, dtype=bool)
    axis = joints[:-1, None] + POSITIONS[:, None] * np.diff(joints, axis=0)[:, None]
    z = axis[..., 2]
    centers = foreground.camera.project(axis.reshape(-1, 3)).reshape(*axis.shape[:2], 2)
    in_view = np.isfinite(centers).all(axis=(1, 2))
    along = centers[:, -1] - centers[:, 0]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    lateral = np.column_stack((-along[:, 1], along[:, 0]))
    offset = (radius * foreground.camera.fx / z)[..., None] * LATERAL_RADII
    pixels = centers[:, :, None] + offset[..., None] * lateral[:, None, None]
    u, v = np.rint(np.where(in_view[:, None, None, None], pixels, -1.0)).astype(int).transpose(3, 0, 1, 2)
    height, width = foreground.mask.shape
    measured = np.asarray((u >= 0) & (v >= 0) & (u < width) & (v < height))
    u, v = np.where(measured, u, 0), np.where(measured, v, 0)
    reading = foreground.depth[v, u]
    measured &= foreground.mask[v, u] & (reading > 0)
    residual = np.abs(reading - (z[..., None] - SURFACE_RADII * radius))
    deviation = MAD_TO_DEVIATION * float(np.median(residual[measured])) if measured.any() else 0.0
    tolerance = min(max(TOLERANCE_DEVIATIONS * deviation, MIN_TOLERANCE_RADII * radius), MAX_TOLERANCE_RADII * radius)
    return np.asarray((measured & (residual < tolerance)).mean(axis=(1, 2)) < MIN_SUPPORT)
