"""The object is a bright or dark line on whatever lies behind it: tubeness, as for vessels (paper, section III-A)."""

from __future__ import annotations

import cv2
import numpy as np

from ....config import SegmentConfig
from ....errors import InputError, require
from ....types import Bools, Cloud, Frame, Image

FILTER_PIXELS = 500_000
"""px; larger images are filtered at this many pixels: the filter takes 1 s per million."""

SIGMAS = (2.0, 4.0, 6.0)
"""px at the size of the filter; half-widths of the lines that are looked for."""


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Pixels where scikit-image's Sato or Frangi filter answers strongly, by Otsu's threshold, dark or bright.

    Of the two polarities the one with the stronger answer is taken. A larger image than `ridge_pixels` is filtered at that
    size, so that the same lines are found at any resolution; its answer is enlarged before the threshold, for smooth edges.

    Raises
    ------
    InputError : the data has no image. MissingDependency : scikit-image is not installed.
    """
    color = None if isinstance(data, Cloud) else data.color
    if color is None:
        raise InputError("segment.method is ridge, which needs a colour image", code="method-needs-color")
    filters = require("skimage.filters", "ridge")
    grey = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2GRAY).astype(np.float32) / 255
    full = grey.shape
    shrink = max(1.0, (grey.size / FILTER_PIXELS) ** 0.5)
    if shrink > 1:
        grey = cv2.resize(grey, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    answer = filters.sato
    found = [np.nan_to_num(answer(grey, sigmas=SIGMAS, black_ridges=black)) for black in (False, True)]
    best = max(found, key=lambda image: float(np.percentile(image, 99.5)))
    if best.max() <= 0:
        return np.zeros(full, dtype=bool)
    threshold = filters.threshold_otsu(best)
    return np.asarray((cv2.resize(best, full[::-1], interpolation=cv2.INTER_LINEAR) if shrink > 1 else best) > threshold)
