"""Points of a cloud with few neighbours."""

from __future__ import annotations

import numpy as np

from ...geometry.sparse_grid import cloud_spacing, voxelize_points
from ...kernels.thinning import neighbor_table
from ...types import Bools, Floats


def neighbourhood(points: Floats, window: float) -> tuple[Floats, Floats]:
    """How many points of a cloud lie about each, and their mean.

    Neighbours are those in the same cell and the 26 round it, cells of `window` point spacings. Returns (N,) and (N, 3) m.
    """
    if not len(points):
        return np.zeros(0), points
    size = window * cloud_spacing(points)
    cells = voxelize_points(points, points.min(axis=0) - size, size, 1)
    if isinstance(cells, float):
        return np.ones(len(points)), points
    sums = cells.sums(np.column_stack((points, np.ones(len(points)))))
    sums = sums + np.vstack((sums, np.zeros(4)))[neighbor_table(cells.coords)].sum(axis=1)
    return sums[cells.cell, 3], sums[cells.cell, :3] / sums[cells.cell, 3:]


def lone(points: Floats) -> Bools:
    """Which of the points (N, 3) lie far outside the box of the rest, three times its size away from it."""
    low, high = np.percentile(points, [2, 98], axis=0) if len(points) else np.zeros((2, 3))
    margin = 3 * np.linalg.norm(high - low)
    return np.asarray(((points < low - margin) | (points > high + margin)).any(axis=1))
