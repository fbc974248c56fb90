"""Points in the cells of a sparse grid, and how dense they lie."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..types import Bools, Floats, Ints

SAMPLE_POINTS, SAMPLE_SEEDS = 8000, 80
"""Points of a cloud, and places in it, that its density is measured on."""

KEY_LIMIT = 2**62
"""Keys are 64-bit; the box must have fewer cells than this."""


@dataclass(frozen=True)
class Cells:
    """Occupied cells of a box: keys (M,) int64 ascending, shape (D,) of the box, cell (N,) index of each point's cell."""

    keys: Ints
    shape: tuple[int, ...]
    cell: Ints

    @property
    def coords(self) -> Ints:
        """(M, D) int64, place of each cell in the box, in lexicographic order."""
        return unpack_keys(self.keys, self.shape)

    def sums(self, values: Floats) -> Floats:
        """(N, C) values of the points -> (M, C) their sums in each cell."""
        return np.column_stack([np.bincount(self.cell, weights=column, minlength=len(self.keys)) for column in values.T])


def voxelize_points(points: Floats, origin: Floats, size: float, margin: int) -> Cells | float:
    """Points (N, D) in cells of `size` from `origin`, in a box with `margin` free cells beyond the last; or, where the box is
    too large for 64-bit keys, the number of its cells.
    """
    places = np.floor((points - origin) / size)
    shape = places.max(axis=0) + margin + 1
    total = math.prod(shape.tolist())
    if total > KEY_LIMIT:
        return float(total)
    box = tuple(int(side) for side in shape)
    cell = np.ravel_multi_index(tuple(places.astype(np.int64).T), box).astype(np.int64)
    keys = sorted_unique(cell)
    return Cells(keys, box, np.searchsorted(keys, cell))


def unpack_keys(keys: Ints, shape: tuple[int, ...]) -> Ints:
    """Keys (M,) -> coords (M, D)."""
    return np.column_stack(np.unravel_index(keys, shape)).astype(np.int64)


def sorted_unique(keys: Ints) -> Ints:
    """The different keys, ascending. (np.unique hashes integers, which is slower than sorting nearly sorted ones.)"""
    keys = np.sort(keys)
    return keys[np.concatenate(([True], keys[1:] != keys[:-1]))] if len(keys) else keys


def contains(keys: Ints, wanted: Ints) -> Bools:
    """Which of the wanted keys are among the ascending keys."""
    at = np.searchsorted(keys, wanted)
    at[at == len(keys)] = 0
    return np.asarray(keys[at] == wanted)


def cloud_spacing(points: Floats) -> float:
    """Typical distance between neighbouring points (N, 3) of a surface, m, from how many lie in a disc."""
    sample = points[:: max(1, len(points) // SAMPLE_POINTS)]
    nearest = min(8, len(sample) - 1)
    if nearest < 1:
        return 1e-3
    distance = cKDTree(sample).query(sample[:: max(1, len(sample) // SAMPLE_SEEDS)], k=[nearest + 1])[0][:, 0]
    found = float(np.median(distance)) * math.sqrt(math.pi / nearest) * math.sqrt(len(sample) / len(points))
    return max(found, 1e-6)
