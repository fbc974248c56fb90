"""Remove outliers from the depth of a mask, and average its noise."""

from typing import NamedTuple

from ..config import SegmentConfig
from ..geometry.noise import DEVIATIONS
from ..scene.frame_facts import FrameFacts
from ..types import Floats, Ints

OUTLIER_WINDOW_PX = 2
"""Half-width in px of the window in which a depth reading is compared with its neighbors: 5 x 5, less than a thin cable."""

OUTLIER_MIN_NEIGHBORS = 7
"""Minimum number of the 24 neighbors that agree with a reading, or half of those in the mask; a flying point has fewer."""


class Readings(NamedTuple):
    """Depth readings at N pixels of the object.

    Attributes
    ----------
    pixels
        (N, 2) int64 (u, v).
    depth
        (N,) m, z coordinate in the camera's optical frame, as measured.
    filtered
        (N,) m, the same after averaging of the noise.
    """

    pixels: Ints
    depth: Floats
    filtered: Floats


def filter_readings(facts: FrameFacts, config: SegmentConfig) -> tuple[Readings, float, int]:
    """Remove the outliers among the depth readings of a mask, and average the noise of the remaining readings.

    A reading is kept if it agrees with at least 7 of the 24 pixels around it, or with half of those in the mask that have a
    reading. Two readings agree if they differ by less than `slope` (see Returns) per pixel of distance between them. For readings
    farther behind the median depth than the nearest reading is in front of it, this limit grows with the depth, as the steps of a
    strand that leads away from the camera do. A reading is averaged with the neighbors that agree (sigma filter: Lee, CVGIP 24,
    1983).

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
        measured depth noise if that is larger.
    outliers : number of readings in the mask, between `min_depth` and `max_depth`, that were removed.
    """
    slope = max(config.outlier_slope, DEVIATIONS * facts.depth_noise)
    pixels, depth, mean, outliers = facts.agreeing_readings(
        config.min_depth, config.max_depth, OUTLIER_WINDOW_PX, slope, facts.median_depth, OUTLIER_MIN_NEIGHBORS
    )
    return Readings(pixels, depth, mean), slope, outliers
