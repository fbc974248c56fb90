"""Depth along the strands of a mask: smoothed over their length where it is torn or comes in waves.

The depth of a stereo camera switches along a strand, in stretches, between the strand and what lies behind it, and its noise
comes in waves longer than the strand is wide, so that no window in the image averages it away. Both break a strand apart that is
one in the mask. A strand is smooth along its length, and the inverse of depth has the same noise near and far: so it is smoothed
along each branch of the mask's skeleton, and readings that contradict the rest of the branch do not count. Which readings are
those of what lies behind is told by what is seen beside the strand.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..geometry.noise import DEVIATIONS, NOISE_RADII
from ..kernels import nearest, smooth_depth_beside, smooth_strand_depth
from ..scene.frame_facts import FrameFacts
from ..scene.support import BESIDE_PX
from ..types import Bools, Floats, Frame, Ints
from .depth_filter import Readings

NEARER_SHARE = 0.35
"""Share of the readings across a strand that are nearer than the one taken for the strand: what is wrong mostly lies behind."""

MIN_BRANCH_PX = 12
"""Pixels with readings of a branch at least; shorter ones do not tell what is smooth."""

SLOPE_SHARE = 0.5
"""Share of a step that a neighboring step in the same direction may have, if the step is a jump and not part of a slope."""

JUMP_RADII, MAX_JUMP_SHARE = 0.8, 0.005
"""Radii between the depths at neighboring pixels of a skeleton that are a jump, and the share of jumps that makes depth torn:
sound depth has less, also along coils that bend away from the camera; torn depth has up to 0.05."""

MAX_WAVES_RADII = 0.35
"""Radii; depth whose waves are smaller is left as it is."""

MAX_TORN_SHARE = 0.05
"""Share of readings of something else behind the strand up to which depth is left alone."""

MAX_IN_FRONT_SHARE = 0.1
"""Share of readings as far in front of the curve from which on the curve is not believed, but that of the runs of readings: what
is torn lies behind."""

SURFACE_SMOOTHING_PX = 60.0
"""px along a strand over which the surface beside it is smoothed."""

SEEN_HEIGHT_RADII = 1.6
"""Radii above a surface at which a stereo camera sees the top of a strand that lies on it: less than 2, since it flattens."""

MAX_SLOPE = 8.0
"""Slope, m along the line of sight per m across it, from which on a step between readings is a jump: strands that point at the
camera have 5. Of nine moving cables before stereo cameras 48 % of the frames are right, and 43 % without the runs of readings."""


def filter_along_strands(
    readings: Readings, facts: FrameFacts, radius: float, frame: Frame, smoothing: float
) -> tuple[Readings, int]:
    """Smooth the depth along strands where it is torn or comes in waves.

    Depth is smoothed only if it jumps at more than 0.5 % of the pixels of the mask's skeleton. Then every reading is assigned to
    the nearest pixel of the skeleton, and a smooth curve is laid through the inverse depth of the nearer readings along each
    branch (robust Whittaker smoother). Where the readings differ from it by waves of more than 0.35 radii, or more than 5 % of
    them are torn, it replaces them, and all pixels of the mask along the branch have its depth. If the noise is larger still, and
    the surface beside the strand is about where it would be if the strand lay on it, the strand is drawn towards that.

    Parameters
    ----------
    readings
        the readings in the mask, without outliers.
    facts
        the mask of the object.
    radius
        m, radius of the object; 0 if unknown, which leaves everything as it is.
    frame
        the depth and the camera.
    smoothing
        radii, length over which noise of NOISE_RADII is smoothed; more noise over more, by the square root.

    Returns
    -------
    The given readings, `depth` and `filtered` those of the smooth curve on branches that were smoothed, with the other pixels of
    these branches, in row-major order; and how many of the given readings were smoothed.
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


def _depth_at(line: Ints, readings: Readings, mask: Bools) -> Floats:
    """Return the filtered depth at the pixels (S, 2) of the skeleton, (S,) m, 0 where there is no reading."""
    width = mask.shape[1]
    key, wanted = readings.pixels[:, 1] * width + readings.pixels[:, 0], line[:, 1] * width + line[:, 0]
    at = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
    return np.where(key[at] == wanted, readings.filtered[at], 0.0)


