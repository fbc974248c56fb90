"""Select all data, which holds nothing but the object."""

import numpy as np

from ...config import SegmentConfig
from ...types import Bools, Cloud, Frame, Image
from .result import require_depth


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Select every pixel of a Frame that has depth, (H, W) bool, or all N points of a Cloud, (N,) bool.

    Parameters
    ----------
    data
        a Frame or a Cloud.
    config, seed
        not used.

    Raises
    ------
    InputError : the data is an Image, since not every pixel of an image can be the object.
    """
    data = require_depth(data, "everything")
    if isinstance(data, Cloud):
        return np.ones(len(data.points), dtype=bool)
    return np.asarray(data.depth > 0)
