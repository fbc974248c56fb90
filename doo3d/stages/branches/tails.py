"""Cut off tails: ends of chains that run on inside another strand, past the junction of the two."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...types import Chain, Floats
from .strands import INSIDE_DEPTH_RADII, NODE_RADII, SampledChain, box_distances, inside
from .tree import stretch_of


def without_tails(strands: Sequence[SampledChain], viewpoint: Floats | None, length: float) -> list[Chain]:
    """Cut off the ends of chains that run inside another strand. Where two chains run inside each other, one is cut.

    Parameters
    ----------
    strands
        all chains as samples, m (px in 2-D).
    viewpoint
        (3,) m, position of the camera: differences along its view count less. None in 2-D, and where it is unknown.
    length
        segment length, m (px in 2-D).

    Returns
    -------
    The chains in the same order: the parts left of those that were cut, and the others as they are.
    """
    bounds = [[0.0, strand.length] for strand in strands]
    distances = box_distances(np.concatenate([strand.points[[0, -1]] for strand in strands]), strands)
    widths = np.array([_reach(float(strand.radii.max()), 0.0) for strand in strands])
    for number, strand in enumerate(strands):
        if strand.closed:
            continue
        for side in (0, 1):
            near = np.flatnonzero(distances[2 * number + side] <= widths + _reach(0.0, strand.radius)).tolist()
            others = (strands[k] for k in near if k != number and bounds[k] == [0.0, strands[k].length])
            tail = max((_tail(strand, side, other, viewpoint) for other in others), default=0.0)
            if 0 < tail < strand.length - NODE_RADII * strand.radius:
                bounds[number][side] += tail if side == 0 else -tail
    result = []
    for strand, (low, high) in zip(strands, bounds, strict=True):
        is_cut = (low, high) != (0.0, strand.length) and high - low > NODE_RADII * strand.radius
        result.append((stretch_of(strand, low, high, length) if is_cut else None) or strand.chain)
    return result


def _reach(radius: float, other: float) -> float:
    """Return how far from the axis of one strand another one that runs inside it may begin, m (px in 2-D), by their radii."""
    return (1 + INSIDE_DEPTH_RADII) * (radius + other)


def _tail(strand: SampledChain, side: int, other: SampledChain, viewpoint: Floats | None) -> float:
    """Return the length from an end on along which a strand runs inside another one that goes on; 0 if it is short."""
    reach = _reach(float(other.radii.max()), strand.radius)
    if np.linalg.norm(other.points - strand.points[-side], axis=1).min() > reach:
        return 0.0
    is_inside, nearest = inside(strand, other, viewpoint)
    if side == 1:
        is_inside, nearest = is_inside[::-1], nearest[::-1]
    outside = np.flatnonzero(~is_inside)
    both = float(other.radii[nearest[0]]) + strand.radius
    if not len(outside) or other.is_near_end(float(other.along[nearest[0]]), both):
        return 0.0
    length = float(outside[0]) * strand.length / (len(strand.points) - 1)
    return length if length > NODE_RADII * both else 0.0
