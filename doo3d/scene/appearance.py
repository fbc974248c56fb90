"""Classify pixels by their colors as object or surroundings."""

import numpy as np

from ..kernels import ColorOdds
from ..types import Array, Ints

BAND_PX = 4
"""Width in px of the band outside a mask in which the edge of the object may lie; its colors are not learned."""

RING_PX = 24
"""Maximum distance in px from the mask at which the colors of the surroundings are learned, from the band outwards."""

HISTOGRAM_SMOOTHING = 0.6
"""Standard deviation, in cells, of the Gaussian that smooths the color histograms: light varies along a cable."""

SHADES, SHADOW_SHARE = (0.85, 0.7, 0.55, 0.4), 0.1
"""Brightness of the background in a cable's shadow, and the assumed frequency of each brightness. With 0.03, the shaded surface
between two strands, which a ragged mask includes, was classified as cable; with 0.3, a tenth of dark cables as shadow."""

MIN_FREQUENCY = 1e-5
"""Frequency assumed for colors that do not occur; it bounds the log-odds. With 1e-4, 43 of 48 frames are right, down from 45."""


class Appearance(ColorOdds):
    """The colors of an object compared with those of its surroundings.

    The log-odds of a color are the logarithm of the ratio of its frequencies in two histograms: on the object and around it
    (Jones and Rehg, "Statistical color models with application to skin detection", IJCV 46, 2002). Both histograms have 16 levels
    per channel and are smoothed by a Gaussian. Darker shades of the surroundings belong to the surroundings, since objects cast
    shadows. A color in neither histogram has log-odds of 0.

    The noise of the log-odds is that of the counts: at most sqrt(1/a + 1/b) nat for a color of a object pixels and b pixels of
    the surroundings. It is below 0.2 nat for colors that both have, 3 nat for the main colors of the object if the surroundings
    have none of them, and 8 nat for colors of neither. The log-odds of neighboring pixels are not combined: average them. All
    log-odds lie within 11.5 nat of 0, the logarithm of MIN_FREQUENCY.

    `log_odds_at` and `noise_at` return the values at pixels of the image, `log_odds` those of all colors. `separation` is the
    median of the log-odds over the object pixels that were learned: near 0, object and surroundings have the same colors.
    """

    def __init__(self, color: Array, inside: Ints, around: Ints) -> None:
        """Learn the colors of an object and of its surroundings.

        color : (H, W, 3) uint8 RGB. inside, around : (N,) and (M,) row-major indices of pixels of the object
        and of the surroundings.
        """
        shades = np.array(SHADES), SHADOW_SHARE
        super().__init__(np.ascontiguousarray(color), inside, around, *shades, HISTOGRAM_SMOOTHING, MIN_FREQUENCY)
