"""Strands of a cloud sampled so sparsely that points lie behind one another along a strand: lines, in place of surfaces.

A scanner far away, such as one that flies over overhead wires, gives a point every 10 cm along a wire and none across. The
spacing of such points is that along the strands, and what they scatter across is noise, or the width of a strand. Each point
is moved to the straight line that fits the points before and behind it, and neighbors along it are joined by points in between.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.disjoint_set import group_sums, joined_groups
from ..geometry.limits import MAX_SAMPLES
from ..geometry.polyline import perpendicular
from ..kernels import fit_lines
from ..types import Bools, CloudSampling, Floats, Ints

MAX_SPARSE_POINTS = MAX_SAMPLES
"""Points of a sparse cloud that are used at most, since each has a line fitted to its neighbors: 2 s and 400 MB. They are taken
evenly in the order of the points, which is that along a scanner's lines."""

MAX_SEEDS = 60
"""Points at most at which it is decided whether a cloud is sparse."""

MAX_NEIGHBORS = 96
"""Nearest neighbors of a point at most among which its line is looked for."""

MIN_LINE_POINTS, MIN_POINTS_AT_SCALE = 7, 4
"""Points of a line at least: to find the scale of lines, and at a scale that is known."""

MAX_SPREAD_RATIO = 1 / 12
"""Variance across a line at most, as a fraction of that along it; of points all over a surface a line has a quarter."""

LINE_WIDTH = 0.5
"""Distance from a line within which points belong to it, as a fraction of its half length."""

MIN_LINE_FRACTION = 0.6
"""Fraction of the seeds at least that must lie on lines."""

MAX_POINTS_ACROSS = 5.0
"""Points in a square as wide as the strand; a surface of more is seen well enough to be measured."""

SCALE_STEP = 1.4
"""Factor from one scale to the next, from `FIRST_SCALE` distances of nearest neighbors on."""

FIRST_SCALE = 2.0

MIN_FILL = 0.4
"""Points of a line at least, as a fraction of those that its length holds at the usual spacing; at an end there are half."""

CANDIDATES = 8
"""Neighbors towards which a line is tried."""

MAX_LINK_SPACINGS = 6.0
"""Spacings along a strand up to which neighbors are joined; wider gaps are left to merging. Points of strands that are not longer
are outliers."""

LINK_SLOPE = 0.15
"""Lateral offset that a neighbor along a strand may have, as a fraction of how far ahead it lies."""

MIN_ALIGNMENT = 0.7
"""Cosine at least of the angle between the lines of neighbors that are joined."""

MIN_ARC_LINES, MIN_ARC_FRACTION = 4, 0.5
"""Lines of a scanner along one strand at least, and fraction of the seeds that must see as many on an arc."""

MIN_ARC, MAX_ARC_GAP = 1.4, 1.3
"""Radians; the arc that the lines of a scanner on one strand cover at least, and the angle between neighbors at most."""

MAX_ARC_RESIDUAL = 0.1
"""Radii; root mean square distance of the lines from the arc."""

MIN_SHORT_PIECES, SHORT_PIECE = 6, 6.0
"""Pieces at least, and their length in distances to the next piece at most, to be lines of a scanner across a strand."""

MIN_PIECE_DISTANCE = 0.8
"""Distance to the next piece, in lengths of a piece, from which lines across a strand are so sparse that their middles count."""

MIN_KEPT = 0.85
"""Fraction of the points at least that must lie on strands of lines, or they show a surface."""


