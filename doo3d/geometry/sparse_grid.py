"""Keys of the cells of a sparse grid."""

from __future__ import annotations

import numpy as np

from ..types import Ints

KEY_LIMIT = 2**61
"""Keys are 64-bit; the box must have fewer cells than this."""


def sorted_unique(keys: Ints) -> Ints:
    """Return the distinct values of an integer array in ascending order.

    keys : (M,), in any order. Returns (K,), K <= M.

    The same as np.unique, but faster for keys that are nearly sorted, since it sorts while np.unique hashes.
    """
    keys = np.sort(keys)
    return keys[np.concatenate(([True], keys[1:] != keys[:-1]))] if len(keys) else keys
