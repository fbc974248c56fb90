"""The record of one traversal: the paths, and how much of the skeleton is in none of them."""

from __future__ import annotations

from dataclasses import dataclass

from ...types import Path


@dataclass(frozen=True)
class Traversal:
    """The paths of one frame, and the lengths of skeleton, m (px in 2-D), that were left out of them.

    Attributes
    ----------
    paths
        ordered paths between tips and junctions; closed loops as closed paths.
    spur_length
        of branches with a free end, shorter than `traverse.min_branch`. With the method `contours` it is the number of their
        pixels.
    loop_length
        of loops around holes in the surface, and of the longer one of two branches around such a hole.
    trimmed_length
        of the ends of branches, cut off at tips and where strands touch at junctions.
    """

    paths: list[Path]
    spur_length: float = 0.0
    loop_length: float = 0.0
    trimmed_length: float = 0.0
