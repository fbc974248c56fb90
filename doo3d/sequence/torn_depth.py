"""Find which readings along an object are its own, from all frames of a stretch together.

Before a stereo camera most readings on a thin strand can be of what lies behind it, in runs that are as smooth as the strand. No
frame tells by itself which are its own; but those are where they are in other frames too, nothing lies before them but what hides
the object, and the object is not longer than it is. So the nearest readings of a few frames around give a first estimate, and
what agrees with it and with a smooth motion the next ones, while readings that are off count less and less (graduated
non-convexity; Black and Rangarajan, IJCV 1996).
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..types import Floats
from .depth_in_time import OUTLIER_DEVIATIONS, UNSEEN_WEIGHT, AcrossSight, agreement, variance

OFF = 0.08
"""Share of the range by which readings may be off the first estimate, and from which on the depth of a frame is wrong: several
times the waves of a stereo camera, and less than what lies behind is far. Each round allows half as much as the last one."""

ROUNDS = 6
"""Rounds in which readings are weighed: then what is allowed is the noise."""

NEAREST_SHARE, AROUND = 0.2, 4
"""Share of the readings of the frames around that are nearer than the first estimate; and frames on either side."""

LEAST_READINGS = 4
"""Readings from which on the nearest of them are an estimate."""

APART_RADII = 5.0
"""Radii behind the first estimate from which on a surface behind is told from it: twice those at which a reading contradicts a
chain."""


def put_right(
    inverse: Floats, weight: Floats, rays: Floats, readings: Floats, radius: float, longest: float
) -> tuple[Floats, Floats]:
    """Return what frames say of the inverse range of an object, with what the readings of all frames contradict put right.

    Parameters
    ----------
    inverse, weight, rays
        (T, K) 1/m, (T, K) and (T, K, 3), as of `smooth_in_time`: what the frames say by themselves.
    readings
        (2, T, K, R) 1/m, from `readings_along`: of the object, and of what is seen beside it; NaN in frames that need none.
    radius, longest
        m, of the object: its radius and its length.

    Returns
    -------
    inverse, weight : (T, K), those of readings that agree with other frames in place of what is wrong.
    """
    own = _before_what_lies_behind(readings[0], readings[1], radius)
    first = _nearest(own)
    if not np.isfinite(first).any():
        return inverse, weight
    agreed = _agreed(own, first, inverse, weight, rays, longest)
    fits = np.abs(own - agreed[:, :, None]) < OFF * agreed[:, :, None]
    count = fits.sum(axis=2)
    mean = np.where(count > 0, np.where(fits, own, 0.0).sum(axis=2) / np.maximum(count, 1), agreed)
    is_wrong = (weight > 0) & (np.abs(inverse - agreed) > OFF * agreed)
    seen = np.maximum(UNSEEN_WEIGHT, count / own.shape[2])
    return np.where(is_wrong, mean, inverse), np.where(is_wrong, seen, weight)


def _before_what_lies_behind(own: Floats, behind: Floats, radius: float) -> Floats:
    """Return readings (T, K, R) 1/m, NaN for those that are nearer to what lies behind the object than to the object."""
    kept = own
    for _ in range(2):
        first = _nearest(kept)[:, :, None]
        is_behind = (own < (first + behind) / 2) & (first - behind > APART_RADII * radius * first**2)
        kept = np.where(is_behind, np.nan, own)
    return kept


def _nearest(readings: Floats) -> Floats:
    """Return the readings (T, K, R) than which NEAREST_SHARE of those around are nearer: (T, K), NaN where there are few."""
    around = np.pad(readings, ((AROUND, AROUND), (1, 1), (0, 0)), constant_values=np.nan)
    windows = sliding_window_view(around, (2 * AROUND + 1, 3), axis=(0, 1)).reshape(*readings.shape[:2], -1)
    ordered = np.sort(windows, axis=2)
    count = np.isfinite(ordered).sum(axis=2)
    at = np.ceil((1 - NEAREST_SHARE) * np.maximum(count - 1, 0)).astype(np.int64)
    nearest = np.take_along_axis(ordered, at[:, :, None], axis=2)[:, :, 0]
    return np.where(count >= LEAST_READINGS, nearest, np.nan)


def _agreed(own: Floats, first: Floats, inverse: Floats, weight: Floats, rays: Floats, longest: float) -> Floats:
    """Return the inverse range (T, K) 1/m on which the readings (T, K, R) of all frames agree.

    first : (T, K), first estimate, NaN where there is none. inverse, weight : (T, K), what frames say by themselves, which counts
    UNSEEN_WEIGHT in those with readings.
    """
    known, has = np.isfinite(first), np.isfinite(own)
    is_read = np.asarray(has.any(axis=(1, 2)))
    given = np.where(is_read[:, None], np.minimum(weight, UNSEEN_WEIGHT), weight)
    scale = float(np.median(first[known]))
    across, per_node = AcrossSight.of(rays), own.shape[2]
    places = (np.arange(per_node) + 0.5) / per_node - 0.5
    values, by_frame = np.nan_to_num(own) / scale, inverse / scale
    start = np.where(known, np.nan_to_num(first) / scale, by_frame)
    smooth = across.smoothed(start, np.where(known, 1.0, given), OFF**2)
    allowed = OFF
    for _ in range(ROUNDS):
        off = values - smooth[:, :, None] - np.gradient(smooth, axis=1)[:, :, None] * places
        counts = has * agreement(off, allowed)
        off_by_frame = by_frame - smooth
        by_frame_counts = given * agreement(off_by_frame, allowed)
        pull = (counts * off).sum(axis=2) / per_node + by_frame_counts * off_by_frame
        share = counts.sum(axis=2) / per_node + by_frame_counts
        target = smooth + pull / np.maximum(share, np.finfo(float).tiny)
        noise = (allowed / OUTLIER_DEVIATIONS / 2) ** 2  # half as much for a node, whose readings err alike, as for a reading
        smooth = across.smoothed(target, share, noise, smooth, longest * scale)
        allowed = max(allowed / 2, OUTLIER_DEVIATIONS * float(np.sqrt(variance(off[counts > 0.25]))))
    return np.asarray(smooth * scale)
