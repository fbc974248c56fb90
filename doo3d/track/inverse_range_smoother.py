"""Smooth the inverse range along an object over time, by weighted least squares.

Across the line of sight the image measures the motion and the bending of an object well. Their variance there gives the
smoothness along the line of sight, where depth is noisy.
"""

import numpy as np
from scipy.linalg import solveh_banded

from ..geometry.noise import MAD_TO_DEVIATION, OUTLIER_DEVIATIONS
from ..types import Floats

BEND_SHARE = 0.04
"""Weight of the bends and of the acceleration of an object, relative to 1 for the change of its bends over time: both are
large where it bends away from the camera or is pushed. Of 1,320 frames of stereo cameras 792 are right in space and 1,198
in the image with 0.04, 778 and 1,184 with 0.01, 783 and 1,196 with 0.16."""

ROUNDS = 5
"""Rounds of reweighting the readings."""

UNSEEN_WEIGHT = 0.02
"""Weight of depth without a supporting reading, relative to 1."""

LEAST_VARIANCE = 1e-10
"""Smallest variance: the depth of rendered scenes may have no noise, and an object at rest no motion."""


def smooth_inverse_range(inverse: Floats, weight: Floats, rays: Floats) -> Floats:
    """Smooth the inverse range along an object over time.

    Parameters
    ----------
    inverse
        (T, K) 1/m, inverse range of K >= 3 evenly spaced places in T >= 3 frames.
    weight
        (T, K), weights of the values, over 0.
    rays
        (T, K, 3) unit, direction from the camera to each place.

    Returns
    -------
    (T, K) 1/m; the given values if bends change no more along the line of sight than across it.

    Notes
    -----
    The result x minimizes the sum of w (x - y)^2 over the given values y, relative to their median, plus n |D_t D_k x|^2 / b^2 +
    BEND_SHARE (n |D_k x|^2 / k^2 + n |D_t x|^2 / t^2). D_k and D_t are second differences along the object and over time; b, k
    and t are robust standard deviations of these differences across the line of sight; n is the variance of the noise, from the
    excess variance of D_t D_k y and D_t y. The weights w are multiplied by Geman-McClure weights of the residuals (iteratively
    reweighted least squares).
    """
    scale = float(np.median(inverse))
    values = inverse / scale
    across = np.cross(rays, np.gradient(rays, axis=1))
    across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), LEAST_VARIANCE)
    along = np.diff(rays, 2, axis=1)
    moved = variance((np.diff(rays, 2, axis=0) * across[1:-1]).sum(axis=2))
    bent = variance((along * across[:, 1:-1]).sum(axis=2))
    bend_changed = variance((np.diff(along, 2, axis=0) * across[1:-1, 1:-1]).sum(axis=2))
    changed = variance(np.diff(np.diff(values, 2, axis=1), 2, axis=0))
    if changed <= bend_changed:
        return inverse
    # the variance of a second difference is 6 times that of its values
    noise = max(changed / 36, (variance(np.diff(values, 2, axis=0)) - moved) / 6)
    stiffness = noise * _stiffness(inverse.shape, 1 / bend_changed, BEND_SHARE / bent, BEND_SHARE / moved)
    smooth = _solved(stiffness, values, weight)
    for _ in range(1, ROUNDS):
        off = values - smooth
        limit = OUTLIER_DEVIATIONS * float(np.sqrt(max(noise, variance(off))))
        smooth = _solved(stiffness, values, weight * geman_mcclure(off, limit))
    return np.asarray(smooth * scale)


def _solved(stiffness: Floats, values: Floats, weight: Floats) -> Floats:
    """Return the values (T, K) that minimize their weighted squared residuals and the penalties with these lower bands."""
    bands = stiffness.copy()
    bands[0] += weight.ravel() + LEAST_VARIANCE
    pull = (weight * values).ravel()
    return np.asarray(solveh_banded(bands, pull, overwrite_ab=True, lower=True, check_finite=False).reshape(weight.shape))


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
