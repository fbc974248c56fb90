"""Select what looks like a strand: a band of one width, told by its color from both sides, or raised from the plane."""

from __future__ import annotations

import cv2
import numpy as np

from ...config import SegmentConfig
from ...errors import InputError
from ...types import Array, Cloud, Frame, Image
from ..color_strands import select_in_frame
from ..ribbon_checks import choose_strands, draw_strand
from ..ribbons import find_ribbons, to_lab, trace_strands
from . import plane
from .selected import SHADOWS, Selected, left_out_note

IMAGE_PIXELS = 640 * 360
"""Pixels; larger photographs are scaled down to this many before strands are looked for."""

MAX_ASPECT = 16
"""Length of a photograph over its width at most: it is turned in all directions, which takes the square of its length."""

ASPECT_NOTE = "segment (strands): in a photograph of {}x{} px, over {} times as long as wide, no strands are looked for: crop it"


def mask(data: Frame | Cloud | Image, config: SegmentConfig, seed: int) -> Selected:
    """Select strands by their color, and in a frame also what is raised from the plane.

    In a photograph, ribbons of one color are traced from end to end; those that are short, uneven, soft, or darker than both
    sides without another color (shadows) are left out.

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
    (H, W) bool, with a note on what was left out.

    Raises
    ------
    InputError : the data is a cloud.
    """
    if isinstance(data, Cloud):
        raise InputError(
            "segment.method is strands, which needs an image: for a cloud use plane or everything", code="method-needs-image"
        )
    if isinstance(data, Image):
        return select_in_image(data.color)
    raised = plane.mask(data, config, seed)
    return select_in_frame(raised.mask, data)._replace(plane=raised.plane)


def select_in_image(color: Array, pixels: int = IMAGE_PIXELS) -> Selected:
    """Select strands in a photograph (H, W, 3) uint8 RGB; one with more pixels is scaled down to so many before."""
    shape = color.shape[:2]
    if max(shape) > MAX_ASPECT * min(shape):
        return Selected(np.zeros(shape, dtype=bool), ASPECT_NOTE.format(shape[1], shape[0], MAX_ASPECT))
    shrink = max(1.0, (shape[0] * shape[1] / pixels) ** 0.5)
    color = np.ascontiguousarray(color)
    if shrink > 1:
        color = cv2.resize(color, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    lab = to_lab(color)
    chosen, shadows = choose_strands(trace_strands(find_ribbons(lab)), color, lab)
    selected = np.zeros(shape, dtype=bool)
    scale = np.array((shape[1] / color.shape[1], shape[0] / color.shape[0]))
    for strand in chosen:
        selected |= draw_strand((strand.line + 0.5) * scale - 0.5, strand.width * float(scale.mean()), shape)
    drawn = (draw_strand((each.line + 0.5) * scale - 0.5, each.width * float(scale.mean()), shape) for each in shadows)
    note = "" if selected.any() else left_out_note("strands", len(shadows), SHADOWS)
    return Selected(selected, note, left_out=tuple(map(np.flatnonzero, drawn)))
