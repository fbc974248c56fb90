"""The record of one traversal: the paths, and how much of the skeleton is in none of them."""

from __future__ import annotations

from dataclasses import dataclass

from ...types import Path


@dataclass(frozen=True)
class Traversal:
    """The polylines along the skeleton of one frame, and the lengths of skeleton, m (px in 2-D), left out of them.

    Attributes
    ----------
    paths
        one polyline per branch between tips and junctions; a loop is a closed polyline.
    spur_length
        length of the spurs removed: branches with a free end, shorter than `traverse.min_branch`. With the method `contours` it
        is the number of their pixels.
    loop_length
        length of the small loops removed, which run around holes in the surface.
    trimmed_length
        length cut off the ends of branches: at tips, and where strands touch at junctions.
    """

    paths: list[Path]
    spur_length: float = 0.0
    loop_length: float = 0.0
    trimmed_length: float = 0.0
