"""Select everything: the data is already the object."""

from __future__ import annotations

import numpy as np

from ...config import SegmentConfig
from ...errors import InputError
from ...types import Bools, Cloud, Frame, Image


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
    if isinstance(data, Image):
        raise InputError(
            "segment.method is everything, which needs depth: for an image use a mask, hsv or ridge", code="method-needs-depth"
        )
    if isinstance(data, Cloud):
        return np.ones(len(data.points), dtype=bool)
    return np.asarray(data.depth > 0)
