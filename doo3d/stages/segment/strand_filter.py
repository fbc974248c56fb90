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
OUTLIER_RADII = 2.5
SMOOTHING_RADII, SMOOTHING_NOISE_RADII = 2.4, 0.15
ITERATIONS = 4
MAD_TO_DEVIATION = 1.4826
BRIDGED_PX = 1.5
BRIDGED_PLACES = 4
MIN_BRIDGE_RADII, BRIDGE_RADII = 0.7, 0.4
MAX_BRIDGE_RADII = 2.0
FLOOR_WEIGHT = 1e-3
MIN_LENGTH_PX = 12
MAX_NOISE_RADII, MAX_TORN_SHARE = 0.35, 0.05
"""Radii; where the depth along a strand deviates by less from a smooth curve, it is left as it is."""


def filter_along_strands(readings: Readings, mask: Bools, radius: float, camera: Camera, depth_image) -> tuple[Readings, Floats]:
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
        behind = 1 / np.where(measured, value[start:stop], found) - z
        noise = _waves(behind, max(1, round(radius * focal / float(np.median(z)))))
        if noise > MAX_NOISE_RADII * radius or np.mean(behind > OUTLIER_RADII * radius) > MAX_TORN_SHARE:
            z = _lowered(z, noise, line[start:stop], mask, depth_image, radius, focal)
            smooth[start:stop] = z
    own = smooth[near]

    readings = readings._replace(filtered=np.where(own > 0, own, readings.filtered))
    readings = readings._replace(depth=np.where(own > 0, own, readings.depth))
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
        wide = np.flatnonzero((gap > MIN_BRIDGE_RADII * radius) & (gap < MAX_BRIDGE_RADII * radius))
        count = np.ceil(gap[wide] / (BRIDGE_RADII * radius)).astype(int)
        first = np.repeat(wide, count)
        number = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
        share = ((number + 0.5) / np.repeat(count, count))[:, None]
        bridges.append(points[first] * (1 - share) + points[other[first]] * share)
    return np.concatenate(bridges)


def _lowered(z: Floats, noise: float, line: Floats, mask: Bools, depth: Floats, radius: float, focal: float) -> Floats:
    if noise < 0.5 * radius or len(z) < 30:
        return z
    step = np.gradient(line.astype(float), axis=0)
    from scipy.ndimage import uniform_filter1d
    step = uniform_filter1d(step, 9, axis=0, mode="nearest")
    side = np.column_stack((-step[:, 1], step[:, 0])) / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-9)
    radius_px = radius * focal / z
    offsets = radius_px[:, None] + np.linspace(4, 14, 6)
    at = line[:, None, None] + side[:, None, None] * (offsets[:, None] * np.array((-1, 1))[:, None])[..., None]
    u, v = np.rint(at[..., 0]).astype(int), np.rint(at[..., 1]).astype(int)
    inside = (u >= 0) & (v >= 0) & (u < mask.shape[1]) & (v < mask.shape[0])
    u, v = np.where(inside, u, 0), np.where(inside, v, 0)
    values = np.where(inside & ~mask[v, u] & (depth[v, u] > 0), depth[v, u], np.nan).reshape(len(z), -1)
    known = np.isfinite(values).any(axis=1)
    if known.mean() < 0.5:
        return z
    sides = np.full(len(z), np.nan)
    sides[known] = np.nanmedian(values[known], axis=1)
    index = np.arange(len(z))
    ground = np.interp(index, index[known], sides[known])
    weight = np.ones(len(z))
    size = max(21, round(60))
    for _ in range(4):
        fit = whittaker_smooth(ground[:, None], weight[:, None, None], float(size) ** 4)[:, 0]
        residual = ground - fit
        weight = 1 / (1 + (residual / max(2 * MAD_TO_DEVIATION * float(np.median(np.abs(residual))), 1e-6)) ** 2)
    height = fit - z - 1.6 * radius
    pull = noise**2 / (noise**2 + radius**2) / (1 + (height / (2.5 * noise)) ** 2)
    return z + uniform_filter1d(pull, 15, mode="nearest") * height


def _waves(residual: Floats, window: int) -> float:
    """Return the standard deviation of the residuals averaged over a window: the noise that does not average away."""
    from scipy.ndimage import uniform_filter1d
    mean = uniform_filter1d(residual, 2 * window + 1, mode="nearest")
    return MAD_TO_DEVIATION * float(np.median(np.abs(mean)))


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
        cut = max(OUTLIER_DEVIATIONS * deviation, OUTLIER_RADII * radius_px * float(np.median(smooth)) / focal)
        inlier = np.maximum(0.0, 1 - (residual / cut) ** 2) ** 2 * measured
        length = SMOOTHING_RADII * np.sqrt(max(noise, SMOOTHING_NOISE_RADII) / SMOOTHING_NOISE_RADII) * radius_px
        weight = inlier + FLOOR_WEIGHT
        target = (inlier * value + FLOOR_WEIGHT * base) / weight
        smooth = whittaker_smooth(target[:, None], weight[:, None, None], length**4)[:, 0]
    return smooth, deviation
