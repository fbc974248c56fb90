"""The record of one segmentation: the method, and the numbers of pixels or points selected and dropped."""

from __future__ import annotations

from dataclasses import dataclass

from ..scene.scene import Scene
from ..types import Plane

MASK = "mask"
"""Method of a segmentation whose mask the caller gave."""

EXTENDED = "extended"
"""Method of a segmentation whose mask is another one's, extended along strands by `extend_mask`."""


@dataclass(frozen=True)
class Segmentation:
    """The scene of one frame, and how many pixels (points of a cloud) each step selected and dropped.

    - Pixels in the mask = selected - removed_small + closed_holes - removed_wide - split.
    - Points of an Image = pixels in the mask.
    - Points of a Frame = pixels in the mask - without_depth - outliers + inpainted.
    - Points of a Cloud = selected - outliers; the other numbers are 0.

    Attributes
    ----------
    scene
        the points of the object, with mask and camera if there are any.
    method
        "mask" if the caller gave a mask, "extended" if `extend_mask` extended one; otherwise the name of the segmentation method
        that was used.
    selected
        pixels or points that the method took for the object, after a ragged mask was repaired and before anything was dropped.
    removed_small
        pixels removed in connected components of fewer than `segment.min_component` pixels.
    removed_wide
        pixels removed in regions wider than `segment.max_width`, or than `segment.max_width_ratio` times the usual width.
    without_depth
        pixels of the mask without a reading between `segment.min_depth` and `segment.max_depth`; 0 in 2-D.
    inpainted
        pixels among `without_depth` whose depth was filled in from the readings around them.
    outliers
        readings dropped because too few of their neighbors agree; in a cloud, points with few neighbors or far from the rest.
    closed_holes
        pixels added in holes of the mask smaller than `segment.min_component`.
    repaired
        pixels that were added to a ragged mask, or removed from it, because of their color; 0 in 2-D and for a cloud.
    smoothed
        readings whose depth was smoothed along the strand, where depth is torn or comes in waves; 0 in 2-D and for a cloud.
    split
        pixels removed between strands that run side by side, so that each is a piece of its own.
    limits
        messages to the user: what was left out of too large a frame or cloud, to bound time and memory.
    choice
        a sentence on the method that `auto` took where nobody said what the object is, with advice; else empty.
    base
        if `method` is "extended", the first segmentation, whose mask was extended; None otherwise.
    plane
        the plane from which the method separated the object, its normal to either side; None for other methods.
    """

    scene: Scene
    method: str
    selected: int
    removed_small: int = 0
    removed_wide: int = 0
    without_depth: int = 0
    inpainted: int = 0
    outliers: int = 0
    closed_holes: int = 0
    repaired: int = 0
    smoothed: int = 0
    split: int = 0
    limits: tuple[str, ...] = ()
    choice: str = ""
    base: Segmentation | None = None
    plane: Plane | None = None
