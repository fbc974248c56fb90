"""Extend the mask of an image along strands that go on beyond it.

A segmentation misses stretches of a strand in another light, in a shadow, or before a background of similar color. Each free end
of a chain is followed in steps of half a radius. The strand is taken to continue where the colors across it match its colors so
far and the background on both sides has other colors. The path found is added to the mask, and the stages are run again.
"""

from __future__ import annotations

import cv2
import numpy as np

from ..config import ExtendMaskConfig
from ..geometry.noise import COLOR_NOISE
from ..geometry.radii import STEP_RADII
from ..kernels import follow_strand
from ..types import Bools, Chain, Floats
from . import FrameContext

STRAND_OFFSETS_RADII = np.linspace(-0.7, 0.7, 5)
"""Radii from the middle, across a strand, at which its colors are read."""

BACKGROUND_OFFSETS_RADII = np.array([-2.2, -1.7, 1.7, 2.2])
"""Radii from the middle at which the colors of the background are read, clear of soft edges."""

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

MAX_COLOR_DISTANCE = 2.5
"""Squared color distance of the strand ahead from the strand so far, at most, in variances of the latter."""

MIN_CONTRAST = 1.5
"""Squared color distance by which the background on either side must differ more than that."""

COLOR_ADAPTATION = STEP_RADII / PROFILE_LENGTH_RADII
"""Fraction of the colors ahead that a strand takes over at a step: its colors are those of about PROFILE_LENGTH_RADII behind."""

CONTRAST_WEIGHT, TURN_WEIGHT = 0.5, 0.36
"""Weights, per squared color distance, that choose among turns and shifts whose colors all fit: contrast up to
the one that is always enough is good, the largest turn is bad."""

TRIED = (STRAND_OFFSETS_RADII, BACKGROUND_OFFSETS_RADII, TURNS_RAD, SHIFTS_PX)
NUMBERS = np.array([
    STEP_RADII, PROFILE_LENGTH_RADII, DIRECTION_LENGTH_RADII, MIN_EXTENSION_RADII, MAX_HIDDEN_RADII, COLOR_NOISE,
    MAX_COLOR_DISTANCE, MIN_CONTRAST, COLOR_ADAPTATION, CONTRAST_WEIGHT, TURN_WEIGHT,
])  # fmt: skip


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
    extended = None
    for chain in chains:
        radius = float(np.median(chain.radii))
        for joints in (chain.joints, chain.joints[::-1]):
            if chain.closed or not radius > 0 or not _is_inside(joints[-1], mask, radius * (1 + STEP_RADII)):
                continue
            line = np.ascontiguousarray(joints)
            path = follow_strand(color, mask, line, radius, config.max_length, TRIED, LOOKAHEAD_STEPS, NUMBERS)
            if np.linalg.norm(path[-1] - path[0]) > MIN_EXTENSION_RADII * radius:
                extended = mask.astype(np.uint8) if extended is None else extended
                cv2.polylines(extended, [np.rint(path).astype(np.int32)], False, 1, max(1, round(2 * radius)))
    return None if extended is None else extended > 0


def _is_inside(position: Floats, mask: Bools, margin: float) -> bool:
    """Tell whether a position (2,) px lies in the image, at least the margin from its border."""
    return bool((position >= margin).all() and (position <= np.array(mask.shape[::-1]) - 1 - margin).all())