class SparseStrands(NamedTuple):
    """A cloud of sparse points as lines.

    Attributes
    ----------
    kept
        (N,) bool, the points that lie on a line.
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


class _Lines(NamedTuple):
    """Straight lines through the neighborhoods of S points.

    found : (S,) bool. center, direction : (S, 3). across : (S,) m, root mean square distance from the line. spacing : (S,) m
    along the line. scale : (S,) m, half length. number : (S,), of points.
    """

    found: Bools
    center: Floats
    direction: Floats
    across: Floats
    spacing: Floats
    scale: Floats
    number: Ints


def find_sparse_strands(points: Floats) -> SparseStrands | None:
    """Return the strands of a sparse cloud as lines, or None if its points show surfaces.

    points : (N, 3) m.
    """
    if len(points) < 2 * MIN_LINE_POINTS:
        return None
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    lines = _seed_lines(tree, points)
    if lines is None or _is_lined_surface(tree, points, lines):
        return None
    every = -(-len(points) // MAX_SPARSE_POINTS)
    if every == 1:
        return _joined(tree, points, lines)
    some = np.ascontiguousarray(points[::every])
    strands = _joined(cKDTree(some, balanced_tree=False, compact_nodes=False), some, lines)
    if strands is None:
        return None
    kept = np.zeros(len(points), dtype=bool)
    kept[::every] = strands.kept
    return strands._replace(kept=kept)


def is_sparse(points: Floats) -> bool:
    """Tell whether the points (N, 3) m of a cloud lie one behind the other along thin strands."""
    return len(points) >= 2 * MIN_LINE_POINTS and _seed_lines(cKDTree(points), points) is not None


def _seed_lines(tree: cKDTree, points: Floats) -> _Lines | None:
    """Return the lines through some of the points that have one, if most have, and if their points show no surface."""
    seeds = np.ascontiguousarray(points[:: max(1, len(points) // MAX_SEEDS)])
    near = tree.query(seeds, k=min(len(points), MAX_NEIGHBORS))
    nearest = float(np.median(near[0][:, 1]))
    if nearest <= 0:
        return None
    scales = nearest * FIRST_SCALE * SCALE_STEP ** np.arange(12)
    lines = _fit_lines(points, seeds, near, scales, LINE_WIDTH * scales, np.full(len(scales), MIN_LINE_POINTS))
    if np.mean(lines.found) < MIN_LINE_FRACTION:
        return None
    lines = _Lines._make(values[lines.found] for values in lines)
    return lines if 2 * np.median(lines.across) <= MAX_POINTS_ACROSS * np.median(lines.spacing) else None


def _is_lined_surface(tree: cKDTree, points: Floats, lines: _Lines) -> bool:
    """Tell whether lines are those of a scanner along one strand: side by side, at least four, on the arc of a circle."""
    spacing, scale = float(np.median(lines.spacing)), float(np.median(lines.scale))
    votes = []
    for center, direction in zip(lines.center, lines.direction, strict=True):
        near = points[tree.query_ball_point(center, 8 * scale)] - center
        axial = near @ direction
        slab = near[np.abs(axial) <= 2 * spacing] - axial[np.abs(axial) <= 2 * spacing, None] * direction
        votes.append(_is_arc(slab, direction, scale, float(np.median(lines.across))))
    return float(np.mean(votes)) > MIN_ARC_FRACTION


def _is_arc(slab: Floats, direction: Floats, scale: float, across: float) -> bool:
    """Tell whether points (K, 3) in a cross-section are four lines or more on an arc of more than a right angle."""
    side = perpendicular(direction)
    flat = np.column_stack((slab @ side, slab @ np.cross(direction, side)))
    if len(flat) < 8:
        return False
    pairs = cKDTree(flat).query_pairs(max(4 * across, scale / 4), output_type="ndarray")
    label = joined_groups(pairs, len(flat))
    count = np.bincount(label)
    if len(count) < MIN_ARC_LINES:
        return False
    spots = group_sums(flat, label, len(count)) / count[:, None]
    steps = cKDTree(spots).query(spots, k=2)[0][:, 1]
    linked = cKDTree(spots).query_pairs(2 * float(np.median(steps)), output_type="ndarray")
    group = joined_groups(linked, len(count))
    spots = spots[group == group[np.argmin((spots**2).sum(axis=1))]]
    if len(spots) < MIN_ARC_LINES:
        return False
    matrix = np.column_stack((2 * spots, np.ones(len(spots))))
    a, b, c = np.linalg.lstsq(matrix, (spots**2).sum(axis=1), rcond=None)[0]
    radius = np.sqrt(max(c + a * a + b * b, 1e-18))
    off = spots - (a, b)
    angles = np.sort(np.arctan2(off[:, 1], off[:, 0]))
    gaps = np.append(np.diff(angles), angles[0] + 2 * np.pi - angles[-1])
    residual = np.abs(np.linalg.norm(off, axis=1) - radius)
    covered = 2 * np.pi - gaps.max()
    return bool(
        np.sqrt(np.mean(residual**2)) < MAX_ARC_RESIDUAL * radius and covered > MIN_ARC and np.sort(gaps)[-2] < MAX_ARC_GAP
    )


def _joined(tree: cKDTree, points: Floats, seeds: _Lines) -> SparseStrands | None:
    """Return the points moved to their lines and joined along them; seeds : the lines of some of the points."""
    scale, across, spacing = (float(np.median(values)) for values in (seeds.scale, seeds.across, seeds.spacing))
    width = min(LINE_WIDTH * scale, max(4 * across, scale / 6))
    scales = scale * np.array([1.0, 1.4, 2.0])
    near = tree.query(points, k=min(len(points), MAX_NEIGHBORS))
    least = np.maximum(MIN_POINTS_AT_SCALE, MIN_FILL * 2 * scales / spacing)
    lines = _fit_lines(points, points, near, scales, np.full(3, width), least)
    index = np.flatnonzero(lines.found)
    if len(index) < MIN_LINE_POINTS:
        return None
    direction, center = lines.direction[index], lines.center[index]
    offset = points[index] - center
    centered = center + np.einsum("ij,ij->i", offset, direction)[:, None] * direction
    spacing = float(np.median(lines.spacing[index]))
    tolerance = 2 * across / np.sqrt(np.maximum(lines.number[index], 1)) + 0.1 * spacing
    links = _links(centered, direction, tolerance, MAX_LINK_SPACINGS * spacing)
    label = joined_groups(links, len(index))
    short = _short_pieces(centered, label)
    if short is not None:
        return _through_pieces(points, index, label) if short > MIN_PIECE_DISTANCE else None
    size = np.bincount(label)[label]
    good = size >= MAX_LINK_SPACINGS
    kept = np.zeros(len(points), dtype=bool)
    kept[index[good]] = True
    if np.mean(kept) < MIN_KEPT:
        return None
    starts, ends = (centered[column] for column in links[good[links[:, 0]]].T)
    return SparseStrands(kept, centered[good], _between(starts, ends, spacing / 8), CloudSampling(spacing, across))


def _through_pieces(points: Floats, index: Ints, label: Ints) -> SparseStrands | None:
    """Return strands through the middles of pieces, which are lines of a scanner across a strand.

    index : (K,), the points of pieces. label : (K,), the piece of each.
    """
    count = np.bincount(label)
    middles = group_sums(points[index], label, len(count)) / count[:, None]
    whole = np.flatnonzero(count >= MIN_POINTS_AT_SCALE)
    strands = find_sparse_strands(middles[whole])
    if strands is None:
        return None
    moved = middles.copy()
    used = np.zeros(len(middles), dtype=bool)
    used[whole[strands.kept]], moved[whole[strands.kept]] = True, strands.centered
    kept = np.zeros(len(points), dtype=bool)
    kept[index[used[label]]] = True
    own = np.full(len(points), -1)
    own[index] = label
    off = points[kept] - moved[own[kept]]
    scatter = max(strands.sampling.scatter or 0.0, float(np.sqrt(np.mean((off**2).sum(axis=1)))))
    return SparseStrands(kept, moved[own[kept]], strands.bridges, CloudSampling(strands.sampling.spacing, scatter))


def _short_pieces(points: Floats, label: Ints) -> float | None:
    """Return how far apart pieces are, in lengths of a piece, if most are short: lines of a scanner across a strand.

    None if pieces are longer than a few times the distance to the next piece, or too few.
    """
    count = int(label.max()) + 1
    if count < MIN_SHORT_PIECES:
        return None
    order = np.argsort(label, kind="stable")
    bounds = np.cumsum(np.bincount(label))[:-1]
    length = np.array([np.linalg.norm(np.ptp(part, axis=0)) for part in np.split(points[order], bounds)])
    distance, near = cKDTree(points).query(points, k=min(len(points), MAX_NEIGHBORS))
    other = np.where(label[near] != label[:, None], distance, np.inf).min(axis=1)
    other = np.where(np.isfinite(other), other, distance[:, -1])
    apart = float(np.median(other)) / max(float(np.median(length[label])), 1e-12)
    return apart if apart > 1 / SHORT_PIECE else None


def _links(points: Floats, direction: Floats, tolerance: Floats, reach: float) -> Ints:
    """Return the pairs of neighbors along strands, (L, 2): each point and the next ahead, and the next behind."""
    distance, near = cKDTree(points).query(points, k=min(len(points), 48), distance_upper_bound=reach)
    there = np.isfinite(distance)
    near = np.where(there, near, 0)
    offset = points[near] - points[:, None]
    axial = np.einsum("nkj,nj->nk", offset, direction)
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


def _fit_lines(
    points: Floats, at: Floats, near: tuple[Floats, Ints], scales: Floats, widths: Floats, min_points: Floats
) -> _Lines:
    """Fit a line to the neighborhood of each of S points (S, 3), at the least of the scales (K,) m at which there is one.

    near : distance and index of the neighbors of each. widths : (K,) m from the line within which points belong to it, for each
    scale. min_points : (K,), for each scale.
    """
    return _Lines(*fit_lines(points, at, *near, scales, widths, min_points.astype(float), CANDIDATES, MAX_SPREAD_RATIO))
