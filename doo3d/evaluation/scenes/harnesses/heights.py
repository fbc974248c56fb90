"""Compute the heights of strands: crossing over each other on a table, or hanging in the air."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from ....types import Floats
from ..curves import STEP
from .kinds import Kind
from .strands import NEAR_JUNCTION_RADII, Strand, crossings_of


def lay(rng: Generator, strands: list[Strand], radius: float, kind: Kind) -> bool:
    """Lift the upper strand over the lower one at each crossing; return False if that is impossible."""
    for a, p, b, q in crossings_of(strands, 0.0):
        upper_first = strands[a].trunk if kind.under and strands[a].trunk != strands[b].trunk else bool(rng.random() < 0.5)
        (up, at), (low, below) = ((a, p), (b, q)) if upper_first else ((b, q), (a, p))
        both = strands[up].radius + strands[low].radius
        gap = 1.05 * both * (rng.uniform(1, 5) if kind.hanging else 1.0)
        need = strands[low].height[below] + gap - strands[up].height[at]
        width = max(7 * both, 3 * need) / STEP
        along = np.arange(len(strands[up].curve)) - at
        strands[up].height = strands[up].height + max(need, 0.0) * np.exp(-((along / width) ** 2) * 2)
        ends = strands[up].height[[0, -1]] - [strands[up].height.min()] * 2
        if (ends > 2.5 * radius).any():
            return False
    return _join(strands)


def _join(strands: list[Strand]) -> bool:
    """Raise all strands at a node to the height of the highest, with a smooth transition along each strand."""
    top: dict[int, float] = {}
    shared: dict[int, int] = {}
    for strand in strands:
        for node, height in zip(strand.nodes, strand.height[[0, -1]], strict=True):
            top[node] = max(top.get(node, 0.0), float(height))
            shared[node] = shared.get(node, 0) + 1
    for strand in strands:
        along = np.arange(len(strand.curve)) * STEP
        for side, node in enumerate(strand.nodes):
            if shared[node] > 1:
                missing = top[node] - strand.height[-side]
                strand.height = strand.height + missing * np.exp(-(((along if side == 0 else along[-1] - along) / 0.02) ** 2))
    return True


def are_clear(axes: list[Floats], strands: list[Strand], radius: float) -> bool:
    """Return whether no two strands intersect, except at their common nodes."""
    for a, first in enumerate(axes):
        for b in range(a + 1, len(axes)):
            both = strands[a].radius + strands[b].radius
            distance = cKDTree(axes[b]).query(first)[0]
            close = distance < 0.97 * both
            for node in set(strands[a].nodes) & set(strands[b].nodes):
                at = first[0] if strands[a].nodes[0] == node else first[-1]
                close &= np.linalg.norm(first - at, axis=1) > 1.6 * NEAR_JUNCTION_RADII * radius
            if close.any():
                return False
    return True


def hanging_shape(rng: Generator) -> Callable[[Floats], Floats]:
    """Return a smooth random height function over the plane, (P, 2) m -> (P,) m, for objects that hang in the air."""
    waves = rng.normal(size=(3, 2)) * 9.0
    phases, size = rng.uniform(0, 6, 3), rng.uniform(0.008, 0.02)
    return lambda points: np.asarray(size * np.sin(points @ waves.T + phases).sum(axis=1))
