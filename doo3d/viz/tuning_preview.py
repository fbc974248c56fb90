"""Draw the segmentation that tuning proposes: segmented, missed and wrongly segmented pixels in colors."""

import cv2
import numpy as np

from ..types import Array, Bools
from .palette import Rgb
from .writing import write_legend

SEGMENTED: Rgb = (60, 220, 90)
MISSED: Rgb = (255, 50, 50)
OTHER: Rgb = (255, 222, 60)
TINT = 0.55  # share of the color over the image


def draw_tuning(image: Array, mask: Bools, object_mask: Bools | None) -> Array:
    """Draw a segmentation over the grayed image, with a legend unless the image is too small.

    Pixels of the object are green if segmented, red if missed. Segmented pixels that are not of the object are yellow.

    Parameters
    ----------
    image
        (H, W, 3) uint8 RGB.
    mask
        (H, W) bool, the segmented pixels.
    object_mask
        (H, W) bool, the pixels of the object; None if unknown: then all segmented pixels are green.

    Returns
    -------
    (H, W, 3) uint8 RGB
        of the size of the image.
    """
    gray = cv2.cvtColor(cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
    picture: Array = np.rint(0.55 * gray + 0.25 * image).astype(np.uint8)
    parts = [("segmented", SEGMENTED, mask if object_mask is None else mask & object_mask)]
    if object_mask is not None:
        parts += [("missed", MISSED, object_mask & ~mask), ("other", OTHER, mask & ~object_mask)]
    for _, color, region in parts:
        picture[region] = np.rint((1 - TINT) * image[region] + TINT * np.array(color)).astype(np.uint8)
    write_legend(picture, [(text, color) for text, color, _ in parts])
    return picture
