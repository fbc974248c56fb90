"""Vote the length of an object over the frames that show it."""

from __future__ import annotations

import numpy as np

from ..types import Floats
from .junction_vote import OPEN
from .observations import LENGTH_ERROR
from .tracks import FILLED_ERROR, MIN_FRAMES, Track

MIN_LENGTH_SHARE = 0.1
"""Share of the chains that must agree on a length, within LENGTH_ERROR: chains are too short wherever an end is hidden, hardly
ever too long, so the object's length is the longest that enough chains have."""


def track_length(track: Track, given: float | None) -> float:
    """Return the length, m, of the object of a track: the given one, which is that of objects without junctions, or voted."""
    return given if given is not None and track.pattern == OPEN else vote_length(*track.lengths)


def vote_length(lengths: Floats, filled: Floats) -> float:
    """Return the longest length, m, on which enough of the measured lengths agree, nearest to those with the least filled.

    Parameters
    ----------
    lengths
        (K,) m, measured lengths.
    filled
        (K,) m, how much of each was not measured. Lengths agree within 2 %, and within 5 % of what was not measured; both
        errors are independent.

    Returns
    -------
    The weighted median of the lengths that agree with it. It is moved until it converges (mean shift with the median), since the
    longest measurements are a little too long.
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
    """Return the weighted median of the lengths around a length, moved until it stays."""
    for _ in range(len(lengths)):
        near = np.abs(lengths - length) <= errors
        median = _median(lengths[near], errors[near])
        if median == length:
            break
        length = median
    return length


def _median(values: Floats, errors: Floats) -> float:
    """Return the median of values, weighted by the inverse squares of their errors; between two of them their mean."""
    order = np.argsort(values, kind="stable")
    share = np.cumsum(errors[order] ** -2.0)
    low, high = np.searchsorted(share, share[-1] / 2 * np.array([1 - 1e-9, 1 + 1e-9]))
    return float(values[order][[low, high]].mean())
