"""Match the strands of a rectified stereo pair, with a disparity per sample.

A strand crosses a row of the right image at one place, and its course distinguishes it from its neighbors. So each strand is
matched as a whole by dynamic programming (Viterbi algorithm) along its samples, with the disparity as state (Ohta and Kanade,
PAMI 1985, along a curve instead of a row). The cost is the difference of the color profiles across the strand. A stretch along
the rows has the same profile at every disparity, and gets its disparity from its neighbors.

Then the disparities are refined to a fraction of a pixel. At each sample the profile is shifted across the strand: along its
normal n the right image is off by m = n . (-dd, dv), with the correction dd of the disparity and the common row offset dv, an
error of the calibration. All corrections are solved together, with small second differences of the disparity (Whittaker
smoother).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import binary_closing

from ..geometry.mask import dilate
from ..geometry.polyline import whittaker_smooth
from ..types import Array, Bools, Floats
from .strand_profiles import SPACING_PX, SURROUND_PX, StrandSamples, TargetImage, sample_strand

STEP_COST, MAX_STEP_PX = 0.08, 2
"""Cost of a change of the disparity by 1 px between samples, relative to 1 for a profile that differs entirely; and largest
change, px, along a strand seen nearly end on. There are no jumps: a strand is continuous, also where it is hidden."""

OUTSIDE_COST = 0.5
"""Cost of a sample outside the right image, neither for nor against a disparity."""

MAX_SHIFT_PX, SHIFT_STEP_PX = 2.0, 0.25
"""Largest shift across the strand at which a profile is searched in the refinement, px, and its step, px."""

REFINEMENTS = 4
"""Number of refinement rounds: the first one corrects up to two pixels, the last ones a tenth."""

SHIFT_DEVIATION_PX = 0.25
"""Standard deviation of the measured shift of one profile, px: pixel noise and the sampling of thin strands."""

MAX_MISFIT = 0.5
"""Difference of profiles above which the strand is hidden in the right image."""

MAX_BRIDGED_RADII = 12.0
"""Length of a strand that may be hidden in the right image, in radii: an oblique crossing of a strand of equal width hides 4
to 8."""

ROW_DEVIATION_PX = 2.0
"""Standard deviation of the row offset of calibrations in use, px: pairs drift by warmth and handling."""

BEND_RADII = 10.0
"""Usual smallest bend radius of a strand towards and away from the camera, in radii."""

MIN_ACROSS, MIN_SHARE = 0.01, 1e-6
"""Smallest component along the rows of a strand's normal as a divisor; weight of samples without evidence if none has any."""

PLANE_SAMPLES = 50.0
"""Number of successive samples of a strand that leave the plane together: a lifted stretch is 100 px long."""

PLANE_SCALE_PX, PLANE_RCOND = 100.0, 0.05
"""Extent of strands with which the slopes of their plane are compared, px; and relative singular value below which a slope is
undetermined, such as across a straight strand, and set to 0."""


@dataclass(frozen=True)
class MatchedStrand:
    """A strand of the left image with its disparity.

    Attributes
    ----------
    points
        (S, 2) px in the left image, two pixels apart.
    normals
        (S, 2) unit, across the strand.
    radius
        (S,) px, half-width.
    disparity
        (S,) px.
    misfit
        (S,) 0 to 1, difference of the profiles in both images; 1 where the strand is not in the right image.
    """

    points: Floats
    normals: Floats
    radius: Floats
    disparity: Floats
    misfit: Floats

    @property
    def known(self) -> Bools:
        """(S,) bool, where the right image shows the strand, with short gaps closed.

        In a short gap another strand crosses, or the surroundings differ in both views because of a crossing.
        """
        shown = self.misfit < MAX_MISFIT
        samples = int(MAX_BRIDGED_RADII * np.median(self.radius) / SPACING_PX)
        return np.asarray(shown | binary_closing(shown, np.ones(max(samples, 1))))


