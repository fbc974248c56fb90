"""Select bright or dark lines by the Sato tubeness filter, as for blood vessels (Keipour et al., RA-L 2022, section III-A)."""

import cv2
import numpy as np

from ...config import SegmentConfig
from ...errors import require
from ...types import Bools, Cloud, Frame, Image
from .result import color_of
from .strands import IMAGE_PIXELS

SIGMAS_PX = (2.0, 4.0, 6.0)
"""Standard deviations of the filter in px of the scaled image, which are the half-widths of the lines that it detects."""


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Bools:
    """Select bright or dark lines in a color image by scikit-image's Sato tubeness filter and Otsu's threshold.

    Either the dark or the bright lines are selected: those with the larger sum of squared responses. A larger image is scaled
    down to IMAGE_PIXELS (640 x 360) before the filter, so that the same lines are found at any resolution. The response is scaled
    up again before the threshold, for smooth edges.

    Parameters
    ----------
    data
        a Frame with color, or an Image.
    config, seed
        not used.

    Returns
    -------
    (H, W) bool; all False if the image has no line.

    Raises
    ------
    InputError : the data has no color image.
    MissingDependency : scikit-image is not installed.
    """
    color = color_of(data, "ridge")
    filters = require("skimage.filters", "ridge")
    grey = cv2.cvtColor(np.ascontiguousarray(color), cv2.COLOR_RGB2GRAY).astype(np.float32) / 255
    shape = grey.shape
    shrink = max(1.0, (grey.size / IMAGE_PIXELS) ** 0.5)
    if shrink > 1:
        grey = cv2.resize(grey, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    responses = [np.nan_to_num(filters.sato(grey, sigmas=SIGMAS_PX, black_ridges=black)) for black in (False, True)]
    response = max(responses, key=lambda image: float((image**2).sum()))
    if response.max() <= 0:
        return np.zeros(shape, dtype=bool)
    threshold = filters.threshold_otsu(response)
    if shrink > 1:
        response = cv2.resize(response, shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(response > threshold)
