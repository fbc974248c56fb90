"""Where each segment of a chain comes from: four kinds, each drawn in its own way in all pictures."""

import numpy as np

from ..types import Array, Chain

SEEN, DEPTH_FILLED, OCCLUDED, FROM_TIME = range(4)

KIND_WORDS = ("seen", "depth filled in", "occluded", "from other frames")
"""Words for each kind of segment, by its number."""


def segment_kinds(chain: Chain) -> Array:
    """Return the kind of each segment, (N,) int: seen, with filled depth, occluded (filled in from its frame), or from time.

    A segment from time is occluded, too, but other frames of the sequence filled it in.
    """
    return np.asarray(chain.occluded.astype(int) + chain.depth_filled + (chain.occluded & chain.from_time))