def match_strands(
    lines: Sequence[Floats], radii: Sequence[Floats], left: Array, right: Array, focal: float, mask: Bools | None = None
) -> tuple[list[MatchedStrand], float]:
    """Return strands of the left image with disparities, and the row offset, px.

    Parameters
    ----------
    lines
        the strands, (P, 2) px each.
    radii
        (P,) px, half-width of each strand at its points.
    left, right
        (H, W, C) float32, the rectified images; C channels in grey levels.
    focal
        focal length of both images, px.
    mask
        (H, W) bool, the object in the right image, outside of which no strand is searched; None if unknown.
    """
    target = TargetImage(right, None if mask is None else dilate(mask, SURROUND_PX))
    samples = [sample_strand(line, radius, left) for line, radius in zip(lines, radii, strict=True)]
    disparities = [_match_disparities(each, target) for each in samples]
    row = 0.0
    for _ in range(REFINEMENTS):
        disparities, row = _refine(samples, disparities, row, target, focal)
    matched = []
    for each, disparity in zip(samples, disparities, strict=True):
        misfit = _misfits(each, disparity[:, None], row, target)[:, 0]
        matched.append(MatchedStrand(each.points, each.normals, each.radius, disparity, misfit))
    return matched, row


def _misfits(samples: StrandSamples, disparity: Floats, row: float, target: TargetImage) -> Floats:
    """Return the profile difference (S, Q) of samples at disparities (S, Q) px.

    row : px, offset of the rows. It is 1 outside the right image.
    """
    centers = samples.points[:, None] + np.stack([-disparity, np.full_like(disparity, row)], axis=-1)
    places = centers[:, :, None] + samples.offsets[:, None] * samples.normals[:, None, None]
    return np.where(target.contains(centers), target.difference(samples, places), 1.0)