def _smooth_line(given: Floats, near: Ints, facts: FrameFacts, radius: float, frame: Frame, smoothing: float) -> Floats:
    """Return the smooth depth (S,) m of the pixels of the skeleton on branches that are smoothed, 0 on the others.

    given : (N,) m, readings. near : (N,) index of the pixel of the skeleton each is nearest to.
    """
    line, bounds = facts.skeleton
    value, count = nearer_values(1 / given, near, len(line))
    smooth = np.zeros(len(line))
    measured = np.concatenate(([0], np.cumsum(count > 0)))
    reach = np.full(len(line), radius * frame.camera.fx / np.median(given))
    for k in np.flatnonzero(np.diff(measured[bounds]) >= MIN_BRANCH_PX).tolist():  # of noise most branches are short
        part = slice(int(bounds[k]), int(bounds[k + 1]))
        surface = smooth_depth_beside(line[part], reach[part], BESIDE_PX, facts.mask, frame.depth, SURFACE_SMOOTHING_PX**4)
        depth, waves = _smooth(value[part], count[part] > 0, 1 / surface, radius, frame.camera.fx, smoothing)
        lies = waves > MAX_WAVES_RADII * radius and len(surface)
        smooth[part] = _drawn_to_surface(depth, waves, surface, radius) if lies else depth
    return smooth


def nearer_values(values: Floats, group: Ints, groups: int) -> tuple[Floats, Ints]:
    """Return the value of each group that the share NEARER_SHARE of its values is above, and their number: (groups,) each.

    values, group : (N,), values and the group of each; the value of a group without values is 0.
    """
    count = np.bincount(group, minlength=groups)
    rank = np.cumsum(count) - 1 - np.floor(NEARER_SHARE * (count - 1)).astype(np.int64)
    ordered = np.append(values[np.lexsort((values, group))], 0.0)
    return ordered[np.where(count > 0, rank, -1)], count


def _is_torn(readings: Readings, facts: FrameFacts, radius: float) -> bool:
    """Tell whether the depth along the branches jumps so often that it is torn; a strand that bends away has slopes."""
    line, bounds = facts.skeleton
    step, together = _steps(_depth_at(line, readings, facts.mask), bounds)
    jumps = (np.abs(step) > JUMP_RADII * radius) & ~_are_slopes(step)
    return bool(np.count_nonzero(jumps) > MAX_JUMP_SHARE * np.count_nonzero(together))


def _steps(depth: Floats, bounds: Ints) -> tuple[Floats, Bools]:
    """Return the steps (S - 1,) m between pixels of one branch that both have depth, 0 elsewhere, and which those are."""
    together = (depth[1:] > 0) & (depth[:-1] > 0)
    together[bounds[1:-1] - 1] = False
    return np.where(together, np.diff(depth), 0.0), together


def _are_slopes(step: Floats) -> Bools:
    """Tell which steps (S - 1,) m are part of a slope: a step before or after them goes on in the same direction."""
    onwards = np.zeros(len(step) + 2)
    onwards[1:-1] = step
    slope = np.maximum(onwards[:-2] * np.sign(step), onwards[2:] * np.sign(step))
    return np.asarray(slope >= SLOPE_SHARE * np.abs(step))


def _smooth(value: Floats, known: Bools, surface: Floats, radius: float, focal: float, smoothing: float) -> tuple[Floats, float]:
    """Return the smooth depth (S,) m along one branch, and its waves, m; 0 for both where depth is left as it is.

    value : (S,) 1/m, inverse depth where known (S,). surface : (S,) 1/m, that of what is seen beside the branch; (0,) if that
    is not known.
    """
    limits = {"deviations": DEVIATIONS, "noise_radii": NOISE_RADII, "max_in_front": MAX_IN_FRONT_SHARE, "max_slope": MAX_SLOPE}
    depth, waves, in_front, torn = smooth_strand_depth(value, known, surface, radius, focal, smoothing, **limits)
    is_sound = waves <= MAX_WAVES_RADII * radius and torn <= MAX_TORN_SHARE
    return (np.zeros(len(value)), 0.0) if is_sound or in_front > MAX_IN_FRONT_SHARE else (depth, waves)


def _drawn_to_surface(depth: Floats, noise: float, surface: Floats, radius: float) -> Floats:
    """Return the depth (S,) m of a strand, drawn towards the surface beside it as far as the strand probably lies on it.

    The prior is that of a Cauchy distribution around the height at which a strand that lies on the surface, (S,) m, is seen; the
    weight is half where depth is DEVIATIONS from that height.
    """
    height = surface - depth - SEEN_HEIGHT_RADII * radius
    pull = noise**2 / (noise**2 + (MAX_WAVES_RADII * radius) ** 2) / (1 + (height / (DEVIATIONS * noise)) ** 2)
    return np.asarray(depth + uniform_filter1d(pull, 15, mode="nearest") * height)
