"""Extend the mask of an image along strands that go on beyond it.

A segmentation misses stretches of a strand in another light, in a shadow, or before a background of similar color. Each free end
of a chain is followed in steps of half a radius. The strand is taken to continue where the colors across it match its colors so
far and the background on both sides has other colors. The path found is added to the mask, and the stages are run again.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from ..config import ExtendMaskConfig
from ..types import Array, Bools, Chain, Floats
from . import FrameContext

STRAND_OFFSETS_RADII = np.linspace(-0.7, 0.7, 5)
"""Radii from the middle, across a strand, at which its colors are read."""

BACKGROUND_OFFSETS_RADII = np.array([-2.2, -1.7, 1.7, 2.2])
"""Radii from the middle at which the colors of the background are read, clear of soft edges."""

STEP_RADII = 0.5
"""Radii; length of a step along a strand."""

LOOKAHEAD_STEPS = 4
"""Steps ahead that a step is judged by: the mean over them."""

TURNS_RAD = np.linspace(-1, 1, 7) * STEP_RADII / 2
"""Radians; turns tried at a step: no object bends more sharply than two of its radii."""

SHIFTS_PX = np.array([-1.0, 0.0, 1.0])
"""px; lateral shifts tried at a step."""

PROFILE_LENGTH_RADII, DIRECTION_LENGTH_RADII = 10.0, 4.0
"""Radii before the end of a chain over which the colors of its strand, and its direction, are measured."""

MIN_EXTENSION_RADII = 2.0
"""Radii; shorter extensions are not worth running the stages again, and end in the mask that they begin in."""

MAX_HIDDEN_RADII = 8.0
"""Radii of the strand that may look different: another strand on top, a print, a glare."""

COLOR_NOISE = 6.0
"""Grey levels of 255 by which the colors of one strand differ anyway."""

MAX_COLOR_DISTANCE = 2.5
"""Squared color distance of the strand ahead from the strand so far, at most, in variances of the latter."""

MIN_CONTRAST = 1.5
"""Squared color distance by which the background on either side must differ more than that."""

COLOR_ADAPTATION = STEP_RADII / PROFILE_LENGTH_RADII
"""Fraction of the colors ahead that a strand takes over at a step: its colors are those of about PROFILE_LENGTH_RADII behind."""

CONTRAST_WEIGHT, TURN_WEIGHT = 0.5, 0.36
"""Weights, per squared color distance, that choose among turns and shifts whose colors all fit: contrast up to
the one that is always enough is good, the largest turn is bad."""


def extend_mask(chains: list[Chain], context: FrameContext, config: ExtendMaskConfig) -> Bools | None:
    """Extend the mask of an image along strands that continue beyond it (2-D only).

    Parameters
    ----------
    chains
        the chains found in the mask, px, with radii. Their free ends are followed, except at the border of the image.
    context
        the data of the frame, whose mask and color image are used.
    config
        section `extend_mask` of the settings.

    Returns
    -------
    (H, W) bool, the mask with the strands' continuations added, each as wide as its strand. Continuations shorter than
    MIN_EXTENSION_RADII (2) radii are not added. None if nothing was added, if `config.max_length` is 0 (the default), without a
    color image, and in 3-D.
    """
    foreground = context.foreground
    mask, color = foreground.mask, foreground.color
    if not config.max_length or mask is None or color is None or foreground.points.shape[1] != 2:
        return None
    blurred = cv2.GaussianBlur(color, (3, 3), 0)
    extended, any_found = mask.astype(np.uint8), False
    for chain in chains:
        for joints, radii in ((chain.joints, chain.radii), (chain.joints[::-1], chain.radii[::-1])):
            radius = float(np.median(radii))
            if chain.closed or not radius > 0 or not _is_inside(joints[-1], mask, radius * (1 + STEP_RADII)):
                continue
            path = follow_strand(blurred, mask, joints, radius, config)
            if np.linalg.norm(path[-1] - path[0]) > MIN_EXTENSION_RADII * radius:
                cv2.polylines(extended, [np.rint(path).astype(np.int32)], False, 1, max(1, round(2 * radius)))
                any_found = True
    return extended > 0 if any_found else None


def follow_strand(image: Array, mask: Bools, joints: Floats, radius: float, config: ExtendMaskConfig) -> Floats:
    """Follow a strand in the image beyond the last joint of its chain, by the colors across the strand.

    A stretch of up to MAX_HIDDEN_RADII (8) radii that looks different, such as another strand on top, is skipped. The path
    ends where it runs into the mask, at the border of the image, after `config.max_length` radii, or where the colors no longer
    match.

    Parameters
    ----------
    image
        (H, W, 3) uint8 RGB.
    mask
        (H, W) bool, the pixels already known to be of the object.
    joints
        (N, 2) px (u, v), the N joints of the chain; the strand is followed beyond the last one.
    radius
        px, radius of the strand at the last joint.
    config
        section `extend_mask` of the settings.

    Returns
    -------
    (P, 2) px, P points along the strand, beginning with the last joint of the chain; P = 1 if the strand does not continue.
    """
    tail = _last_joints(joints, PROFILE_LENGTH_RADII * radius)
    direction = tail[-1] - _last_joints(tail, DIRECTION_LENGTH_RADII * radius)[0]
    angle, position = float(np.arctan2(direction[1], direction[0])), tail[-1]
    colors, variance = _color_profile(image, tail, radius)
    hidden_steps = int(MAX_HIDDEN_RADII / STEP_RADII)
    path, length = [position], 0.0
    while length < config.max_length * radius:
        step = _find_step(image, position, angle, radius, colors, variance, range(1, 2))
        if step is None:  # hidden ahead: try all positions beyond
            step = _find_step(image, position, angle, radius, colors, variance, range(2, hidden_steps + 2))
        if step is None:
            break
        colors = colors + COLOR_ADAPTATION * (step.colors - colors)
        position, angle = step.position, angle + step.turn
        path.append(position)
        length += step.length
        clear_of_start = length > MIN_EXTENSION_RADII * radius
        if not _is_inside(position, mask, 0) or (clear_of_start and mask[tuple(np.rint(position[::-1]).astype(int))]):
            break
    return np.array(path)


class _Step(NamedTuple):
    """A step along a strand: its end (2,) px, its turn in radians, its length in px, and the colors (I, 3) across its end."""

    position: Floats
    turn: float
    length: float
    colors: Floats


def _find_step(
    image: Array, position: Floats, angle: float, radius: float, colors: Floats, variance: Floats, steps: range
) -> _Step | None:
    """Return the nearest of the steps at which the strand is seen, in the best direction; None where it is seen at none.

    Parameters
    ----------
    image
        (H, W, 3) uint8 RGB.
    position, angle
        (2,) px and radians, where the strand is and where it heads.
    radius
        px.
    colors, variance
        (I, 3) and (3,): mean colors across the strand so far, and their variance along it.
    steps
        lengths to try, in units of STEP_RADII, consecutive.
    """
    angles = angle + TURNS_RAD[:, None, None]
    forward = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    lateral = np.stack((-forward[..., 1], forward[..., 0]), axis=-1)
    count = len(steps)
    distances = STEP_RADII * radius * np.arange(steps.start, steps.start + count - 1 + LOOKAHEAD_STEPS)[:, None]
    positions = position + forward * distances + lateral * SHIFTS_PX[:, None, None]  # (turns, shifts, distances, 2)
    strand = _read_colors(image, positions[..., None, :] + lateral[..., None, :] * radius * STRAND_OFFSETS_RADII[:, None])
    beside = _read_colors(image, positions[..., None, :] + lateral[..., None, :] * radius * BACKGROUND_OFFSETS_RADII[:, None])
    distance = _lookahead_mean(_color_distance(strand - colors, variance).mean(axis=-1))
    background = _color_distance(beside[..., None, :] - colors, variance).min(axis=-1)
    contrast = _lookahead_mean(background.reshape(*background.shape[:-1], 2, -1).mean(axis=-1), axis=-2).min(axis=-1)
    cost = distance - CONTRAST_WEIGHT * np.minimum(contrast, MAX_COLOR_DISTANCE + MIN_CONTRAST)
    cost += (TURN_WEIGHT * (TURNS_RAD / TURNS_RAD[-1]) ** 2)[:, None, None]
    best = cost.reshape(-1, count).argmin(axis=0)
    each = np.arange(count)
    best_distance, best_contrast = distance.reshape(-1, count)[best, each], contrast.reshape(-1, count)[best, each]
    seen = np.flatnonzero((best_distance <= MAX_COLOR_DISTANCE) & (best_contrast >= best_distance + MIN_CONTRAST))
    if not len(seen):
        return None
    at = seen[0]
    turn, shift = np.unravel_index(best[at], cost.shape[:2])
    return _Step(positions[turn, shift, at], float(TURNS_RAD[turn]), float(distances[at, 0]), strand[turn, shift, at])


def _lookahead_mean(values: Floats, axis: int = -1) -> Floats:
    """Return the means over LOOKAHEAD_STEPS consecutive values along an axis."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(values, LOOKAHEAD_STEPS, axis=axis).mean(axis=-1))


