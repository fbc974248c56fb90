"""Remove outliers from the points of a cloud, and average their noise away."""

from __future__ import annotations

import numpy as np

from ...geometry.sparse_grid import cloud_spacing, voxelize_points
from ...kernels import neighbor_table
from ...types import Bools, Floats

NEIGHBORHOOD_CELL_SPACINGS = 2.0
"""Point spacings; edge of the cells of which 3 x 3 x 3 hold the neighbors of a point of a cloud. Finer ones would be
empty here and there on a surface."""

MIN_NEIGHBORS_RATIO = 0.15
"""Fraction of the median number of neighbors that a point of a cloud must have, or it is a flying point."""

FAR_OUTLIER_BOX_SIZES = 3
"""Diagonals of the box of the central 96 % of the points beyond which, outside that box, a point is a far outlier."""

MAX_POINTS = 1_000_000
"""Points of a cloud that are used at most, for time (about 1 s) and memory; ten times as many as an object of 10 m needs."""


def draw_points(points: Floats, seed: int) -> tuple[Floats, tuple[str, ...]]:
    """Return MAX_POINTS of the points (N, 3), drawn at random, where there are more, and a message to the user that says so.

    They are drawn, not taken at a stride: every k-th point of rows and columns leaves gaps in one direction.
    """
    if len(points) <= MAX_POINTS:
        return points, ()
    drawn = np.random.default_rng(seed).random(len(points)) < MAX_POINTS / len(points)
    note = f"segment: of {len(points)} points about {MAX_POINTS}, drawn at random, are used, to bound time and memory"
    return points[drawn], (note,)


def filter_points(points: Floats) -> tuple[Floats, Floats, int]:
    """Drop the outliers of a cloud of N points, (N, 3) m, and average the noise of the other points away.

    Outliers are points far from all others, and points with less than 0.15 times the median number of neighbors.

    Returns
    -------
    points : (K, 3) m, the K points kept, in the order given, as measured.
    means : (K, 3) m, for each point kept the mean of the point and its neighbors.
    outliers : number of points dropped, N - K.
    """
    near = points[~far_outliers(points)]
    neighbors, means = mean_neighbors(near, NEIGHBORHOOD_CELL_SPACINGS)
    kept = neighbors >= MIN_NEIGHBORS_RATIO * np.median(neighbors) if len(near) else np.zeros(0, dtype=bool)
    return near[kept], means[kept], len(points) - int(np.count_nonzero(kept))


def mean_neighbors(points: Floats, cell_spacings: float) -> tuple[Floats, Floats]:
    """Count the neighbors of each point of a cloud, and average their positions.

    Points are sorted into cubic cells. The neighbors of a point are all points in its cell and in the 26 cells around that cell,
    the point itself included.

    Parameters
    ----------
    points
        (N, 3) m, the N points of the cloud.
    cell_spacings
        edge of a cell, as a multiple of the typical distance between neighboring points of the cloud.

    Returns
    -------
    counts : (N,) float, number of neighbors of each point.
    means : (N, 3) m, mean position of the neighbors of each point. If the cloud is too wide for such small cells, each point is
        its own only neighbor.
    """
    if not len(points):
        return np.zeros(0), points
    size = cell_spacings * cloud_spacing(points)
    cells = voxelize_points(points, points.min(axis=0) - size, size, 1)
    if isinstance(cells, float):
        return np.ones(len(points)), points
    sums = cells.sums(np.column_stack((points, np.ones(len(points)))))
    padded = np.vstack((sums, np.zeros(4)))
    for neighbor in neighbor_table(cells.coords).T:
        sums += padded[neighbor]
    return sums[cells.cell, 3], sums[cells.cell, :3] / sums[cells.cell, 3:]


def far_outliers(points: Floats) -> Bools:
    """Tell which of N points, (N, 3) m, lie far from the rest: (N,) bool.

    A point is far if it lies outside the axis-aligned box of the central 96 % of the points by more than three times the diagonal
    of that box.
    """
    low, high = np.percentile(points, [2, 98], axis=0) if len(points) else np.zeros((2, 3))
    margin = FAR_OUTLIER_BOX_SIZES * np.linalg.norm(high - low)
    return np.asarray(((points < low - margin) | (points > high + margin)).any(axis=1))
