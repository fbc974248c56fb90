"""Smooth the inverse range along an object over time, by weighted least squares.

Across the line of sight the image measures the motion and the bending of an object well. Their variance there gives the
smoothness along the line of sight, where depth is noisy.
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
"""Weight of the bends and of the acceleration of an object, relative to 1 for the change of its bends over time: both are
large where it bends away from the camera or is pushed. Of 1,320 frames of stereo cameras 792 are right in space and 1,198
in the image with 0.04, 778 and 1,184 with 0.01, 783 and 1,196 with 0.16."""

ROUNDS = 5
"""Rounds of reweighting the readings, and of lowering the stiffness."""

UNSEEN_WEIGHT = 0.02
"""Weight of depth without a supporting reading, relative to 1."""

LEAST_VARIANCE = 1e-10
"""Smallest variance of relative inverse range and of its changes: the depth of rendered scenes may have no noise."""

LEAST_INVERSE = 0.2
"""Smallest inverse range, relative to the median, for the computation of lengths: noise may make it negative."""


@dataclass(frozen=True)
class TransverseMotion:
    """Motion and bending of an object across the line of sight.

    Attributes
    ----------
    rays
        (T, K, 3) unit, in T frames and at K places, direction from the camera to each place; NaN where unknown.
    moved
        robust variance of the second differences over time across the line of sight.
    bend_changed
        robust variance of the second differences over time of the second differences along the object, across the line of
        sight.
    stiffness
        lower bands of the penalties on second differences, for noise of variance 1, as `solveh_banded` takes them.
    """

    rays: Floats
    moved: float
    bend_changed: float
    stiffness: Floats

    @staticmethod
    def of(rays: Floats) -> TransverseMotion:
        """Return the motion of an object from its rays (T, K, 3), T >= 3 and K >= 3."""
        across = np.cross(rays, np.gradient(rays, axis=1))
        across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), LEAST_VARIANCE)
        over_time, along = np.diff(rays, 2, axis=0), np.diff(rays, 2, axis=1)
        moved = variance((over_time * across[1:-1]).sum(axis=2))
        bent = variance((along * across[:, 1:-1]).sum(axis=2))
        bend_changed = variance((np.diff(along, 2, axis=0) * across[1:-1, 1:-1]).sum(axis=2))
        stiffness = _stiffness(rays.shape[:2], 1 / bend_changed, BEND_SHARE / bent, BEND_SHARE / moved)
        return TransverseMotion(rays, moved, bend_changed, stiffness)

    def smooth(self, values: Floats, weight: Floats, noise: float, last: Floats | None = None, longest: float = np.inf) -> Floats:
        """Return the smoothed relative inverse range, (T, K).

        Parameters
        ----------
        values, weight
            (T, K), relative inverse range and its weight.
        noise
            variance of values of weight 1.
        last
            (T, K), result of an earlier round, from which lengths are computed; None without a limit of the length.
        longest
            length of the object in the unit of 1 / last. Frames in which it is longer are pulled towards this length, with a
            standard deviation of 1 %.
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
        """Add the weights of frames that are too long to bands; return their pull."""
        at = np.maximum(last, LEAST_INVERSE)
        points = self.rays / at[:, :, None]
        step = np.diff(points, axis=1)
        lengths = np.linalg.norm(step, axis=2)
        step /= np.maximum(lengths, LEAST_VARIANCE)[:, :, None]
        by_point = -np.diff(step, axis=1, prepend=0.0, append=0.0)
        gradient, length = -(by_point * points).sum(axis=2) / at, lengths.sum(axis=1)
        weight = np.where(length > longest, noise / (LENGTH_ERROR / 2 * longest) ** 2, 0.0)  # 0 for NaN: unknown
        gradient = np.where(weight[:, None] > 0, gradient, 0.0)
        nodes = last.shape[1]
        following = sliding_window_view(np.pad(gradient, ((0, 0), (0, nodes - 1))), nodes, axis=1)
        by_place = bands.T.reshape(*last.shape, -1)
        by_place[:, :, :nodes] += (weight[:, None] * gradient)[:, :, None] * following
        wanted = longest - np.nan_to_num(length) + (gradient * at).sum(axis=1)
        return np.asarray((weight * wanted)[:, None] * gradient)


