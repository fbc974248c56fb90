"""The object is a bright or dark line on whatever lies behind it: tubeness, as for vessels (paper, section III-A)."""

from __future__ import annotations

import cv2
import numpy as np

from ..config import SegmentConfig
from ..errors import InputError, require
from ..types import Bools, Cloud, Frame, Image


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Pixels where scikit-image's Sato or Frangi filter answers strongly, by Otsu's threshold, dark or bright.

    Of the two polarities the one with the stronger answer is taken.

    Raises
    ------
    InputError : the data has no image. MissingDependency : scikit-image is not installed.
    """
    color = None if isinstance(data, Cloud) else data.color
    if color is None:
        raise InputError("segment.method is ridge, which needs a colour image")
    filters = require("skimage.filters", "ridge")
    grey = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2GRAY).astype(np.float32) / 255
    answer = getattr(filters, config.ridge_filter)
    sigmas = list(config.ridge_sigmas)
    found = [np.nan_to_num(answer(grey, sigmas=sigmas, black_ridges=black)) for black in (False, True)]
    best = max(found, key=lambda image: float(np.percentile(image, 99.5)))
    top = float(best.max())
    if top <= 0:
        return np.zeros(grey.shape, dtype=bool)
    return np.asarray(best > filters.threshold_otsu(best))
