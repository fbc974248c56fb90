"""Smooth the depth along the strands of a mask where it is torn or wavy.

The depth of a stereo camera alternates along a strand, in stretches, between the strand and the surface behind it. Its noise has
waves longer than the width of the strand, which no window in the image averages out. Both break a strand that is continuous in
the mask. A strand is smooth along its length, and the noise of the inverse depth does not depend on the distance. The inverse
depth is therefore smoothed along each branch of the mask's skeleton, and readings that contradict the rest of the branch are
ignored. Readings of the surface behind are recognized by the depth beside the strand.
"""

import math

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..geometry.noise import DEVIATIONS, NOISE_RADII
from ..kernels import nearest, smooth_depth_beside, smooth_strand_depth
from ..scene.frame_facts import FrameFacts
from ..scene.surface_beside import BESIDE_PX
from ..types import Bools, Floats, Frame, Ints
from .depth_filter import Readings

NEARER_SHARE = 0.35
"""Quantile of the inverse depth across a strand, from the nearest, that is taken for the strand: most wrong readings lie
behind."""

MIN_BRANCH_PX = 12
"""Minimum number of pixels with readings of a branch that is smoothed."""

SLOPE_SHARE = 0.5
"""Maximum ratio of a neighboring step of the same sign to a step of the depth that is a jump, and no part of a slope."""

JUMP_RADII, MAX_JUMP_SHARE = 0.8, 0.005
"""Minimum difference in radii between the depths at neighboring pixels of a skeleton that is a jump, and minimum fraction of
jumps in torn depth. Intact depth has a smaller fraction, also along coils that bend away from the camera; torn depth has up to
0.05."""

MAX_WAVES_RADII = 0.35
"""Maximum size in radii of waves of the depth that are not smoothed."""

MAX_TORN_SHARE = 0.05
"""Maximum fraction of readings of other surfaces behind a strand whose depth is not smoothed."""

MAX_IN_FRONT_SHARE = 0.1
"""Maximum fraction of readings that lie as far in front of the smooth curve, since torn readings lie behind. Above it, the curve
through the runs of readings is used instead."""

SURFACE_SMOOTHING_PX = 60.0
"""Length in px along a strand over which the depth of the surface beside it is smoothed."""

SEEN_HEIGHT_RADII = 1.6
"""Height in radii at which a stereo camera measures the top of a strand on a surface: less than 2, since it flattens."""

MAX_SLOPE = 8.0
"""Maximum slope of a strand, m along the line of sight per m across it; a steeper step between readings is a jump. Strands that
point at the camera have 5. Of the frames of nine moving cables in front of stereo cameras, 48 % are right; without the runs of
readings, 43 %."""


