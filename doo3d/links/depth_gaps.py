"""Depth gaps: two chain ends joined by the mask, where only the depth is missing.

A stereo camera loses the depth of a strand where the strand bends towards the camera, beside a finger, or where it is thin. A
chain ends at such a gap, though the image shows the strand. The middle lines of the mask, from one place where strands meet to
the next, show which two ends belong together: those that follow each other on one line and point along it towards each other,
with no other chain in between. The lines end where strands cross; there the terms decide.
"""

from statistics import median
from typing import TypeAlias

import numpy as np

from ..geometry.curves import Curves
from ..geometry.radii import TOUCHING_RADII
from ..kernels import gaps_along_lines
from ..scene.scene import Scene
from ..types import Floats

Gaps: TypeAlias = "dict[tuple[int, int], Floats]"
"""Rows of two ends, the lower first -> (P, 3) m, the points from the first to the second."""


def depth_gaps(points: Floats, tangents: Floats, chains: Curves, scene: Scene) -> tuple[Gaps, tuple[str, ...]]:
    """Return the gaps between chain ends that lie in the mask, where only the depth is missing.

    Parameters
    ----------
    points
        (E, 3) m in the camera's optical frame, the ends: row 2 c and 2 c + 1 of chain c.
    tangents
        (E, 3) unit, out of the chains.
    chains
        the joints of the chains.
    scene
        what was captured.

    Returns
    -------
    Rows of two ends, the lower first -> (P, 3) m, points along the middle of the mask from the first end to the second. Their
    inverse depth is interpolated, which changes evenly along the image of a straight line. Empty for a cloud, in 2-D, and where
    readings behind the strand count as free space, since a pile fills the mask between any two ends. And messages to the user:
    the mask's skeleton has too many branches.
    """
    if len(chains) < 2:
        return {}, ()
    (lines, radius, intrinsics), notes = scene.strand_lines(median(points[:, -1].tolist()))
    if not len(lines):
        return {}, notes
    curves = chains.points, chains.bounds, chains.closed
    pairs, found, bounds = gaps_along_lines(
        points, tangents, *curves, intrinsics, scene.radius, lines.points, lines.bounds, TOUCHING_RADII * radius
    )
    between = zip(pairs.tolist(), Curves(found, bounds, np.zeros(len(pairs), dtype=bool)), strict=True)
    return {(min(a, b), max(a, b)): line if a < b else line[::-1] for (a, b), line in between}, ()
