"""Join the points of a sparse cloud to strands: lines in place of surfaces.

A distant scanner, such as one that is flown over overhead wires, measures a point every 10 cm along a wire and none across it.
The spacing of such points is that along the strands; their scatter across is noise, or the width of a strand. Each point is moved
to the straight line fitted to the points before and behind it, and neighbors along the strand are joined by points in between.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.disjoint_set import group_sums, joined_groups
from ..geometry.limits import MAX_SAMPLES
from ..types import Bools, CloudSampling, Floats, Ints
from .point_lines import LINE_WIDTH, MAX_NEIGHBORS, MIN_LINE_POINTS, Lines, are_scan_lines, lines_at, seed_lines

MAX_SPARSE_POINTS = MAX_SAMPLES
"""Maximum number of points of a sparse cloud that are used, since a line is fitted at each: 2 s and 400 MB. Every k-th point is
taken, in the order of the cloud, which follows the lines of a scanner."""

MIN_POINTS_AT_SCALE = 4
"""Minimum number of points of a line at the known scale, and of a piece."""

MIN_FILL = 0.4
"""Minimum number of points of a line, as a fraction of those that fill its length at the usual spacing; at an end, half do."""

MAX_LINK_SPACINGS = 6.0
"""Maximum distance of neighbors that are joined, in spacings along a strand; wider gaps are left to merging. Strands with fewer
points are outliers."""

LINK_SLOPE = 0.15
"""Maximum increase of the lateral offset of a neighbor along a strand, as a fraction of its distance along the strand."""

MIN_ALIGNMENT = 0.7
"""Minimum cosine of the angle between the lines of neighbors that are joined."""

MIN_SHORT_PIECES, SHORT_PIECE = 6, 6.0
"""Minimum number of pieces, and maximum length of a piece in distances to the next piece, for pieces to be scan lines across a
strand."""

MIN_PIECE_DISTANCE = 0.8
"""Minimum distance between scan lines across a strand, in lengths of a scan line, for the strand to be traced through their
centers; with denser scan lines its surface can be measured."""

MIN_KEPT = 0.85
"""Minimum fraction of the points on strands; with fewer, the points are those of a surface."""

UNBALANCED = {"balanced_tree": False, "compact_nodes": False}
"""Options of a k-d tree that is built faster."""


class SparseStrands(NamedTuple):
    """The points of a sparse cloud, joined to strands.

    Attributes
    ----------
    kept
        (N,) bool, the points that lie on a strand.
    centered
        (K, 3) m, the points kept, each moved to its line.
    bridges
        (B, 3) m, points between neighbors along a strand.
    sampling
        the spacing of the points along the strands, and their scatter across.
    """

    kept: Bools
    centered: Floats
    bridges: Floats
    sampling: CloudSampling


def find_sparse_strands(points: Floats) -> SparseStrands | None:
    """Return the strands of a sparse cloud (N, 3) m; None if the points are those of surfaces."""
    if len(points) < 2 * MIN_LINE_POINTS:
        return None
    tree = cKDTree(points, **UNBALANCED)
    lines = seed_lines(tree, points)
    if not lines.center.size or are_scan_lines(tree, points, lines):
        return None
    every = -(-len(points) // MAX_SPARSE_POINTS)
    some = np.ascontiguousarray(points[::every])
    strands = _joined(tree if every == 1 else cKDTree(some, **UNBALANCED), some, lines)
    if not strands:
        return None
    kept = np.zeros(len(points), dtype=bool)
    kept[::every] = strands.kept
    return strands._replace(kept=kept)


def _joined(tree: cKDTree, points: Floats, seeds: Lines) -> SparseStrands | None:
    """Return the points moved to their lines and joined along them; seeds : the lines at a sample of the points."""
    scale, across, spacing = (float(np.median(values)) for values in (seeds.scale, seeds.across, seeds.spacing))
    widths = np.full(3, min(LINE_WIDTH * scale, max(4 * across, scale / 6)))
    scales = scale * np.array([1.0, 1.4, 2.0])
    near = tree.query(points, k=min(len(points), MAX_NEIGHBORS))
    least = np.maximum(MIN_POINTS_AT_SCALE, MIN_FILL * 2 * scales / spacing)
    index, lines = lines_at(points, points, near, scales, widths, least)
    if len(index) < MIN_LINE_POINTS:
        return None
    offset = points[index] - lines.center
    centered = lines.center + np.einsum("ij,ij->i", offset, lines.direction)[:, None] * lines.direction
    spacing = float(np.median(lines.spacing))
    tolerance = 2 * across / np.sqrt(np.maximum(lines.number, 1)) + 0.1 * spacing
    links = _links(centered, lines.direction, tolerance, MAX_LINK_SPACINGS * spacing)
    label = joined_groups(links, len(index))
    if apart := _piece_distance(centered, label):
        return _through_pieces(points, index, label) if apart > MIN_PIECE_DISTANCE else None
    good = np.bincount(label)[label] >= MAX_LINK_SPACINGS
    kept = np.zeros(len(points), dtype=bool)
    kept[index[good]] = True
    if np.mean(kept) < MIN_KEPT:
        return None
    starts, ends = (centered[column] for column in links[good[links[:, 0]]].T)
    return SparseStrands(kept, centered[good], _between(starts, ends, spacing / 8), CloudSampling(spacing, across))


def _through_pieces(points: Floats, index: Ints, label: Ints) -> SparseStrands | None:
    """Return strands through the centers of pieces, which are scan lines across a strand.

    index : (K,), the points of pieces. label : (K,), the piece of each.
    """
    count = np.bincount(label)
    middles = group_sums(points[index], label, len(count)) / count[:, None]
    whole = np.flatnonzero(count >= MIN_POINTS_AT_SCALE)
    strands = find_sparse_strands(middles[whole])
    if not strands:
        return None
    used = whole[strands.kept]
    middles[used] = strands.centered
    own = np.full(len(points), -1)
    own[index] = label
    kept = np.isin(own, used)
    centered = middles[own[kept]]
    scatter = max(strands.sampling.scatter or 0.0, float(np.sqrt(np.mean(((points[kept] - centered) ** 2).sum(axis=1)))))
    return SparseStrands(kept, centered, strands.bridges, CloudSampling(strands.sampling.spacing, scatter))


def _piece_distance(points: Floats, label: Ints) -> float:
    """Return the median distance between pieces, in lengths of a piece, if most pieces are short: scan lines across a strand.

    0 if the pieces are longer than SHORT_PIECE times that distance, or too few.
    """
    count = np.bincount(label)
    if len(count) < MIN_SHORT_PIECES:
        return 0.0
    parts = np.split(points[np.argsort(label, kind="stable")], np.cumsum(count)[:-1])
    length = np.array([np.linalg.norm(np.ptp(part, axis=0)) for part in parts])
    distance, near = cKDTree(points).query(points, k=min(len(points), MAX_NEIGHBORS))
    other = np.where(label[near] != label[:, None], distance, np.inf).min(axis=1)
    other = np.where(np.isfinite(other), other, distance[:, -1])
    apart = float(np.median(other)) / max(float(np.median(length[label])), 1e-12)
    return apart if apart > 1 / SHORT_PIECE else 0.0


def _links(points: Floats, direction: Floats, tolerance: Floats, reach: float) -> Ints:
    """Return the pairs of neighbors along strands, (L, 2): each point with the next point ahead and the next behind.

    tolerance : (N,) m, maximum lateral offset beside LINK_SLOPE. reach : m, maximum distance.
    """
    distance, near = cKDTree(points).query(points, k=min(len(points), 48), distance_upper_bound=reach)
    there = np.isfinite(distance)
    near = np.where(there, near, 0)
    axial = np.einsum("nkj,nj->nk", points[near] - points[:, None], direction)
    lateral = np.sqrt(np.maximum(distance**2 - axial**2, 0.0))
    aligned = np.abs(np.einsum("nkj,nj->nk", direction[near], direction)) > MIN_ALIGNMENT
    good = there & aligned & (np.where(there, lateral, np.inf) <= tolerance[:, None] + LINK_SLOPE * np.abs(axial))
    links = []
    for sign in (1, -1):
        ahead = np.where(good & (sign * axial > 1e-9 * reach), np.abs(axial) + 2 * lateral, np.inf)
        best = ahead.argmin(axis=1)
        has = np.flatnonzero(np.isfinite(ahead[np.arange(len(points)), best]))
        links.append(np.column_stack((has, near[has, best[has]])))
    return np.concatenate(links)


def _between(starts: Floats, ends: Floats, step: float) -> Floats:
    """Return points on the straight lines from starts to ends (L, 3), at most `step` apart."""
    count = np.maximum(np.ceil(np.linalg.norm(ends - starts, axis=1) / step).astype(int), 1)
    which = np.repeat(np.arange(len(starts)), count)
    number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    fraction = ((number + 0.5) / count[which])[:, None]
    return np.asarray(starts[which] * (1 - fraction) + ends[which] * fraction)
