"""Classify the segments of a chain by their origin: four kinds, which look the same in all pictures."""

import numpy as np

from ..types import Array, Chain

SEEN, DEPTH_FILLED, OCCLUDED, FROM_TIME = range(4)

KIND_WORDS = ("seen", "depth filled in", "occluded", "from other frames")
"""Words for each kind of segment, by its number."""


def segment_kinds(chain: Chain) -> Array:
    """Return the kind of each segment, (N,) int, an index of KIND_WORDS.

    Segments of the last kind are occluded, too, but were filled in from other frames of the sequence, not from their own frame.
    """
    return np.asarray(chain.occluded.astype(int) + chain.depth_filled + (chain.occluded & chain.from_time))
