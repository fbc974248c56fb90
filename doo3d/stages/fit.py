"""Lay chains of equal segments along paths: Algorithm 2 of Keipour et al. (RA-L 2022)."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ..config import FitConfig
from ..errors import ConfigError
from ..geometry.curves import Curves
from ..geometry.limits import MAX_SAMPLES
from ..geometry.polyline import steps
from ..kernels import traverse_contour
from ..types import Floats, Path
from . import FrameContext


def fit(paths: list[Path], context: FrameContext, config: FitConfig) -> Curves:
    """Lay chains of segments of exactly `context.segment_length` along paths (Keipour et al., RA-L 2022, Algorithm 2).

    A turn of more than `config.max_turn` degrees between two segments ends a chain; the next chain begins there. A closed path is
    followed once around, back to its first point. If that gives a single chain, the chain is marked closed; its last
    joint is normally less than a segment away from its first. Path points farther apart than a segment get points in between
    before chains are laid.

    Parameters
    ----------
    paths
        polylines along the skeleton, m (px in 2-D).
    context
        the data of the frame; only `segment_length` is used.
    config
        section `fit` of the settings.

    Returns
    -------
    The joints of the chains, in the order of the paths and along each path; a path whose points all lie within a segment of its
    start gives none. What is left at the end of a path, less than a segment, is not covered.

    Raises
    ------
    ConfigError : the segments are so short that there would be more than `MAX_SAMPLES`.
    """
    _check_number(paths, context.segment_length)
    chains: list[Floats] = []
    closed: list[bool] = []
    min_cosine = math.cos(math.radians(config.max_turn))
    for path in paths:
        if len(path.points) < 2:
            continue
        points = np.concatenate((path.points, path.points[: int(path.closed)]))
        joints, bounds = traverse_contour(_divided(points, context.segment_length), context.segment_length, min_cosine)
        chains += [joints[start:end] for start, end in itertools.pairwise(bounds.tolist())]
        closed += [path.closed and len(bounds) == 2] * (len(bounds) - 1)
    return Curves.of(chains, closed)


def _check_number(paths: list[Path], length: float) -> None:
    """Raise ConfigError if segments of `length` m (px in 2-D) would be so many that nothing could come of them."""
    total = math.fsum(float(steps(path.points).sum()) for path in paths)
    if not total <= MAX_SAMPLES * length:
        raise ConfigError(
            f"fit.segment_length: {length:g} would make {total / length:.0f} segments in this frame: give it in m, in 2-D in px, "
            "as long as a few radii",
            code="value-out-of-bounds",
        )


def _divided(points: Floats, length: float) -> Floats:
    """Return the polyline (P, D) with points added so that no step is longer than `length` m (px in 2-D)."""
    parts = np.maximum(1, np.ceil(steps(points) / length)).astype(int)
    if (parts == 1).all():
        return points
    positions = np.concatenate([*(i + np.arange(count) / count for i, count in enumerate(parts)), [len(parts)]])
    return np.column_stack([np.interp(positions, np.arange(len(points)), column) for column in points.T])
