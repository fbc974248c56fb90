"""Decide the length of an object by a vote over all frames in which it is visible."""

import numpy as np

from ..types import Floats
from .observations import LENGTH_ERROR

FILLED_ERROR = 0.05
"""Relative error of the filled length of a chain, hidden or without depth, in addition to LENGTH_ERROR of the whole: in 24
sequences of moving cables the median of this error is 1 to 9 %, except where strands were joined wrongly."""

MIN_FRAMES = 3
"""Smallest number of frames in which an object is seen whole; all frames in a shorter capture."""

MIN_LENGTH_SHARE = 0.1
"""Fraction of the chains that must agree on a length, within LENGTH_ERROR. A chain is too short wherever an end is hidden and
hardly ever too long, so the length of an object is the longest one with enough agreement."""


def vote_length(lengths: Floats, filled: Floats) -> float:
    """Return the longest length in m that enough measured lengths agree on.

    Parameters
    ----------
    lengths
        (K,) m, measured lengths.
    filled
        (K,) m, how much of each length was not measured. Two lengths agree within 2 % of the length and 5 % of the part not
        measured, added as independent errors.

    Returns
    -------
    The weighted median of the lengths that agree, moved until it converges (mean shift with the median), since
    the longest lengths are slightly too long. Lengths with the least filled part are preferred as a start.
    """
    order = np.argsort(filled - lengths, kind="stable")
    ordered, errors = lengths[order], np.hypot(LENGTH_ERROR * lengths[order], FILLED_ERROR * filled[order])
    least = max(min(MIN_FRAMES, len(ordered)), int(np.ceil(MIN_LENGTH_SHARE * len(ordered))))
    for length, error in zip(ordered, errors, strict=True):
        near = np.abs(ordered - length) <= np.maximum(errors, error)
        if near.sum() >= least:
            return _middle(ordered, errors, _median(ordered[near], errors[near]))
    return float(np.median(ordered))


def _middle(lengths: Floats, errors: Floats, length: float) -> float:
    """Return the weighted median of the lengths around a length, until it converges."""
    for _ in range(len(lengths)):
        near = np.abs(lengths - length) <= errors
        median = _median(lengths[near], errors[near])
        if median == length:
            break
        length = median
    return length


def _median(values: Floats, errors: Floats) -> float:
    """Return the median of values, weighted by inverse squared errors.

    Between two values it is their mean.
    """
    order = np.argsort(values, kind="stable")
    share = np.cumsum(errors[order] ** -2.0)
    low, high = np.searchsorted(share, share[-1] / 2 * np.array([1 - 1e-9, 1 + 1e-9]))
    return float(values[order][[low, high]].mean())
