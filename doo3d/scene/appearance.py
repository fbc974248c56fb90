"""Tell by the colors of an image whether pixels belong to an object or to what is around it."""

from __future__ import annotations

import numpy as np

from ..kernels import ColorOdds
from ..types import Array, Ints

BAND_PX = 4
"""px outside a mask where the edge of the object may be: its colors are neither those of the object nor of its surround."""

RING_PX = 24
"""px; the colors of the surround are those from the band to so far from the mask."""

HISTOGRAM_SMOOTHING = 0.6
"""Cells of the color histograms by which they are smoothed: light varies along a cable."""

SHADES, SHADOW_SHARE = (0.85, 0.7, 0.55, 0.4), 0.1
"""Brightness of the background in the cable's shadow, and how frequent each is held to be. With 0.03, the surface in shadow
between two strands, which a ragged mask includes, was taken for cable; with 0.3, a tenth of dark cables for shadow."""

MIN_FREQUENCY = 1e-5
"""Frequency of a color that was never seen; it bounds the log ratios. With 1e-4, 2 of 45 right frames of 48 are lost."""


class Appearance(ColorOdds):
    """The colors of an object against those of its surround.

    The log-odds are the logarithm of the likelihood ratio of two color histograms: the frequency of a color on the object over
    that around it (Jones and Rehg, "Statistical color models with application to skin detection", IJCV 46, 2002). Both histograms
    have 16 levels per channel and are smoothed by a Gaussian. Darker shades of the surround count as surround, since objects
    cast shadows. A color that was seen on neither has log-odds of 0.

    The noise of an answer is that of the counts: at most sqrt(1/a + 1/b) nat for a color of which a object pixels and b surround
    pixels were seen. It is below 0.2 nat for colors that both have, 3 nat for the main colors of the object if the surround has
    none of them, and 8 nat for colors of neither. The answers for neighboring pixels are not combined: average them. All answers
    lie within 11.5 nat of 0, the logarithm of MIN_FREQUENCY.

    `log_odds_at` and `noise_at` answer for pixels of the image, `log_odds` has the answers for all cells of colors. `separation`
    is the median of the log-odds over the object pixels learned from: near 0, the colors do not tell object from surround.
    """

    def __init__(self, color: Array, inside: Ints, around: Ints) -> None:
        """Learn the colors of an object and of its surround.

        color : (H, W, 3) uint8 RGB. inside, around : row-major indices of the pixels of the object, and beside it, to learn from.
        """
        shades = np.array(SHADES), SHADOW_SHARE
        super().__init__(np.ascontiguousarray(color), inside, around, *shades, HISTOGRAM_SMOOTHING, MIN_FREQUENCY)
