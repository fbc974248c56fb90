"""Gaps that are none in the image: a strand goes on from one end to another in the mask, and only its depth was lost.

A stereo camera loses the depth of a strand in stretches: where it bends towards the camera, beside a finger, where it is thin.
The chains end there, though the strand is seen. The lines along the mask's skeleton, from one place where strands meet to the
next, tell which two ends such a stretch joins: those that follow each other on one line and point along it towards each other,
with no other chain in between. Where strands cross, the lines end, and the terms decide.
"""

from __future__ import annotations

from statistics import median
from typing import TypeAlias

import numpy as np

from ..geometry.curves import Curves
from ..geometry.limits import MAX_BRANCHES
from ..geometry.radii import TOUCHING_RADII
from ..kernels import gaps_along_lines
from ..scene.context import FrameContext
from ..types import Floats

NOTE = "merge: the mask's skeleton has {} branches, so gaps between chains are not looked for along them; that is done up to {}"

Gaps: TypeAlias = "dict[tuple[int, int], Floats]"
"""Rows of two ends, the lower first -> (P, 3) m, the points from the first to the second."""


def seen_gaps(points: Floats, tangents: Floats, chains: Curves, context: FrameContext) -> tuple[Gaps, tuple[str, ...]]:
    """Return the gaps between chain ends along which the object is seen in the mask.

    Parameters
    ----------
    points
        (E, 3) m in the camera's optical frame, the ends: row 2 c and 2 c + 1 of chain c.
    tangents
        (E, 3) unit, out of the chains.
    chains
        the joints of the chains.
    context
        the data of the frame; its mask, camera and radius are used.

    Returns
    -------
    Rows of two ends, the lower first -> (P, 3) m, points along the middle of the mask from the first end to the second. Their
    inverse depth is interpolated, since in the image that of a straight line changes evenly. Empty for a cloud, in 2-D, and where
    the object behind a place makes it free space: a pile fills the mask between any two ends. And messages to the user: that the
    mask's skeleton has too many branches.
    """
    camera, facts = context.foreground.camera, context.foreground.facts
    if camera is None or facts is None or len(chains) < 2:
        return {}, ()
    if context.visibility is not None and getattr(context.visibility.model, "own_object_counts_as_free", False):
        return {}, ()
    branches = len(facts.skeleton[1]) - 1
    if branches > MAX_BRANCHES:
        return {}, (NOTE.format(branches, MAX_BRANCHES),)
    px = camera.fx * context.radius / median(points[:, 2].tolist())
    lines = facts.strand_lines(px)
    if not len(lines):
        return {}, ()
    curves, intrinsics = (chains.points, chains.bounds, chains.closed), camera.intrinsics
    pairs, found, bounds = gaps_along_lines(
        points, tangents, *curves, intrinsics, context.radius, lines.points, lines.bounds, TOUCHING_RADII * px
    )
    between = zip(pairs.tolist(), Curves(found, bounds, np.zeros(len(pairs), dtype=bool)), strict=True)
    return {(min(a, b), max(a, b)): line if a < b else line[::-1] for (a, b), line in between}, ()