def _match_disparities(samples: StrandSamples, target: TargetImage) -> Floats:
    """Return the disparities (S,) of least total cost, whole px (Viterbi).

    The cost is the sum of misfits and of the changes between samples.
    """
    states = np.arange(1.0, target.image.shape[1] // 2)
    cost = np.concatenate([_misfits(part, np.tile(states, (len(part.points), 1)), 0.0, target) for part in _parts(samples)])
    cost[samples.points[:, :1] < states] = OUTSIDE_COST
    total, origin = cost[0].copy(), np.zeros(cost.shape, dtype=np.int32)
    numbers = np.arange(len(states))
    offsets = np.array(sorted(range(MAX_STEP_PX, -MAX_STEP_PX - 1, -1), key=abs))  # smallest change first, for equal costs
    for i in range(1, len(cost)):
        around = sliding_window_view(np.pad(total, MAX_STEP_PX, constant_values=np.inf), len(states))
        moved = around[MAX_STEP_PX + offsets] + STEP_COST * np.abs(offsets)[:, None]
        best = moved.argmin(axis=0)
        total, origin[i] = moved[best, numbers] + cost[i], numbers + offsets[best]
    path = np.zeros(len(cost), dtype=int)
    path[-1] = total.argmin()
    for i in range(len(cost) - 1, 0, -1):
        path[i - 1] = origin[i, path[i]]
    return states[path]


def _parts(samples: StrandSamples, size: int = 64) -> list[StrandSamples]:
    """Return the samples in parts, whose profiles at all disparities fit in memory."""
    cuts = range(size, len(samples.points), size)
    parts = zip(*(np.split(getattr(samples, name), cuts) for name in ("points", "normals", "radius", "profiles")), strict=True)
    return [StrandSamples(points, normals, radius, samples.offsets, profiles) for points, normals, radius, profiles in parts]


def _refine(
    samples: Sequence[StrandSamples], disparities: Sequence[Floats], row: float, target: TargetImage, focal: float
) -> tuple[list[Floats], float]:
    """Return disparities and row offset, corrected by the shifts of the profiles."""
    shifts = [_measure_shifts(each, disparity, row, target) for each, disparity in zip(samples, disparities, strict=True)]
    planes, plane_weight = _fit_plane(samples, disparities, [weight for _, weight in shifts])
    along, constant, total = [], [], np.array([0.0, 1 / ROW_DEVIATION_PX**2])
    for each, disparity, plane, (shift, sure) in zip(samples, disparities, planes, shifts, strict=True):
        across = np.where(np.abs(each.normals[:, 0]) > MIN_ACROSS, each.normals[:, 0], MIN_ACROSS)
        weight = sure * across**2 / SHIFT_DEVIATION_PX**2
        nearness = max(float(np.median(disparity)), 1.0) / focal
        bend = nearness * SPACING_PX**2 / (BEND_RADII * float(np.median(each.radius)))
        # the disparity is linear in the row offset: value at offset 0, and slope
        parts = []
        for wanted, prior in ((disparity - shift / across, plane), (each.normals[:, 1] / across, 0 * plane)):
            pulled = (weight * wanted + plane_weight * prior) / (weight + plane_weight)
            solved = whittaker_smooth(pulled[:, None], (weight + plane_weight)[:, None, None], 1 / bend**2)[:, 0]
            left = [np.sqrt(weight) * (solved - wanted), np.sqrt(plane_weight) * (solved - prior), np.diff(solved, 2) / bend]
            parts.append((solved, np.concatenate(left)))
        constant.append(parts[0][0])
        along.append(parts[1][0])
        total += parts[0][1] @ parts[1][1], parts[1][1] @ parts[1][1]
    change = -(total[0] + row / ROW_DEVIATION_PX**2) / total[1]
    return [base + change * slope for base, slope in zip(constant, along, strict=True)], float(row + change)


def _fit_plane(
    samples: Sequence[StrandSamples], disparities: Sequence[Floats], weights: Sequence[Floats]
) -> tuple[list[Floats], float]:
    """Fit a plane to the disparities of all strands.

    The disparity of a plane, such as a table, is linear in the image. The plane gives the disparity of stretches along the
    rows or hidden in the right image. Its weight decreases with the variance of the strands around it.

    Returns
    -------
    The disparity of the plane at the samples of each strand, px, and the weight of its pull on a sample.
    """
    points, across = (np.concatenate([getattr(each, name) for each in samples]) for name in ("points", "normals"))
    disparity, weight = np.concatenate(disparities), np.concatenate(weights) * across[:, 0] ** 2
    share = (weight + MIN_SHARE) / (weight + MIN_SHARE).sum()
    middle = share @ points
    table = np.column_stack((points - middle, np.full(len(points), PLANE_SCALE_PX)))
    root = np.sqrt(share)
    values = table @ np.linalg.lstsq(table * root[:, None], disparity * root, rcond=PLANE_RCOND)[0]
    variance = float(share @ (disparity - values) ** 2) + SHIFT_DEVIATION_PX**2
    cuts = np.cumsum([len(each.points) for each in samples])[:-1]
    return list(np.split(values, cuts)), 1 / (variance * PLANE_SAMPLES)


def _measure_shifts(samples: StrandSamples, disparity: Floats, row: float, target: TargetImage) -> tuple[Floats, Floats]:
    """Return the shift (S,) px of each profile across the strand, and its weight."""
    steps = np.arange(-MAX_SHIFT_PX, MAX_SHIFT_PX + SHIFT_STEP_PX / 2, SHIFT_STEP_PX)
    centers = samples.points + np.stack([-disparity, np.full_like(disparity, row)], axis=-1)
    places = centers[:, None, None] + (steps[:, None] + samples.offsets)[..., None] * samples.normals[:, None, None]
    cost = target.difference(samples, places)
    best = np.clip(cost.argmin(axis=1), 1, len(steps) - 2)
    rows = np.arange(len(cost))
    before, at, after = cost[rows, best - 1], cost[rows, best], cost[rows, best + 1]
    curvature = before - 2 * at + after
    offset = np.where(curvature > 0, (before - after) / (2 * np.where(curvature > 0, curvature, 1.0)), 0.0)
    shift = steps[best] + SHIFT_STEP_PX * np.clip(offset, -1.0, 1.0)
    inside = (np.abs(shift) < MAX_SHIFT_PX - SHIFT_STEP_PX) & (curvature > 0) & target.contains(centers)
    return shift, np.where(inside, np.clip(1 - at / MAX_MISFIT, 0.0, 1.0) ** 2, 0.0)
