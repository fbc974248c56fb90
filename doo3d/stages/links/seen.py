"""Gaps that are none in the image: a strand goes on from one end to another in the mask, and only its depth was lost.

A stereo camera loses the depth of a strand in stretches: where it bends towards the camera, beside a finger, where it is thin.
The chains end there, though the strand is seen. The lines along the mask's skeleton, from one place where strands meet to the
next, tell which two ends such a stretch joins: those that follow each other on one line and point along it towards each other,
with no other chain in between. Where strands cross, the lines end, and the terms decide.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ...geometry.curves import Curves
from ...geometry.polyline import steps
from ...geometry.radii import TOUCHING_RADII
from ...kernels import nearest
from ...types import Camera, Floats, Ints
from .. import FrameContext


def seen_gaps(points: Floats, tangents: Floats, chains: Curves, context: FrameContext) -> dict[tuple[int, int], Floats]:
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
    inverse depth is interpolated, since in the image that of a straight line changes evenly. Empty for a cloud and in 2-D.
    """
    camera, facts = context.foreground.camera, context.foreground.facts
    if camera is None or facts is None or len(chains) < 2:
        return {}
    px = camera.fx * context.radius / float(np.median(points[:, 2]))
    lines = facts.strand_lines(px)
    if not len(lines):
        return {}
    seen = camera.project(points)
    ahead = camera.project(points + context.radius * tangents) - seen
    distance, at = nearest(seen, lines.points, TOUCHING_RADII * px, True)
    on = np.flatnonzero(np.isfinite(distance) & ~np.repeat(chains.closed, 2))
    pairs = list(_facing_pairs(at, on, ahead, lines, TOUCHING_RADII * px))
    if not pairs:
        return {}
    chain_at = _chain_at(lines.points, chains, camera, TOUCHING_RADII * px)
    found = {}
    for a, b in pairs:
        if np.isin(chain_at[at[a] : at[b] + 1], (-1, a // 2, b // 2)).all():
            line = _lifted(lines.points[at[a] : at[b] + 1], points[[a, b]], camera)
            found[min(a, b), max(a, b)] = line if a < b else line[::-1]
    return found


def _facing_pairs(at: Ints, on: Ints, ahead: Floats, lines: Curves, least: float) -> Iterator[tuple[int, int]]:
    """Return pairs of ends of two chains that follow each other on one line, `least` px apart, and point towards each other.

    at : (E,), the nearest point of all lines. on : the ends that are on a line. ahead : (E, 2) px, direction out of the chain.
    """
    order = on[np.argsort(at[on], kind="stable")].tolist()
    for a, b in pairwise(order):
        if a // 2 == b // 2 or lines.owner[at[a]] != lines.owner[at[b]]:
            continue
        line = lines.points[at[a] : at[b] + 1]
        along = np.cumsum(steps(line))
        if not len(along) or along[-1] < least:
            continue
        first, last = np.searchsorted(along, least), len(line) - 2 - np.searchsorted(along[-1] - along[::-1], least)
        if (line[first] - line[0]) @ ahead[a] > 0 and (line[last] - line[-1]) @ ahead[b] > 0:
            yield a, b


def _chain_at(points: Floats, chains: Curves, camera: Camera, reach: float) -> Ints:
    """Return the number of the chain that covers each of P points (P, 2) px in the image, -1 where none is within `reach` px."""
    joints = Curves(camera.project(chains.points), chains.bounds, chains.closed)
    counts = 2 + (2 * joints.lengths / reach).astype(np.int64)
    dense, _ = joints.sampled(joints.lengths / (counts - 1), counts, np.ones(len(chains), dtype=bool))
    distance, near = nearest(points, dense.points, reach, True)
    return np.where(np.isfinite(distance), dense.owner[near], -1)


def _lifted(line: Floats, ends: Floats, camera: Camera) -> Floats:
    """Return the points (P, 3) m of a line (P, 2) px between two ends (2, 3) m."""
    along = np.concatenate(([0.0], np.cumsum(steps(line))))
    share = along / along[-1]
    points = camera.unproject(line, 1 / ((1 - share) / ends[0, 2] + share / ends[1, 2]))
    return np.concatenate((ends[:1], points[1:-1], ends[1:]))
