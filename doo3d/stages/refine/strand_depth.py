"""The depth of strands in a depth image, robustly estimated along their whole length: torn depth and noise bend them else.

A stereo camera's depth switches along a strand, in stretches, between the strand and what lies behind it, and its noise comes in
waves longer than the strand is thick. A path through such readings follows both. In the image the path is right, and a strand is
smooth; so its inverse depth, in which the noise of a stereo camera is the same everywhere, is smoothed along the path, and readings
that contradict the rest of the strand are left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from ...geometry.polyline import whittaker_smooth
from ...kernels import nearest
from ...types import Bools, Floats, Foreground
from .samples import Samples

CENTRAL_PART = 0.8
"""Radii from the path in the image within which readings count; farther out the surface falls away, and the depth is torn."""

NEARER_SHARE = 0.35
"""Quantile of the readings at a sample, from the nearest on, that stands for the strand: what is wrong lies mostly behind."""

MEDIAN_RADII = 15.0
"""Radii on either side of a sample over which the first estimate is a median."""

OUTLIER_DEVIATIONS = 4.0
"""Standard deviations from the smooth curve from which on a reading does not count."""

SMOOTHING_RADII, SMOOTHING_NOISE_RADII = 2.4, 0.15
"""Length in radii over which depth with the given noise, in radii, is smoothed; noisier depth over more, by the square root."""

ITERATIONS = 5

MAD_TO_DEVIATION = 1.4826
"""Standard deviations per median absolute deviation of normal errors."""

FLOOR_WEIGHT = 1e-3
"""Weight of the first estimate beside 1 of a reading, where there are no readings."""


def with_strand_depth(samples: Samples, foreground: Foreground) -> Samples:
    """Move samples along their lines of sight to the depth of the strand, robustly estimated along each path.

    Parameters
    ----------
    samples
        samples along all paths, m in the camera's optical frame.
    foreground
        the object's points, with their pixels, and the camera. Without these the samples are returned unchanged.

    Returns
    -------
    The samples with new positions, and with the noise of the depth.
    """
    camera, pixels = foreground.camera, foreground.pixels
    if camera is None or pixels is None or not len(pixels):
        return samples
    in_image = camera.project(samples.positions)
    radius_px = samples.radius * camera.fx / samples.positions[:, 2]
    depth = foreground.points[:, 2]
    offset, near = nearest(pixels.astype(float), np.ascontiguousarray(in_image), float(radius_px.max()), True)
    central = offset < CENTRAL_PART * radius_px[near]
    near, offset, depth = near[central], offset[central] / radius_px[near[central]], depth[central]
    inverse = 1 / (depth + samples.radius[near] * np.sqrt(1 - offset**2))
    value, count = _nearer_quantiles(inverse, near, len(in_image))
    positions, noise = samples.positions.copy(), np.zeros(len(in_image))
    for p, closed in enumerate(samples.closed):
        part = samples.of_path(p)
        measured = (count[part] > 0) & ~samples.filled[part]
        if closed or np.count_nonzero(measured) < 8:
            continue
        radius = float(samples.radius[part.start])
        smooth, deviation = _smoothed(value[part], measured, radius, samples.spacing)
        positions[part] *= (1 / smooth / positions[part, 2])[:, None]
        noise[part] = deviation / smooth**2
    import os
    if os.environ.get("DBG"): print("noise mm", [round(float(noise[samples.of_path(p)][0])*1e3,2) for p in range(len(samples.closed))], "r", round(float(samples.radius[0])*1e3,2))
    return replace(samples, positions=positions, depth_noise=noise)


def _nearer_quantiles(inverse: Floats, sample: Floats, size: int) -> tuple[Floats, Floats]:
    """Return of the inverse depths at each of so many samples the quantile of the nearer ones, 0 without any, and their number."""
    order = np.lexsort((inverse, sample))
    count = np.bincount(sample, minlength=size)
    last = np.cumsum(count) - 1
    index = last - np.floor(NEARER_SHARE * np.maximum(count - 1, 0)).astype(int)
    values = inverse[order][np.maximum(index, 0)] if len(order) else np.zeros(size)
    return np.where(count > 0, values, 0.0), count


def _smoothed(value: Floats, measured: Bools, radius: float, spacing: float) -> tuple[Floats, float]:
    """Return the smooth inverse depths (S,) along one path, and the standard deviation of those measured at its samples."""
    at = np.flatnonzero(measured)
    first = np.interp(np.arange(len(value)), at, value[at])
    half = max(2, round(MEDIAN_RADII * radius / spacing))
    smooth = median_filter(first, 2 * min(half, len(value) // 4) + 1, mode="nearest")
    base = smooth.copy()
    deviation = 0.0
    for _ in range(ITERATIONS):
        residual = value - smooth
        deviation = MAD_TO_DEVIATION * float(np.median(np.abs(residual[at])))
        noise = deviation / float(np.median(smooth)) ** 2 / radius
        inlier = np.maximum(0.0, 1 - (residual / max(OUTLIER_DEVIATIONS * deviation, 1e-12)) ** 2) ** 2 * measured
        length = SMOOTHING_RADII * np.sqrt(max(noise, SMOOTHING_NOISE_RADII) / SMOOTHING_NOISE_RADII) * radius
        weight = inlier + FLOOR_WEIGHT
        target = (inlier * value + FLOOR_WEIGHT * base) / weight
        smooth = whittaker_smooth(target[:, None], weight[:, None, None], (length / spacing) ** 4)[:, 0]
    return smooth, deviation
