"""The record of one segmentation: the method, and the numbers of pixels or points selected and dropped."""

from __future__ import annotations

from dataclasses import dataclass

from ...types import Foreground

MASK = "mask"
"""Method of a segmentation whose mask the caller gave."""

EXTENDED = "extended"
"""Method of a segmentation whose mask is another one's, extended along strands by `extend_mask`."""


@dataclass(frozen=True)
class Segmentation:
    """The foreground of one frame, and how many pixels (points of a cloud) each step selected and dropped.

    With a mask, `selected - removed_small + closed_holes - removed_wide` is its number of pixels, and with depth that number
    `- without_depth - outliers + inpainted` is the number of points. Of a cloud `selected - outliers` is the number of points.

    Attributes
    ----------
    foreground
        the points of the object.
    method
        `mask` where the caller gave one, `extended` where `extend_mask` did; else that of the config, `auto` resolved.
    selected
        pixels or points that the method took for the object, before anything was dropped.
    removed_small
        pixels in connected pieces of fewer than `segment.min_component` pixels.
    removed_wide
        pixels in regions wider than `segment.max_width`, or than `segment.max_width_ratio` times the usual width.
    without_depth
        pixels of the mask without a reading between `segment.min_depth` and `segment.max_depth`; 0 in 2-D.
    inpainted
        pixels of `without_depth` that got the depth of the readings around them.
    outliers
        readings that too few of their neighbors agree with; points of a cloud with few neighbors, or far from the rest.
    closed_holes
        pixels of holes in the mask that were closed, as they were smaller than `segment.min_component`.
    base
        for `extended` the first segmentation, whose mask was extended; None otherwise.
    """

    foreground: Foreground
    method: str
    selected: int
    removed_small: int
    removed_wide: int
    without_depth: int
    inpainted: int
    outliers: int
    closed_holes: int = 0
    base: Segmentation | None = None
