"""Remove outliers from the points of a cloud, and average their noise."""

import numpy as np

from ..geometry.cells import box_shape, cell_coords, cell_keys, neighbors_of
from ..geometry.disjoint_set import group_sums
from ..geometry.limits import MAX_CELLS
from ..scene.cloud_facts import CELL_SPACINGS, CloudFacts
from ..types import Bools, Floats

MIN_NEIGHBORS_RATIO = 0.15
"""Minimum number of neighbors of a point, as a fraction of the median number; a flying point has fewer."""

FAR_OUTLIER_BOX_SIZES = 3
"""Minimum distance of a far outlier from the box of the central 96 % of the points, in diagonals of that box."""

SPREAD = (0, 0.02, 0.05, 0.95, 0.98, 1)
"""Levels of the quantiles of a cloud's coordinates from which its extent and its far outliers are computed."""

MAX_POINTS = MAX_CELLS // 2
"""Maximum number of points of a cloud that are used, for time (about 1 s) and memory: ten times the need of an object of 10 m."""


def draw_points(points: Floats, seed: int) -> tuple[Floats, tuple[str, ...]]:
    """Return about MAX_POINTS points drawn at random if there are more than that, and a message to the user in that case.

    Every k-th of the points (N, 3) would leave gaps in one direction, if they are stored in rows and columns.
    """
    if len(points) <= MAX_POINTS:
        return points, ()
    drawn = np.random.default_rng(seed).random(len(points)) < MAX_POINTS / len(points)
    note = f"segment: of {len(points)} points about {MAX_POINTS}, drawn at random, are used, to bound time and memory"
    return points[drawn], (note,)


def filter_points(points: Floats, spread: Floats | None = None) -> tuple[CloudFacts, Floats, Floats]:
    """Remove the outliers of a cloud of N points, (N, 3) m, and average the noise of the other points.

    Outliers are points far from all others, and points with less than 0.15 times the median number of neighbors. Points are
    sorted into cubic cells; the neighbors of a point are all points in its cell and in the 26 cells around that cell, the point
    itself included.

    spread : (6, 3) m, the quantiles of the coordinates at the levels SPREAD; None computes them.

    Returns
    -------
    facts : facts of the K points kept.
    points : (K, 3) m, the points kept, in the order given, as measured.
    means : (K, 3) m, for each point kept the mean of the point and its neighbors; the point itself if the cloud is too large
        for a grid of such small cells.
    """
    far = far_outliers(points, spread)
    near = points[~far] if far.any() else points
    facts = CloudFacts(near)
    kept, means = _averaged(near, CELL_SPACINGS * facts.spacing)
    return (facts, near, means) if kept.all() else (CloudFacts(near[kept]), near[kept], means)


def _averaged(points: Floats, edge: float) -> tuple[Bools, Floats]:
    """Return which of N points have enough neighbors, (N,) bool, and the mean of the neighbors of each of these, (K, 3) m."""
    everything = np.ones(len(points), dtype=bool), points
    if not len(points):
        return everything
    origin = points.min(axis=0) - edge
    shape, _ = box_shape(points, origin, edge, 1)
    if not shape:
        return everything
    keys, cell = np.unique(cell_keys(points, origin, edge, shape), return_inverse=True)
    own = group_sums(np.column_stack((points, np.ones(len(points)))), cell, len(keys))
    sums, own = own, np.concatenate((own, np.zeros((1, 4))))
    for beside in neighbors_of(cell_coords(keys, shape)).T:  # index -1 (no cell) is the row of zeros
        sums = sums + own[beside]
    neighbors = sums[:, 3][cell]
    kept = neighbors >= MIN_NEIGHBORS_RATIO * np.median(neighbors)
    return kept, (sums[:, :3] / sums[:, 3:])[cell[kept]]


def far_outliers(points: Floats, spread: Floats | None = None) -> Bools:
    """Return which of N points, (N, 3) m, lie far from the rest, (N,) bool.

    A point is far if it lies outside the axis-aligned box of the central 96 % of the points by more than three times the diagonal
    of that box. `spread` is as for `filter_points`.
    """
    if not len(points):
        return np.zeros(0, dtype=bool)
    least, low, _, _, high, largest = np.quantile(points, SPREAD, axis=0) if spread is None else spread
    margin = FAR_OUTLIER_BOX_SIZES * np.linalg.norm(high - low)
    if (least >= low - margin).all() and (largest <= high + margin).all():
        return np.zeros(len(points), dtype=bool)
    return np.asarray(((points < low - margin) | (points > high + margin)).any(axis=1))
