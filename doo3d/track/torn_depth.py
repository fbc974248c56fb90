"""Correct torn depth along an object by the readings of all frames of a stretch.

A stereo camera may measure the background in place of a thin strand over most of its length, in runs as smooth as the strand. One
frame does not tell the two apart. Several frames do: readings of the strand agree from frame to frame, nothing but an occluder is
nearer, and the object has a known length. So a quantile of the nearest readings in a window of frames is the first estimate. Then
a smooth motion is fitted to the readings in rounds, and each round trusts those farther off less (graduated non-convexity; Black
and Rangarajan, IJCV 1996).
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..geometry.noise import OUTLIER_DEVIATIONS
from ..types import Floats
from .inverse_range_smoother import UNSEEN_WEIGHT, TransverseMotion, geman_mcclure, variance

MAX_DEPTH_ERROR = 0.08
"""Error of depth, as a share of the range, at which a reading weighs a quarter in the first round, half as much in each next one;
and from which on the depth of a frame is replaced: several times the waves of a stereo camera. Of 1,200 frames before one, 0.06
and 0.1 make as many right, by 3."""

ROUNDS = 6
"""Rounds of weighing: after 6 the error that is allowed is the noise."""

NEAR_QUANTILE, WINDOW_FRAMES = 0.2, 4
"""Share of the readings in a window that are nearer than the first estimate, and frames of the window on either side."""

MIN_READINGS = 4
"""Fewest readings in a window that give an estimate."""

BACKGROUND_GAP_RADII = 5.0
"""Smallest distance of the background behind the first estimate, in radii, at which the two are told apart: twice the distance at
which a reading contradicts a chain."""


def correct_torn_depth(
    inverse: Floats, weight: Floats, rays: Floats, readings: Floats, radius: float, longest: float
) -> tuple[Floats, Floats]:
    """Replace the inverse range of an object where the readings of all frames contradict it.

    Parameters
    ----------
    inverse, weight, rays
        (T, K) 1/m, (T, K) and (T, K, 3), as of `smooth_in_time`: as detected in each frame by itself.
    readings
        (2, T, K, R) 1/m, from `readings_along`: of the object, and of the background beside it; NaN in frames without torn depth.
    radius, longest
        m, of the object: its radius and its length.

    Returns
    -------
    inverse, weight : (T, K), as given, or from the readings that agree with other frames.
    """
    own = _drop_background(readings[0], readings[1], radius)
    first = _near_quantile(own)
    if not np.isfinite(first).any():
        return inverse, weight
    agreed = _consensus(own, first, inverse, weight, rays, longest)
    fits = np.abs(own - agreed[:, :, None]) < MAX_DEPTH_ERROR * agreed[:, :, None]
    count = fits.sum(axis=2)
    mean = np.where(count > 0, np.where(fits, own, 0.0).sum(axis=2) / np.maximum(count, 1), agreed)
    is_wrong = (weight > 0) & (np.abs(inverse - agreed) > MAX_DEPTH_ERROR * agreed)
    seen = np.maximum(UNSEEN_WEIGHT, count / own.shape[2])
    return np.where(is_wrong, mean, inverse), np.where(is_wrong, seen, weight)


def _drop_background(own: Floats, behind: Floats, radius: float) -> Floats:
    """Return readings (T, K, R) 1/m, NaN in place of those that are nearer to the background than to the object."""
    kept = own
    for _ in range(2):
        first = _near_quantile(kept)[:, :, None]
        is_behind = (own < (first + behind) / 2) & (first - behind > BACKGROUND_GAP_RADII * radius * first**2)
        kept = np.where(is_behind, np.nan, own)
    return kept


def _near_quantile(readings: Floats) -> Floats:
    """Return the quantile of the nearest readings (T, K, R) in the window around each place: (T, K), NaN where there are few."""
    around = np.pad(readings, ((WINDOW_FRAMES, WINDOW_FRAMES), (1, 1), (0, 0)), constant_values=np.nan)
    windows = sliding_window_view(around, (2 * WINDOW_FRAMES + 1, 3), axis=(0, 1)).reshape(*readings.shape[:2], -1)
    ordered = np.sort(windows, axis=2)
    count = np.isfinite(ordered).sum(axis=2)
    at = np.ceil((1 - NEAR_QUANTILE) * np.maximum(count - 1, 0)).astype(np.int64)
    nearest = np.take_along_axis(ordered, at[:, :, None], axis=2)[:, :, 0]
    return np.where(count >= MIN_READINGS, nearest, np.nan)


def _consensus(own: Floats, first: Floats, inverse: Floats, weight: Floats, rays: Floats, longest: float) -> Floats:
    """Return the inverse range (T, K) 1/m on which the readings (T, K, R) of all frames agree.

    first : (T, K), first estimate, NaN where there is none. inverse, weight : (T, K), as detected in each frame by itself; in
    frames with readings these weigh UNSEEN_WEIGHT.
    """
    known, has = np.isfinite(first), np.isfinite(own)
    is_read = np.asarray(has.any(axis=(1, 2)))
    given = np.where(is_read[:, None], np.minimum(weight, UNSEEN_WEIGHT), weight)
    scale = float(np.median(first[known]))
    across, per_node = TransverseMotion.of(rays), own.shape[2]
    places = (np.arange(per_node) + 0.5) / per_node - 0.5
    values, by_frame = np.nan_to_num(own) / scale, inverse / scale
    start = np.where(known, np.nan_to_num(first) / scale, by_frame)
    smooth = across.smooth(start, np.where(known, 1.0, given), MAX_DEPTH_ERROR**2)
    allowed = MAX_DEPTH_ERROR
    for _ in range(ROUNDS):
        off = values - smooth[:, :, None] - np.gradient(smooth, axis=1)[:, :, None] * places
        counts = has * geman_mcclure(off, allowed)
        off_by_frame = by_frame - smooth
        by_frame_counts = given * geman_mcclure(off_by_frame, allowed)
        pull = (counts * off).sum(axis=2) / per_node + by_frame_counts * off_by_frame
        share = counts.sum(axis=2) / per_node + by_frame_counts
        target = smooth + pull / np.maximum(share, np.finfo(float).tiny)
        noise = (allowed / OUTLIER_DEVIATIONS / 2) ** 2  # half as much for a node, whose readings err alike, as for a reading
        smooth = across.smooth(target, share, noise, smooth, longest * scale)
        allowed = max(allowed / 2, OUTLIER_DEVIATIONS * float(np.sqrt(variance(off[counts > 0.25]))))
    return np.asarray(smooth * scale)
