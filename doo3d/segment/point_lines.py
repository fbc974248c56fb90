"""Fit straight lines to the neighborhoods of points, to detect sparse clouds, whose points follow one another along strands.

The lines of a scanner that pass along one thick strand look like several thin strands. They differ in cross-section, in which
they lie on the arc of a circle.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.disjoint_set import group_sums, joined_groups
from ..geometry.polyline import perpendicular
from ..kernels import fit_lines
from ..types import Floats, Ints

MAX_SEEDS = 60
"""Approximate number of points at which lines are fitted to decide whether a cloud is sparse."""

MAX_NEIGHBORS = 96
"""Maximum number of nearest neighbors of a point among which its line is searched."""

MIN_LINE_POINTS = 7
"""Minimum number of points of a line while the scale of the lines is unknown."""

MAX_SPREAD_RATIO = 1 / 12
"""Maximum ratio of the variances of a line's points across and along it; points spread over a surface have a quarter."""

LINE_WIDTH = 0.5
"""Maximum distance of a line's points from it, as a fraction of its half length."""

MIN_LINE_FRACTION = 0.6
"""Minimum fraction of the seeds that have a line, in a sparse cloud."""

MAX_POINTS_ACROSS = 5.0
"""Maximum number of points in a square as wide as the strand; with more, the surface of the strand can be measured."""

SCALE_STEP, FIRST_SCALE = 1.4, 2.0
"""Ratio of a half length that is tried to the previous one, and the first half length in distances of nearest neighbors."""

CANDIDATES = 8
"""Number of neighbors towards which a line is tried."""

MIN_ARC_LINES = 4
"""Minimum number of scan lines along one strand."""

MIN_ARC, MAX_ARC_GAP = 1.4, 1.3
"""Radians; minimum angle that the scan lines on one strand span, and maximum angle between neighboring scan lines."""

MAX_ARC_RESIDUAL = 0.1
"""Maximum root mean square distance of the scan lines from the arc, in radii of the arc."""


class Lines(NamedTuple):
    """Straight lines through the neighborhoods of S points.

    Attributes
    ----------
    center
        (S, 3) m, mean of the points of each line.
    direction
        (S, 3) unit.
    across
        (S,) m, root mean square distance of the points from the line.
    spacing
        (S,) m, mean distance between the points along the line.
    scale
        (S,) m, half length.
    number
        (S,) number of points.
    """

    center: Floats
    direction: Floats
    across: Floats
    spacing: Floats
    scale: Floats
    number: Ints


NO_LINES = Lines._make(np.zeros((len(Lines._fields), 0)))


def is_sparse(points: Floats) -> bool:
    """Return whether the points (N, 3) m of a cloud follow one another along thin strands."""
    return len(points) >= 2 * MIN_LINE_POINTS and len(seed_lines(cKDTree(points), points).center) > 0


def seed_lines(tree: cKDTree, points: Floats) -> Lines:
    """Return the lines through a sample of the points of a sparse cloud; no lines if the cloud is not sparse.

    tree, points : the points (N, 3) m, at least two. In a sparse cloud most points have a line, and the lines are thin.
    """
    seeds = np.ascontiguousarray(points[:: max(1, len(points) // MAX_SEEDS)])
    near = tree.query(seeds, k=min(len(points), MAX_NEIGHBORS))
    nearest = float(np.median(near[0][:, 1]))
    if nearest > 0:
        scales = nearest * FIRST_SCALE * SCALE_STEP ** np.arange(12)
        index, lines = lines_at(points, seeds, near, scales, LINE_WIDTH * scales, np.full(scales.shape, MIN_LINE_POINTS, float))
        is_most = index.size / len(seeds) >= MIN_LINE_FRACTION
        if is_most and 2 * np.median(lines.across) <= MAX_POINTS_ACROSS * np.median(lines.spacing):
            return lines
    return NO_LINES


def lines_at(
    points: Floats, at: Floats, near: tuple[Floats, Ints], scales: Floats, widths: Floats, min_points: Floats
) -> tuple[Ints, Lines]:
    """Fit a line to the neighborhood of each of S points, at the smallest scale at which one fits.

    Parameters
    ----------
    points
        (N, 3) m, the cloud.
    at
        (S, 3) m, the points at which lines are fitted.
    near
        (S, K) distances, m, and indices of the nearest neighbors of each.
    scales
        (L,) m, half lengths, ascending.
    widths
        (L,) m, maximum distance of a line's points from it at each scale.
    min_points
        (L,) minimum number of a line's points at each scale.

    Returns
    -------
    index : (T,) the points of `at` that have a line.
    lines : their lines.
    """
    found, *values = fit_lines(points, at, *near, scales, widths, min_points, CANDIDATES, MAX_SPREAD_RATIO)
    return found.nonzero()[0], Lines._make([each[found] for each in values])


def are_scan_lines(tree: cKDTree, points: Floats, lines: Lines) -> bool:
    """Return whether most lines are scan lines on one thick strand: at least four lines side by side, on the arc of a circle."""
    spacing, scale, across = (float(np.median(values)) for values in (lines.spacing, lines.scale, lines.across))
    votes = []
    for center, direction in zip(lines.center, lines.direction, strict=True):
        near = points[tree.query_ball_point(center, 8 * scale)] - center
        axial = near @ direction
        is_beside = np.abs(axial) <= 2 * spacing
        votes.append(_is_arc(near[is_beside] - axial[is_beside, None] * direction, direction, scale, across))
    return float(np.mean(votes)) > 0.5


def _is_arc(slab: Floats, direction: Floats, scale: float, across: float) -> bool:
    """Return whether the points (K, 3) m of a cross-section are at least four lines on an arc of MIN_ARC.

    The circle is fitted to the centers of the lines by the method of Kasa.
    """
    side = perpendicular(direction)
    flat = np.column_stack((slab @ side, slab @ np.cross(direction, side)))
    if len(flat) < 2 * MIN_ARC_LINES:
        return False
    label = joined_groups(cKDTree(flat).query_pairs(max(4 * across, scale / 4), output_type="ndarray"), len(flat))
    count = np.bincount(label)
    if len(count) < MIN_ARC_LINES:
        return False
    spots = group_sums(flat, label, len(count)) / count[:, None]
    tree = cKDTree(spots)
    linked = tree.query_pairs(2 * float(np.median(tree.query(spots, k=2)[0][:, 1])), output_type="ndarray")
    group = joined_groups(linked, len(count))
    spots = spots[group == group[np.argmin((spots**2).sum(axis=1))]]
    if len(spots) < MIN_ARC_LINES:
        return False
    a, b, c = np.linalg.lstsq(np.column_stack((2 * spots, np.ones(len(spots)))), (spots**2).sum(axis=1), rcond=None)[0]
    radius = np.sqrt(max(c + a * a + b * b, 1e-18))
    off = spots - (a, b)
    angles = np.sort(np.arctan2(off[:, 1], off[:, 0]))
    gaps = np.sort(np.append(np.diff(angles), angles[0] + 2 * np.pi - angles[-1]))
    residual = np.sqrt(np.mean((np.linalg.norm(off, axis=1) - radius) ** 2))
    return bool(residual < MAX_ARC_RESIDUAL * radius and 2 * np.pi - gaps[-1] > MIN_ARC and gaps[-2] < MAX_ARC_GAP)
