"""Paths to chains of equal segments: the paper's Algorithm 2."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ..config import FitConfig
from ..geometry.polyline import steps
from ..kernels.segment_fitting import traverse_contour
from ..types import Chain, Floats, Path
from . import FrameContext


def fit(paths: list[Path], context: FrameContext, config: FitConfig) -> list[Chain]:
    """Return chains of segments of exactly `segment_length` along the paths; sharp turns end a chain.

    A turn of more than `max_turn` degrees is sharp. A closed path that makes one chain is followed back to its first point
    and gives a closed chain, whose last joint is then less than a segment from the first. Steps longer than a segment are
    divided: the algorithm lays at most one segment at each point and would fall behind.
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
