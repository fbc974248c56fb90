"""Lay chains of equal segments along paths: Algorithm 2 of Keipour et al. (RA-L 2022)."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ..config import FitConfig
from ..geometry.polyline import steps
from ..kernels import traverse_contour
from ..types import Chain, Floats, Path
from . import FrameContext


def fit(paths: list[Path], context: FrameContext, config: FitConfig) -> list[Chain]:
    """Lay chains of segments of exactly `segment_length` along paths (Keipour et al., RA-L 2022, Algorithm 2).

    A turn of more than `max_turn` degrees ends a chain, and the next begins. A closed path that makes one chain is followed
    back to its first point and gives a closed chain, whose last joint is less than a segment from the first. Steps longer
    than a segment are divided first, since the algorithm lays at most one segment at each point.

    Parameters
    ----------
    paths
        polylines along the skeleton, m (px in 2-D).
    context
        what is known of the frame; the segment length is used.
    config
        section `fit` of the settings.

    Returns
    -------
    The chains, in the order of the paths and along them. A path shorter than a segment gives none.
    """
    chains: list[Chain] = []
    min_cosine = math.cos(math.radians(config.max_turn))
    for path in paths:
        if len(path.points) < 2:
            continue
        points = np.concatenate((path.points, path.points[: int(path.closed)]))
        joints, bounds = traverse_contour(_divided(points, context.segment_length), context.segment_length, min_cosine)
        closed = path.closed and len(bounds) == 2
        for start, end in itertools.pairwise(bounds.tolist()):
            chains.append(Chain(joints[start:end], context.segment_length, closed=closed))
    return chains


def _divided(points: Floats, length: float) -> Floats:
    """Return the polyline (P, D) with points added so that no step is longer than `length` m (px in 2-D)."""
    parts = np.maximum(1, np.ceil(steps(points) / length)).astype(int)
    if (parts == 1).all():
        return points
    positions = np.concatenate([*(i + np.arange(count) / count for i, count in enumerate(parts)), [len(parts)]])
    return np.column_stack([np.interp(positions, np.arange(len(points)), column) for column in points.T])