def _is_inside(position: Floats, mask: Bools, margin: float) -> bool:
    """Tell whether a position (2,) px lies in the image, at least the margin from its border."""
    return bool((position >= margin).all() and (position <= np.array(mask.shape[::-1]) - 1 - margin).all())


def _last_joints(joints: Floats, length: float) -> Floats:
    """Return the last joints (N, 2) over a length in px, two at least."""
    count = int(np.ceil(length / np.linalg.norm(joints[-1] - joints[-2])))
    return joints[-max(1, count) - 1 :]


def _color_profile(image: Array, joints: Floats, radius: float) -> tuple[Floats, Floats]:
    """Return the mean colors across a strand, (I, 3) at STRAND_OFFSETS_RADII, and their variance along it, (3,).

    The last radius is left out, where the mask may end slantwise.
    """
    segments = np.diff(joints, axis=0)
    size = float(np.linalg.norm(segments[0]))
    arc_lengths = np.arange(0, max(len(segments) * size - radius, 1.0), 1.0)
    index = np.minimum((arc_lengths / size).astype(int), len(segments) - 1)
    forward = segments[index] / size
    positions = joints[index] + forward * (arc_lengths - index * size)[:, None]
    lateral = np.column_stack((-forward[:, 1], forward[:, 0]))
    colors = _read_colors(image, positions[:, None] + lateral[:, None] * radius * STRAND_OFFSETS_RADII[:, None])
    return colors.mean(axis=0), colors.var(axis=0).mean(axis=0) + COLOR_NOISE**2


def _read_colors(image: Array, positions: Floats) -> Floats:
    """Return the colors (..., 3) of the pixels nearest to positions (..., 2) px; beyond the border those of the border."""
    u, v = np.rint(positions[..., 0]).astype(int), np.rint(positions[..., 1]).astype(int)
    return np.asarray(image[v.clip(0, image.shape[0] - 1), u.clip(0, image.shape[1] - 1)], dtype=float)


def _color_distance(difference: Floats, variance: Floats) -> Floats:
    """Return the mean over the channels of squared differences (..., 3), in variances."""
    return np.asarray((difference**2 / variance).mean(axis=-1))
