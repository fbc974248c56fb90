"""Depth along the strands of a mask, smoothed over their length where it is torn or noisy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from ...geometry.mask import bounding_box
from ...geometry.polyline import whittaker_smooth
from ...kernels import nearest, neighbor_table, thin_pixels, trace_branches
from ...types import Bools, Camera, Floats, Ints
from .depth_filter import Readings

NEARER_SHARE = 0.35
MEDIAN_RADII = 12.0
OUTLIER_DEVIATIONS = 4.0
SMOOTHING_RADII, SMOOTHING_NOISE_RADII = 2.4, 0.15
ITERATIONS = 4
MAD_TO_DEVIATION = 1.4826
BRIDGED_PX = 1.5
BRIDGED_PLACES = 4
BRIDGE_RADII = 0.4
MAX_BRIDGE_RADII = 2.0
FLOOR_WEIGHT = 1e-3
MIN_LENGTH_PX = 12
MAX_DEVIATION_RADII = 0.4
"""Radii; where the depth along a strand deviates by less from a smooth curve, it is left as it is."""


def filter_along_strands(readings: Readings, mask: Bools, radius: float, camera: Camera) -> tuple[Readings, Floats]:
    if not len(readings.pixels) or not radius:
        return readings, np.zeros((0, 3))
    focal = camera.fx
    rows, columns = bounding_box(mask)
    coords = np.argwhere(mask[rows, columns]) + 1
    skeleton = coords[thin_pixels(coords)]
    _, order, bounds, _ = trace_branches(neighbor_table(np.column_stack((skeleton, np.ones(len(skeleton), dtype=np.int64)))))
    if not len(order):
        return readings, np.zeros((0, 3))
    line = skeleton[order][:, ::-1] + (columns.start - 1, rows.start - 1)
    reach = 3 * radius * focal / float(np.median(readings.depth))
    offset, near = nearest(readings.pixels.astype(float), line.astype(float), max(reach, 3.0), False)
    inverse = 1 / readings.depth
    value, count = _nearer_quantiles(inverse, near, len(line))
    smooth = np.zeros(len(line))
    for start, stop in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        measured = count[start:stop] > 0
        if np.count_nonzero(measured) < MIN_LENGTH_PX:
            continue
        found, deviation = _smoothed(value[start:stop], measured, radius * focal * float(np.median(value[start:stop][measured])), focal)
        z = 1 / found
        worst = np.abs(1 / np.where(measured, value[start:stop], found) - z)
        if np.mean(worst > MAX_DEVIATION_RADII * radius) > 0.05:
            smooth[start:stop] = z
    own = smooth[near]
    readings = readings._replace(filtered=np.where(own > 0, own, readings.filtered))
    branch = np.searchsorted(bounds, near, side="right")
    return readings, _bridges(readings, near + 10 * branch, offset <= BRIDGED_PX, mask.shape[1], camera, radius)


def _bridges(readings: Readings, place: Ints, middle: Bools, width: int, camera: Camera, radius: float) -> Floats:
    """Return points between neighboring pixels in the middle of a strand that lie far apart, since the strand runs away steeply."""
    key = readings.pixels[:, 1] * width + readings.pixels[:, 0]
    points = camera.unproject(readings.pixels, readings.filtered)
    bridges = []
    for step in (1, width, width + 1, width - 1):
        other = np.minimum(np.searchsorted(key, key + step), len(key) - 1)
        pair = middle & middle[other] & (key[other] == key + step) & (np.abs(place[other] - place) <= BRIDGED_PLACES)
        gap = np.where(pair, np.linalg.norm(points[other] - points, axis=1), 0.0)
        wide = np.flatnonzero((gap > BRIDGE_RADII * radius) & (gap < MAX_BRIDGE_RADII * radius))
        count = np.ceil(gap[wide] / (BRIDGE_RADII * radius)).astype(int)
        first = np.repeat(wide, count)
        number = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
        share = ((number + 0.5) / np.repeat(count, count))[:, None]
        bridges.append(points[first] * (1 - share) + points[other[first]] * share)
    return np.concatenate(bridges)


def _nearer_quantiles(inverse: Floats, sample: Ints, size: int) -> tuple[Floats, Ints]:
    order = np.lexsort((inverse, sample))
    count = np.bincount(sample, minlength=size)
    last = np.cumsum(count) - 1
    index = last - np.floor(NEARER_SHARE * np.maximum(count - 1, 0)).astype(int)
    return np.where(count > 0, inverse[order][np.maximum(index, 0)], 0.0), count


def _smoothed(value: Floats, measured: Bools, radius_px: float, focal: float) -> tuple[Floats, float]:
    at = np.flatnonzero(measured)
    first = np.interp(np.arange(len(value)), at, value[at])
    half = max(2, round(MEDIAN_RADII * radius_px))
    smooth = base = median_filter(first, 2 * min(half, len(value) // 4) + 1, mode="nearest")
    deviation = 0.0
    for _ in range(ITERATIONS):
        residual = value - smooth
        deviation = MAD_TO_DEVIATION * float(np.median(np.abs(residual[at])))
        noise = deviation / float(np.median(smooth)) ** 2 / (radius_px / focal / float(np.median(smooth)))
        inlier = np.maximum(0.0, 1 - (residual / max(OUTLIER_DEVIATIONS * deviation, 1e-12)) ** 2) ** 2 * measured
        length = SMOOTHING_RADII * np.sqrt(max(noise, SMOOTHING_NOISE_RADII) / SMOOTHING_NOISE_RADII) * radius_px
        weight = inlier + FLOOR_WEIGHT
        target = (inlier * value + FLOOR_WEIGHT * base) / weight
        smooth = whittaker_smooth(target[:, None], weight[:, None, None], length**4)[:, 0]
    return smooth, deviation
