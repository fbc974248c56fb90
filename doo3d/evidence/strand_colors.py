"""The appearance of a strand: its colors across its width, and how much better they explain colors than those of another one."""

from __future__ import annotations

import numpy as np

from ..geometry.noise import COLOR_NOISE
from ..kernels import part_medians, sample_bilinear
from ..types import Array, Floats, Ints

PROFILE_OFFSETS = np.linspace(-0.75, 0.75, 7)
"""Lateral offsets, in half-widths, of the colors across a strand."""

CORE_OFFSETS = np.array((-0.4, 0.0, 0.4))
"""Lateral offsets, in half-widths, that are on the strand for certain: away from its silhouette, where its surface falls away."""

INDEPENDENT_COLORS = 6.0
"""Number of independent colors in a profile: its offsets are closer than the blur of a camera, and its channels vary together."""

MAX_LOG_RATIO, MIN_LOG_RATIO = 2.0, 0.35
"""Logarithms of a ratio of squared errors: beyond the first, more says nothing; the second comes from light and texture."""


def color_profiles(image: Array, positions: Floats) -> tuple[Floats, Ints]:
    """Measure the colors across strands, each the median over the samples along its strand.

    Parameters
    ----------
    image
        (H, W, 3) uint8 RGB.
    positions
        (..., S, A, 2) px, of S samples along each strand at A lateral offsets; NaN for none.

    Returns
    -------
    profile : (..., A, 3) by lateral offset; NaN where no sample along the strand is in the image
    measured : (...) number of samples along the strand that are in the image with all their offsets
    """
    colors = colors_at(image, positions).swapaxes(-3, -1)
    return medians(colors).swapaxes(-2, -1), np.isfinite(colors).all(axis=(-3, -2)).sum(axis=-1)


def colors_at(image: Array, positions: Floats) -> Floats:
    """Return the bilinear colors (..., 3) of an image (H, W, 3) uint8 at positions (..., 2) px; NaN outside."""
    return sample_bilinear(np.ascontiguousarray(image), positions.reshape(-1, 2)).reshape(*positions.shape[:-1], -1)


def medians(values: Floats) -> Floats:
    """Return the medians over the last axis of the values that are not NaN; NaN where all are."""
    last = values.shape[-1] * np.arange(1, values[..., 0].size + 1)
    return part_medians(values.ravel(), last - values.shape[-1], last)[0].reshape(values.shape[:-1])


def first_strand_log_odds(colors: Floats, first: Floats, second: Floats) -> Floats:
    """Return the log-odds that colors are those of the first strand and not of the second.

    With normally distributed errors of unknown size, the logarithm of the likelihood ratio of n independent colors is n / 2 times
    that of the ratio of the mean squared errors. COLOR_NOISE is added to both: smaller errors tell nothing.

    Parameters
    ----------
    colors
        (C, A, B, 3) 8-bit RGB, measured.
    first, second
        (C, A, B, 3) or shapes that broadcast to it, colors expected of either strand.

    Returns
    -------
    (C,) nat, positive for the first strand, at most MAX_LOG_RATIO (2) times INDEPENDENT_COLORS / 2; 0 if both explain the colors
    equally well, or a color is NaN.
    """
    own, other = (((expected - colors) ** 2).mean(axis=(1, 2, 3)) + COLOR_NOISE**2 for expected in (first, second))
    ratio = np.log(other / own)
    return INDEPENDENT_COLORS / 2 * np.where(np.abs(ratio) >= MIN_LOG_RATIO, np.clip(ratio, -MAX_LOG_RATIO, MAX_LOG_RATIO), 0.0)
