"""Remove outliers from the depth of a mask, and average its noise away."""

from __future__ import annotations

from typing import NamedTuple

from ..config import SegmentConfig
from ..geometry.noise import DEVIATIONS
from ..scene.frame_facts import FrameFacts
from ..types import Floats, Ints

OUTLIER_WINDOW_PX = 2
"""px; half-width of the window in which a depth reading is compared with its neighbors: 5 x 5, less than a thin cable."""

OUTLIER_MIN_NEIGHBORS = 7
"""Neighbors of the 24 in the window that must agree with a reading, or half of those there are; fewer make a flying point."""


class Readings(NamedTuple):
    """Depth readings at N pixels of the object.

    Attributes
    ----------
    pixels
        (N, 2) int64 (u, v).
    depth
        (N,) m, z coordinate in the camera's optical frame, as measured.
    filtered
        (N,) m, the same with the noise averaged away.
    """

    pixels: Ints
    depth: Floats
    filtered: Floats


def filter_readings(facts: FrameFacts, config: SegmentConfig) -> tuple[Readings, float, int]:
    """Drop the outliers among the depth readings of a mask, and average the noise of the remaining readings away.

    A reading is kept if it agrees with at least 7 of the 24 pixels around it, or with half of those in the mask that have a
    reading. Two readings agree if they differ by less than `slope` (see Returns) per pixel of distance between them. For those
    that lie farther beyond the median depth than the nearest lies before it, it grows with the distance, as the steps of a strand
    do that runs away from the camera. A reading is averaged with the neighbors that agree (sigma filter: Lee, CVGIP 24, 1983).

    Parameters
    ----------
    facts
        the mask of the object, with the depth.
    config
        section `segment` of the settings: `min_depth`, `max_depth`, `outlier_slope`.

    Returns
    -------
    readings : the readings kept, in row-major order of their pixels.
    slope : m per pixel, the largest depth step between neighboring readings of one surface: `outlier_slope`, or three times the
        measured depth noise if that is more.
    outliers : number of readings in the mask, between `min_depth` and `max_depth`, that were dropped.
    """
    slope = max(config.outlier_slope, DEVIATIONS * facts.depth_noise)
    pixels, depth, mean, outliers = facts.agreeing_readings(
        config.min_depth, config.max_depth, OUTLIER_WINDOW_PX, slope, facts.median_depth, OUTLIER_MIN_NEIGHBORS
    )
    return Readings(pixels, depth, mean), slope, outliers
