"""Tell by the colors of an image whether pixels belong to an object or to what is around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels import color_log_odds
from ..types import Array, Floats, Ints

HISTOGRAM_SMOOTHING = 0.6
"""Cells of the color histograms by which they are smoothed: light varies along a cable."""

SHADES, SHADOW_SHARE = (0.85, 0.7, 0.55, 0.4), 0.03
"""Brightness of the background in the cable's shadow, and how frequent each is held to be: a ragged mask seldom shows it."""

MIN_FREQUENCY = 1e-5
"""Frequency of a color that was never seen; it bounds the log ratios. With 1e-4, 2 of 45 right frames of 48 are lost."""


@dataclass(frozen=True)
class Appearance:
    """The colors of an object against those of its surround.

    The log-odds are the logarithm of the likelihood ratio of two color histograms: the frequency of a color on the object over
    that around it (Jones and Rehg, "Statistical color models with application to skin detection", IJCV 46, 2002). Both histograms
    have 16 levels per channel and are smoothed by a Gaussian. Darker shades of the surround count as surround, since objects
    cast shadows.

    The noise of an answer is that of the counts: about sqrt(1/a + 1/b) nat for a color of which a object pixels and b surround
    pixels were seen. It is below 0.2 nat for the main colors of both, and above 1 nat for colors seen at few pixels. The answers
    for neighboring pixels are not combined: average them. All answers lie within 11.5 nat of 0, the logarithm of MIN_FREQUENCY.

    Attributes
    ----------
    log_odds
        (4096,) float32 nat, of each cell of colors, the blue channel last: above 0 for colors of the object.
    separation
        nat, median of the log-odds over the object pixels learned from; 0 without any. Near 0, the colors do not tell the object
        from its surround.
    """

    log_odds: Floats
    separation: float

    @classmethod
    def learn(cls, color: Array, inside: Ints, around: Ints) -> Appearance:
        """Learn the colors of an object and of its surround from pixels of an image.

        Parameters
        ----------
        color
            (H, W, 3) uint8 RGB.
        inside, around
            (N,) and (K,) int64, row-major indices of pixels of the object and of its surround.
        """
        x = np.arange(int(4 * HISTOGRAM_SMOOTHING + 0.5) + 1)
        kernel = np.exp(-0.5 / HISTOGRAM_SMOOTHING**2 * x**2)
        kernel /= kernel.sum() + kernel[1:].sum()
        return cls(*color_log_odds(color, inside, around, np.array(SHADES), SHADOW_SHARE, kernel, MIN_FREQUENCY))