def smooth_inverse_range(inverse: Floats, weight: Floats, rays: Floats, longest: float = np.inf) -> Floats:
    """Smooth the inverse range along an object over time.

    Parameters
    ----------
    inverse
        (T, K) 1/m, inverse range of K >= 3 evenly spaced places in T >= 3 frames.
    weight
        (T, K), 0 where unknown.
    rays
        (T, K, 3) unit, direction from the camera to each place; NaN where unknown.
    longest
        m, length of the object: frames in which it would be longer are pulled towards it.

    Returns
    -------
    (T, K) 1/m, known everywhere; the given values if bends change no more along the line of sight than across it.

    Notes ----- The result x minimizes the sum of w (x - y)^2 over the given values y, relative to their median, plus n |D_t
    D_k x|^2 / b^2 + BEND_SHARE (n |D_k x|^2 / k^2 + n |D_t x|^2 / t^2). D_k and D_t are second differences along the object
    and over time; b, k and t are robust standard deviations of these differences across the line of sight; n is the variance
    of the noise, from the excess variance of D_t D_k y and D_t y. The weights w are Geman-McClure weights of the residuals
    (iteratively reweighted least squares). If the residuals exceed the noise, the object moves or bends mainly along the line
    of sight, which b, k and t do not measure: the terms with n are lowered until x fits, before any y is down-weighted
    (discrepancy principle; Morozov, Soviet Math. Dokl. 1966).
    """
    known = weight > 0
    scale = float(np.median(inverse[known]))
    values = np.where(known, inverse / scale, np.nan)
    across = TransverseMotion.of(rays)
    changed = variance(np.diff(np.diff(values, 2, axis=1), 2, axis=0))
    if changed <= across.bend_changed:
        return inverse
    # the variance of a second difference is 6 times that of its values
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
    """Lower the stiffness of a fit until its residuals are no larger than noise.

    fit : the transverse motion, and the smoothed values (T, K) with its stiffness. values, weight, noise : as for
    `TransverseMotion.smooth`. Returns a fit of the same form.
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
    """Return the Geman-McClure weight of each residual: 1 at zero, 0.25 at `limit`."""
    return np.asarray(1 / (1 + (off / limit) ** 2) ** 2)


def variance(values: Floats) -> float:
    """Return the robust variance of the finite values, from their median size."""
    known = values[np.isfinite(values)]
    return max(float(MAD_TO_DEVIATION * np.median(np.abs(known))) ** 2 if len(known) else 0.0, LEAST_VARIANCE)


def _stiffness(shape: tuple[int, int], both: float, along: float, over_time: float) -> Floats:
    """Return the lower bands of the penalties on second differences: (2 K + 3, T K).

    The diagonal comes first, as `solveh_banded` takes it.

    Parameters
    ----------
    shape
        (T, K), numbers of frames and places.
    both, along, over_time
        weights of the second differences over time of those along the object, of those along the object, and of those over
        time.
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
    return np.asarray(bands.reshape(frames * nodes, 2 * nodes + 3).T)  # contiguous columns, for LAPACK


def _squared_differences(count: int) -> Floats:
    """Return the diagonals (3, N) of the squared second differences of N values.

    Row k holds for each column the entry k rows below the main diagonal, 0 outside the matrix.
    """
    diagonals = np.zeros((3, count))
    for row, entries in enumerate(((1, 4, 1), (-2, -2), (1,))):
        for k, entry in enumerate(entries):
            diagonals[row, k : k + count - 2] += entry
    return diagonals
