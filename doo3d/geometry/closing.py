"""Morphological closing of a sparse grid."""

from __future__ import annotations

import math

import numpy as np

from ..types import Ints
from .sparse_grid import contains, sorted_unique


def close_cells(keys: Ints, shape: tuple[int, ...], times: int) -> Ints:
    """Morphological closing with a (2 times + 1)-cube on ascending keys of a box padded by more than `times`.

    The cube is separable: one axis after the other, dilations first.
    """
    strides = [math.prod(shape[d + 1 :]) for d in range(len(shape))]
    closed = keys
    for stride in strides:
        for _ in range(times):
            closed = sorted_unique(np.concatenate((closed, closed - stride, closed + stride)))
    for stride in strides:
        for _ in range(times):
            closed = closed[contains(closed, closed - stride) & contains(closed, closed + stride)]
    return sorted_unique(np.concatenate((closed, keys))) if times else keys
