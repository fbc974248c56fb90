"""Correct torn depth along an object by the readings of several frames.

A stereo camera may measure the background in place of a thin strand over most of its length, in runs as smooth as the strand.
One frame cannot distinguish the two. Several frames can: readings of the strand agree from frame to frame, nothing but an
occluder is nearer, and the object has a known length. So a quantile of the nearest readings in a window of frames is the first
estimate. Then a smooth motion is fitted to the readings in rounds, with a smaller limit for residuals in each round (graduated
non-convexity; Black and Rangarajan, IJCV 1996).
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..geometry.noise import OUTLIER_DEVIATIONS
from ..types import Floats
from .inverse_range_smoother import UNSEEN_WEIGHT, TransverseMotion, geman_mcclure, variance

MAX_DEPTH_ERROR = 0.08
"""Error of depth, relative to the range, at which a reading has a weight of 0.25 in the first round; the limit is halved in
each further round. Beyond this error the depth of a frame is replaced: several times the waves of a stereo camera. Of 1,200
frames of stereo cameras, 0.06 and 0.1 make the same number right, within 3."""

ROUNDS = 6
"""Rounds of reweighting: after 6 the limit is the noise."""

NEAR_QUANTILE, WINDOW_FRAMES = 0.2, 4
"""Fraction of the readings in a window that are nearer than the first estimate, and number of frames of the window on either
side."""

MIN_READINGS = 4
"""Smallest number of readings in a window for an estimate."""

BACKGROUND_GAP_RADII = 5.0
"""Smallest distance of the background behind the first estimate, in radii, at which the two are separated: twice the distance
at which a reading contradicts a chain."""


def correct_torn_depth(
    inverse: Floats, weight: Floats, rays: Floats, readings: Floats, radius: float, longest: float
) -> tuple[Floats, Floats]:
    """Replace the inverse range of an object where readings contradict it.

    Parameters
    ----------
    inverse, weight, rays
        (T, K) 1/m, (T, K) and (T, K, 3), as for `smooth_inverse_range`: as detected in each frame by itself.
    readings
        (2, T, K, R) 1/m, from `readings_along`: of the object, and of the background next to it; NaN in frames without torn
        depth.
    radius, longest
        m, radius and length of the object.

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
    """Return readings (T, K, R) 1/m, with NaN for those nearer to the background.

    own, behind : readings of the object, and of the background next to it. radius : of the object, m.
    """
    kept = own
    for _ in range(2):
        first = _near_quantile(kept)[:, :, None]
        is_behind = (own < (first + behind) / 2) & (first - behind > BACKGROUND_GAP_RADII * radius * first**2)
        kept = np.where(is_behind, np.nan, own)
    return kept


def _near_quantile(readings: Floats) -> Floats:
    """Return a quantile of the nearest readings around each place, (T, K).

    readings : (T, K, R) 1/m. NaN where the window has fewer than MIN_READINGS.
    """
    around = np.pad(readings, ((WINDOW_FRAMES, WINDOW_FRAMES), (1, 1), (0, 0)), constant_values=np.nan)
    windows = sliding_window_view(around, (2 * WINDOW_FRAMES + 1, 3), axis=(0, 1)).reshape(*readings.shape[:2], -1)
    ordered = np.sort(windows, axis=2)
    count = np.isfinite(ordered).sum(axis=2)
    at = np.ceil((1 - NEAR_QUANTILE) * np.maximum(count - 1, 0)).astype(np.int64)
    nearest = np.take_along_axis(ordered, at[:, :, None], axis=2)[:, :, 0]
    return np.where(count >= MIN_READINGS, nearest, np.nan)


def _consensus(own: Floats, first: Floats, inverse: Floats, weight: Floats, rays: Floats, longest: float) -> Floats:
    """Return the inverse range (T, K) 1/m on which the readings of all frames agree.

    Parameters
    ----------
    own
        (T, K, R) 1/m, the readings.
    first
        (T, K) 1/m, first estimate; NaN where there is none.
    inverse, weight
        (T, K), as detected in each frame by itself; in frames with readings the weight is at most UNSEEN_WEIGHT.
    rays, longest
        as for `correct_torn_depth`.
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
        noise = (allowed / OUTLIER_DEVIATIONS / 2) ** 2  # of a place: half that of a reading, since its errors are alike
        smooth = across.smooth(target, share, noise, smooth, longest * scale)
        allowed = max(allowed / 2, OUTLIER_DEVIATIONS * float(np.sqrt(variance(off[counts > 0.25]))))
    return np.asarray(smooth * scale)
