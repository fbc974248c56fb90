"""Select bright or dark lines by the Sato tubeness filter, as for blood vessels (Keipour et al., RA-L 2022, section III-A)."""

from __future__ import annotations

import cv2
import numpy as np

from ...config import SegmentConfig
from ...errors import InputError, require
from ...types import Bools, Cloud, Frame, Image
from .strands import IMAGE_PIXELS

SIGMAS_PX = (2.0, 4.0, 6.0)
"""px of the scaled image; half-widths of the lines that the filter answers to."""


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Select bright or dark lines in a color image by scikit-image's Sato tubeness filter and Otsu's threshold.

    Either the dark or the bright lines are selected, whichever respond more strongly (by their squared response). A larger image
    is scaled down to IMAGE_PIXELS (640 x 360) before the filter, so that the same lines are found at any resolution. The response
    is enlarged again before the threshold, for smooth edges.

    Parameters
    ----------
    data
        a Frame with color, or an Image.
    config, seed
        not used.

    Returns
    -------
    (H, W) bool; all False if there is no line at all.

    Raises
    ------
    InputError : the data has no color image.
    MissingDependency : scikit-image is not installed.
    """
    color = None if isinstance(data, Cloud) else data.color
    if color is None:
        raise InputError("segment.method is ridge, which needs a color image", code="method-needs-color")
    filters = require("skimage.filters", "ridge")
    grey = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2GRAY).astype(np.float32) / 255
    shape = grey.shape
    shrink = max(1.0, (grey.size / IMAGE_PIXELS) ** 0.5)
    if shrink > 1:
        grey = cv2.resize(grey, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    answers = [np.nan_to_num(filters.sato(grey, sigmas=SIGMAS_PX, black_ridges=black)) for black in (False, True)]
    answer = max(answers, key=lambda image: float((image**2).sum()))
    if answer.max() <= 0:
        return np.zeros(shape, dtype=bool)
    threshold = filters.threshold_otsu(answer)
    if shrink > 1:
        answer = cv2.resize(answer, shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(answer > threshold)
