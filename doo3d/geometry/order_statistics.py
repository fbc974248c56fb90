"""Medians and percentiles of measurements, some of which may be missing: values that are not finite do not count."""

from __future__ import annotations

import math

import numpy as np

from ..types import Floats

SPREAD_PERCENTILES = np.array((15.0, 50.0, 85.0))
"""Percentiles that tell how widths along a strand spread: of normally distributed ones the outer two are a deviation off."""


def finite_median(values: Floats) -> float:
    """Return the median of values (N,); NaN if none is finite."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else math.nan


def finite_percentiles(values: Floats, percents: Floats) -> Floats:
    """Return percentiles (Q,) of values (N,), 0 to 100; NaN if none is finite."""
    known = np.sort(values[np.isfinite(values)])
    if not len(known):
        return np.full(len(percents), np.nan)
    return np.interp(np.asarray(percents) / 100 * (len(known) - 1), np.arange(len(known)), known)
