"""The record of one traversal: the paths, and how much of the skeleton is in none of them."""

from __future__ import annotations

from dataclasses import dataclass

from ...types import Path


@dataclass(frozen=True)
class Traversal:
    """The polylines along the skeleton of one frame, and the lengths of skeleton that are in none of them.

    Lengths are totals in m (px in 2-D). With the method `contours` only `spur_length` is measured.

    Attributes
    ----------
    paths
        one polyline per branch between tips and junctions, a loop as a closed polyline; with `contours` one per contour.
    spur_length
        length of the spurs removed: branches with a free end, shorter than `traverse.min_branch` radii. With `contours` the
        number of pixels in the spurs.
    loop_length
        length of the small loops removed, which run around holes in the surface.
    trimmed_length
        length cut off the ends of branches: at tips, and where strands touch at junctions.
    notes
        messages to the user, one sentence each: that there were too many branches.
    """

    paths: list[Path]
    spur_length: float = 0.0
    loop_length: float = 0.0
    trimmed_length: float = 0.0
    notes: tuple[str, ...] = ()
