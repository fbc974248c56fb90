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
    """Chains of segments of exactly `segment_length`; a turn of more than `max_turn` degrees ends a chain.

    A closed path that makes one chain is walked back to its first point and gives a closed chain, whose last
    joint is then less than a segment from the first. Steps longer than a segment are divided: the algorithm lays at
    most one segment at each point and would fall behind.
    """
    chains: list[Chain] = []
    least = math.cos(math.radians(config.max_turn))
    for path in paths:
        if len(path.points) < 2:
            continue
        points = np.concatenate((path.points, path.points[: int(path.closed)]))
        joints, bounds = traverse_contour(_divided(points, context.segment_length), context.segment_length, least)
        closed = path.closed and len(bounds) == 2
        for start, end in itertools.pairwise(bounds.tolist()):
            chains.append(Chain(joints[start:end], context.segment_length, closed=closed))
    return chains


def _divided(points: Floats, length: float) -> Floats:
    """The polyline (P, D) with points added so that no step is longer than `length`."""
    parts = np.maximum(1, np.ceil(steps(points) / length)).astype(int)
    if (parts == 1).all():
        return points
    at = np.concatenate([*(i + np.arange(count) / count for i, count in enumerate(parts)), [len(parts)]])
    return np.column_stack([np.interp(at, np.arange(len(points)), column) for column in points.T])
