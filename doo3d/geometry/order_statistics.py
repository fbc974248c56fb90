"""Compute medians and percentiles of the finite values among measurements."""

import math

import numpy as np

from ..types import Floats

SPREAD_PERCENTILES = np.array((15.0, 50.0, 85.0))
"""Percentiles of the spread of widths along a strand: the outer two of a normal distribution are one standard deviation off."""


def finite_median(values: Floats) -> float:
    """Return the median of the finite values among (N,); NaN if there are none."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else math.nan


def finite_percentiles(values: Floats, percents: Floats) -> Floats:
    """Return percentiles (Q,), 0 to 100, of the finite values among (N,).

    NaN if there are none.
    """
    known = np.sort(values[np.isfinite(values)])
    if not len(known):
        return np.full(len(percents), np.nan)
    return np.interp(np.asarray(percents) / 100 * (len(known) - 1), np.arange(len(known)), known)