def filter_along_strands(
    readings: Readings, facts: FrameFacts, radius: float, frame: Frame, smoothing: float
) -> tuple[Readings, int]:
    """Smooth the depth along strands where it is torn or wavy.

    Depth is smoothed only if it jumps at more than 0.5 % of the pixels of the mask's skeleton. Then every reading is assigned to
    the nearest pixel of the skeleton, and a smooth curve is fitted to the inverse depth of the nearer readings along each branch
    (robust Whittaker smoother). If the readings differ from the curve by waves of more than 0.35 radii, or more than 5 % of them
    are torn, all pixels of the mask along the branch get the depth of the curve. The depth of a wavy branch is moved towards that
    of a strand on the surface beside it: the larger the waves and the smaller the difference, the more.

    Parameters
    ----------
    readings
        the readings in the mask, without outliers.
    facts
        the mask of the object.
    radius
        m, radius of the object; 0 if unknown: the readings are returned unchanged.
    frame
        the depth and the camera.
    smoothing
        radii, length over which noise of NOISE_RADII is smoothed. The length grows with the square root of the noise.

    Returns
    -------
    readings : the readings in row-major order. On smoothed branches, all pixels have the depth of the curve.
    smoothed : number of the given readings that were smoothed.
    """
    if not len(readings.pixels) or not radius or not _is_torn(readings, facts, radius):
        return readings, 0
    width = facts.mask.shape[1]
    keys = np.flatnonzero(facts.mask)
    pixels = np.column_stack((keys % width, keys // width))
    near = nearest(pixels.astype(float), facts.skeleton[0].astype(float), math.inf)[1]
    at = np.searchsorted(keys, readings.pixels @ (1, width))
    own = _smooth_line(readings.depth, near[at], facts, radius, frame, smoothing)[near]
    given = np.zeros((2, len(keys)))
    given[:, at] = readings.depth, readings.filtered
    depth, filtered = np.where(own > 0, own, given)
    known = depth > 0
    return Readings(pixels[known], depth[known], filtered[known]), int(np.count_nonzero(own[at]))


def _smooth_line(given: Floats, near: Ints, facts: FrameFacts, radius: float, frame: Frame, smoothing: float) -> Floats:
    """Return the smooth depth (S,) m at the pixels of the skeleton, 0 on branches that are not smoothed.

    given : (N,) m, the readings. near : (N,) index of the pixel of the skeleton nearest to each.
    """
    line, bounds = facts.skeleton
    value, count = nearer_values(1 / given, near, len(line))
    smooth = np.zeros(len(line))
    measured = np.concatenate(([0], np.cumsum(count > 0)))
    reach = np.full(len(line), radius * frame.camera.fx / np.median(given))
    for k in np.flatnonzero(np.diff(measured[bounds]) >= MIN_BRANCH_PX).tolist():
        part = slice(int(bounds[k]), int(bounds[k + 1]))
        surface = smooth_depth_beside(line[part], reach[part], BESIDE_PX, facts.mask, frame.depth, SURFACE_SMOOTHING_PX**4)
        depth, waves = _smooth(value[part], count[part] > 0, 1 / surface, radius, frame.camera.fx, smoothing)
        lies = waves > MAX_WAVES_RADII * radius and len(surface)
        smooth[part] = _drawn_to_surface(depth, waves, surface, radius) if lies else depth
    return smooth


def nearer_values(values: Floats, group: Ints, groups: int) -> tuple[Floats, Ints]:
    """Return the value of each group that the fraction NEARER_SHARE of its values exceeds, and their number, (groups,) each.

    values, group : (N,), values and the number of the group of each. The value of an empty group is 0.
    """
    count = np.bincount(group, minlength=groups)
    rank = np.cumsum(count) - 1 - np.floor(NEARER_SHARE * (count - 1)).astype(np.int64)
    ordered = np.append(values[np.lexsort((values, group))], 0.0)
    return ordered[np.where(count > 0, rank, -1)], count


def _is_torn(readings: Readings, facts: FrameFacts, radius: float) -> bool:
    """Return whether the depth jumps so often along the branches of the skeleton that it is torn.

    A step beside another step of the same sign is no jump, but part of the slope of a strand that bends away from the camera.
    """
    line, bounds = facts.skeleton
    key, wanted = (pixels @ (1, facts.mask.shape[1]) for pixels in (readings.pixels, line))
    at = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
    depth = np.where(key[at] == wanted, readings.filtered[at], 0.0)
    is_step = (depth[1:] > 0) & (depth[:-1] > 0)
    is_step[bounds[1:-1] - 1] = False
    step = np.where(is_step, np.diff(depth), 0.0)
    size, beside = np.abs(step), np.pad(step, 1)
    slope = np.maximum(beside[:-2] * np.sign(step), beside[2:] * np.sign(step))
    is_jump = (size > JUMP_RADII * radius) & (slope < SLOPE_SHARE * size)
    return bool(np.count_nonzero(is_jump) > MAX_JUMP_SHARE * np.count_nonzero(is_step))


def _smooth(value: Floats, known: Bools, surface: Floats, radius: float, focal: float, smoothing: float) -> tuple[Floats, float]:
    """Return the smooth depth (S,) m along one branch, and the size of its waves, m; 0 if the branch is not smoothed.

    value : (S,) 1/m, inverse depth where `known` (S,). surface : (S,) 1/m, inverse depth of the surface beside the branch; (0,)
    if unknown.
    """
    limits = {"deviations": DEVIATIONS, "noise_radii": NOISE_RADII, "max_in_front": MAX_IN_FRONT_SHARE, "max_slope": MAX_SLOPE}
    depth, waves, in_front, torn = smooth_strand_depth(value, known, surface, radius, focal, smoothing, **limits)
    is_sound = waves <= MAX_WAVES_RADII * radius and torn <= MAX_TORN_SHARE
    return (np.zeros(len(value)), 0.0) if is_sound or in_front > MAX_IN_FRONT_SHARE else (depth, waves)


def _drawn_to_surface(depth: Floats, noise: float, surface: Floats, radius: float) -> Floats:
    """Return the depth (S,) m of a strand, moved towards that of a strand on the surface beside it, (S,) m, by its likelihood.

    The prior of the depth is a Cauchy distribution around SEEN_HEIGHT_RADII above the surface; its weight is half at a distance
    of DEVIATIONS standard deviations of the noise.
    """
    height = surface - depth - SEEN_HEIGHT_RADII * radius
    pull = noise**2 / (noise**2 + (MAX_WAVES_RADII * radius) ** 2) / (1 + (height / (DEVIATIONS * noise)) ** 2)
    return np.asarray(depth + uniform_filter1d(pull, 15, mode="nearest") * height)
