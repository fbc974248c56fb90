"""Select strands: bands of constant width that differ in color from both sides, or that are raised from the plane."""

import cv2
import numpy as np

from ...config import SegmentConfig
from ...types import Array, Bools, Cloud, Frame, Image
from ..color_strands import select_in_frame
from ..ribbon_checks import CheckedStrand, choose_strands, draw_strand
from ..ribbons import find_ribbons, to_lab, trace_strands
from . import plane
from .result import SHADOWS, MethodResult, rejection_note, require_image

IMAGE_PIXELS = 640 * 360
"""Number of pixels to which larger photographs are scaled down before strands are searched."""

MAX_ASPECT = 16
"""Maximum aspect ratio of a photograph: it is rotated to all directions, on a grid whose size is the square of its length."""

ASPECT_NOTE = "segment (strands): in a photograph of {}x{} px, over {} times as long as wide, no strands are looked for: crop it"


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> MethodResult:
    """Select strands by their color, and in a frame also the pixels raised from the plane.

    In a photograph, ribbons of one color are traced from end to end. Ribbons that are short, of varying width, or blurred are
    rejected, and so are shadows: ribbons darker than both sides, but of the same hue.

    Parameters
    ----------
    data
        a Frame, or an Image.
    config
        section `segment` of the settings.
    seed
        seed of the random draws of RANSAC.

    Returns
    -------
    (H, W) bool, with a note on the bands that were rejected.

    Raises
    ------
    InputError : the data is a cloud.
    """
    data = require_image(data, "strands")
    if isinstance(data, Image):
        return select_in_image(data.color)
    raised = plane.mask(data, config, seed)
    return select_in_frame(raised.mask, data)._replace(plane=raised.plane)


def select_in_image(color: Array, pixels: int = IMAGE_PIXELS) -> MethodResult:
    """Select strands in a photograph (H, W, 3) uint8 RGB, which is scaled down first if it has more than `pixels` pixels."""
    shape = color.shape[:2]
    if max(shape) > MAX_ASPECT * min(shape):
        return MethodResult(np.zeros(shape, dtype=bool), ASPECT_NOTE.format(shape[1], shape[0], MAX_ASPECT))
    shrink = max(1.0, (shape[0] * shape[1] / pixels) ** 0.5)
    color = np.ascontiguousarray(color)
    if shrink > 1:
        color = cv2.resize(color, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    lab = to_lab(color)
    chosen, shadows = choose_strands(trace_strands(find_ribbons(lab)), color, lab)
    selected = np.zeros(shape, dtype=bool)
    scale = np.array((shape[1] / color.shape[1], shape[0] / color.shape[0]))

    def pixels_of(strand: CheckedStrand) -> Bools:
        return draw_strand((strand.line + 0.5) * scale - 0.5, strand.width * float(scale.mean()), shape)

    for strand in chosen:
        selected |= pixels_of(strand)
    note = "" if selected.any() else rejection_note("strands", len(shadows), SHADOWS)
    return MethodResult(selected, note, rejected=tuple(np.flatnonzero(pixels_of(shadow)) for shadow in shadows))
