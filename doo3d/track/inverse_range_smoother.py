"""Smooth the inverse range of places along an object over time and along the object together.

How fast an object moves and bends across the line of sight, where the image measures well, tells how much of the change in depth
is noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.linalg import solveh_banded

from ..geometry.noise import MAD_TO_DEVIATION, OUTLIER_DEVIATIONS
from ..types import Floats
from .observations import LENGTH_ERROR

BEND_SHARE = 0.04
"""Weight of the bends and of the acceleration of an object, beside 1 for the change over time of its bends: both are large where
it is bent away from the camera, or pushed. Of 1,320 frames before stereo cameras 792 are right, 1,198 in the image; with 0.01 778
and 1,184, with 0.16 783 and 1,196."""

ROUNDS = 5
"""Rounds of weighing the readings."""

UNSEEN_WEIGHT = 0.02
"""Weight of depth that no reading supports, beside 1."""

LEAST_VARIANCE = 1e-10
"""Least variance of relative inverse range and of its changes: depth of rendered scenes can be without noise."""

LEAST_INVERSE = 0.2
"""Least inverse range, beside 1 for its median, of which a length is computed: noise can be negative."""


@dataclass(frozen=True)
class TransverseMotion:
    """How an object moves and bends across the line of sight, in T frames at K places.

    Attributes
    ----------
    rays
        (T, K, 3) unit, direction from the camera to each place; NaN where it is not known.
    moved, bends_moved
        robust variances of second differences across the line of sight: over time, and over time of those along the object.
    stiffness
        lower bands of the penalties on second differences, for noise of variance 1.
    """

    rays: Floats
    moved: float
    bend_changed: float
    stiffness: Floats

    @staticmethod
    def of(rays: Floats) -> TransverseMotion:
        """Return what rays (T, K, 3), T >= 3 and K >= 3, tell."""
        across = np.cross(rays, np.gradient(rays, axis=1))
        across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), LEAST_VARIANCE)
        over_time, along = np.diff(rays, 2, axis=0), np.diff(rays, 2, axis=1)
        moved = variance((over_time * across[1:-1]).sum(axis=2))
        bent = variance((along * across[:, 1:-1]).sum(axis=2))
        bend_changed = variance((np.diff(along, 2, axis=0) * across[1:-1, 1:-1]).sum(axis=2))
        stiffness = _stiffness(rays.shape[:2], 1 / bend_changed, BEND_SHARE / bent, BEND_SHARE / moved)
        return TransverseMotion(rays, moved, bend_changed, stiffness)

    def smooth(self, values: Floats, weight: Floats, noise: float, last: Floats | None = None, longest: float = np.inf) -> Floats:
        """Return the smooth values (T, K) of relative inverse range.

        values, weight : (T, K). noise : variance of values of weight 1. last, longest : (T, K), an earlier result; where an
        object is longer in it than `longest`, in the unit of 1 / last, it is drawn towards that length, which is known to 1 %.
        """
        bands = noise * self.stiffness
        bands[0] += weight.ravel() + LEAST_VARIANCE
        pull = weight * values
        if last is not None and np.isfinite(longest):
            pull += self._shortened(bands, noise, last, longest)
        return np.asarray(
            solveh_banded(bands, pull.ravel(), overwrite_ab=True, lower=True, check_finite=False).reshape(weight.shape)
        )

    def _shortened(self, bands: Floats, noise: float, last: Floats, longest: float) -> Floats:
        """Add to bands the weight of the lengths of frames that are too long; return their pull (T, K)."""
        at = np.maximum(last, LEAST_INVERSE)
        points = self.rays / at[:, :, None]
        step = np.diff(points, axis=1)
        lengths = np.linalg.norm(step, axis=2)
        step /= np.maximum(lengths, LEAST_VARIANCE)[:, :, None]
        by_point = -np.diff(step, axis=1, prepend=0.0, append=0.0)
        gradient, length = -(by_point * points).sum(axis=2) / at, lengths.sum(axis=1)
        weight = np.where(length > longest, noise / (LENGTH_ERROR / 2 * longest) ** 2, 0.0)  # NaN: not known
        gradient = np.where(weight[:, None] > 0, gradient, 0.0)
        nodes = last.shape[1]
        following = sliding_window_view(np.pad(gradient, ((0, 0), (0, nodes - 1))), nodes, axis=1)
        by_place = bands.T.reshape(*last.shape, -1)
        by_place[:, :, :nodes] += (weight[:, None] * gradient)[:, :, None] * following
        wanted = longest - np.nan_to_num(length) + (gradient * at).sum(axis=1)
        return np.asarray((weight * wanted)[:, None] * gradient)


def smooth_inverse_range(inverse: Floats, weight: Floats, rays: Floats, longest: float = np.inf) -> Floats:
    """Smooth the inverse range of places along an object over time.

    Parameters
    ----------
    inverse
        (T, K) 1/m, inverse range of K >= 3 evenly spaced places in T >= 3 frames.
    weight
        (T, K), 0 where it is not known.
    rays
        (T, K, 3) unit, direction from the camera to each place; NaN where it is not known.
    longest
        m, length of the object: a frame in which it would be longer is pulled towards it.

    Returns
    -------
    (T, K) 1/m, known everywhere; the given values where bends change no more along the line of sight than across it.

    Notes
    -----
    The result x minimizes the sum of w (x - y)^2 over y, the given values, in shares of their median, plus
    n |D_t D_k x|^2 / b^2 + BEND_SHARE (n |D_k x|^2 / k^2 + n |D_t x|^2 / t^2), where D_k and D_t are second differences along
    the object and over time, b, k and t the robust standard deviations of these differences across the line of sight, and n the
    variance of the noise, from how much more D_t D_k y and D_t y vary. Weights w fall with the misfit (Geman and McClure).
    Where x misses y by more than the noise, the object moves or bends mainly along the line of sight, which b, k and t do not
    tell: the terms with n are lowered until x fits, before any y counts less (discrepancy principle; Morozov, Soviet Math.
    Dokl. 1966).
    """
    known = weight > 0
    scale = float(np.median(inverse[known]))
    values = np.where(known, inverse / scale, np.nan)
    across = TransverseMotion.of(rays)
    changed = variance(np.diff(np.diff(values, 2, axis=1), 2, axis=0))
    if changed <= across.bend_changed:
        return inverse
    # second differences vary 6 times as much
    noise = max(changed / 36, (variance(np.diff(values, 2, axis=0)) - across.moved) / 6)
    values = np.where(known, values, 0.0)
    across, smooth = _relax_stiffness((across, across.smooth(values, weight, noise)), values, weight, noise)
    for _ in range(1, ROUNDS):
        off = values - smooth
        limit = OUTLIER_DEVIATIONS * float(np.sqrt(max(noise, variance(off[known]))))
        smooth = across.smooth(values, weight * geman_mcclure(off, limit), noise, smooth, longest * scale)
    return np.asarray(smooth * scale)


def _relax_stiffness(
    fit: tuple[TransverseMotion, Floats], values: Floats, weight: Floats, noise: float
) -> tuple[TransverseMotion, Floats]:
    """Return a fit to values, as of `AcrossSight.smoothed`, with stiffness lowered until it misses them by no more than noise.

    fit : how the object moves and bends across the line of sight, and the smooth values that this gives.
    """
    across, smooth = fit
    for _ in range(ROUNDS):
        left = variance((values - smooth)[weight > UNSEEN_WEIGHT])
        if left <= noise:
            break
        across = replace(across, stiffness=noise / left * across.stiffness)
        smooth = across.smooth(values, weight, noise)
    return across, smooth


def geman_mcclure(off: Floats, limit: float) -> Floats:
    """Return how much readings count that are off by so much, 0 to 1: a quarter at the limit (Geman and McClure's estimator)."""
    return np.asarray(1 / (1 + (off / limit) ** 2) ** 2)


def variance(values: Floats) -> float:
    """Return the robust variance of values, those that are NaN left out."""
    known = values[np.isfinite(values)]
    return max(float(MAD_TO_DEVIATION * np.median(np.abs(known))) ** 2 if len(known) else 0.0, LEAST_VARIANCE)


def _stiffness(shape: tuple[int, int], both: float, along: float, over_time: float) -> Floats:
    """Return the lower bands of the penalties on second differences for `solveh_banded`: (2 K + 3, T K), diagonal first.

    shape : (T, K) frames and places. both, along, over_time : weights of the differences over time of those along the object, of
    those along it, and of those over time.
    """
    frames, nodes = shape
    bands = np.zeros((frames, nodes, 2 * nodes + 3))
    line, time = _squared_differences(nodes), _squared_differences(frames)
    for later in range(3):
        for farther in range(-2 if later else 0, 3):
            by_place = line[abs(farther)] if farther >= 0 else np.roll(line[-farther], -farther)
            weight = both * np.outer(time[later], by_place)
            if not later:
                weight += along * by_place
            if not farther:
                weight += over_time * time[later][:, None]
            bands[:, :, later * nodes + farther] = weight
    return np.asarray(bands.reshape(frames * nodes, 2 * nodes + 3).T)  # columns in one piece, as LAPACK reads them


def _squared_differences(count: int) -> Floats:
    """Return the diagonals of the matrix whose quadratic form is the sum of squared second differences of N values: (3, N).

    Row k holds for each column the entry k rows below the main diagonal, 0 outside.
    """
    diagonals = np.zeros((3, count))
    for row, entries in enumerate(((1, 4, 1), (-2, -2), (1,))):
        for k, entry in enumerate(entries):
            diagonals[row, k : k + count - 2] += entry
    return diagonals
