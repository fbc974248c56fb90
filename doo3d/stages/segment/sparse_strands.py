"""Strands of a cloud sampled so sparsely that points lie behind one another along a strand: lines, in place of surfaces.

A scanner far away, such as one that flies over overhead wires, gives a point every 10 cm along a wire and none across. The
spacing of such points is that along the strands, and what they scatter across is noise, or the width of a strand. Each point
is moved to the straight line that fits the points before and behind it, and neighbors along it are joined by points in between.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...geometry.polyline import unit
from ...geometry.sparse_grid import SAMPLE_SEEDS
from ...types import Bools, CloudSampling, Floats, Ints

MAX_SPARSE_POINTS = 50_000
"""Points of a sparse cloud that are used at most, since each has a line fitted to its neighbors: 2 s and 400 MB. They are taken
evenly in the order of the points, which is that along a scanner's lines."""

MAX_NEIGHBORS = 96
"""Nearest neighbors of a point at most among which its line is looked for."""

MIN_LINE_POINTS = 7
"""Points of a line at least; where the scale of lines is known, half of them suffice, as at an end."""

MAX_SPREAD_RATIO = 1 / 12
"""Variance across a line at most, as a fraction of that along it; of points all over a surface a line has a quarter."""

LINE_WIDTH = 0.5
"""Distance from a line within which points belong to it, as a fraction of its half length."""

MIN_LINE_FRACTION = 0.6
"""Fraction of the seeds, and of the points, at least that must lie on lines, or the points show a surface."""

SCALE_STEP = 1.4
"""Factor from one scale to the next, from its square of distances of nearest neighbors on."""

CANDIDATES = 8
"""Neighbors towards which a line is tried."""

MAX_LINK_SPACINGS = 6.0
"""Spacings along a strand up to which neighbors are joined; wider gaps are left to merging. Pieces of fewer
points are outliers."""

LINK_SLOPE = 0.15
"""Lateral offset that a neighbor along a strand may have, as a fraction of how far ahead it lies. An arc turns by
twice the angle of its chord, so the directions of such neighbors differ by 2 atan(LINK_SLOPE) at most."""


@dataclass(frozen=True)
class SparseStrands:
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


@dataclass(frozen=True)
class _Lines:
    """Straight lines through the neighborhoods of S points.

    found : (S,) bool. center, direction : (S, 3). across : (S,) m, root mean square distance from the line. spacing : (S,) m
    along the line. scale : (S,) m, half length. count : (S,).
    """

    found: Bools
    center: Floats
    direction: Floats
    across: Floats
    spacing: Floats
    scale: Floats
    count: Ints


def find_sparse_strands(points: Floats) -> SparseStrands | None:
    """Return the strands of a sparse cloud as lines, or None if its points show surfaces.

    points : (N, 3) m.
    """
    if len(points) < 2 * MIN_LINE_POINTS:
        return None
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    lines = _seed_lines(tree, points)
    if lines is None:
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
    return replace(strands, kept=kept)


def is_sparse(points: Floats) -> bool:
    """Tell whether the points (N, 3) m of a cloud lie one behind the other along thin strands."""
    if len(points) < 2 * MIN_LINE_POINTS:
        return False
    return _seed_lines(cKDTree(points, balanced_tree=False, compact_nodes=False), points) is not None


def _seed_lines(tree: cKDTree, points: Floats) -> _Lines | None:
    """Return the lines through some of the points that have one, if most have, and if their points show no surface."""
    seeds = points[:: max(1, len(points) // SAMPLE_SEEDS)]
    nearest = float(np.median(tree.query(seeds, k=2)[0][:, 1]))
    if nearest <= 0:
        return None
    scales = nearest * SCALE_STEP ** np.arange(2, 14)
    lines = _fit_lines(tree, points, seeds, scales, None, MIN_LINE_POINTS)
    if np.mean(lines.found) < MIN_LINE_FRACTION:
        return None
    return _Lines(*(getattr(lines, name)[lines.found] for name in lines.__dataclass_fields__))


def _joined(tree: cKDTree, points: Floats, seeds: _Lines) -> SparseStrands | None:
    """Return the points moved to their lines and joined along them; seeds : the lines of some of the points."""
    scale, across = float(np.median(seeds.scale)), float(np.median(seeds.across))
    width = min(LINE_WIDTH * scale, max(4 * across, scale / 6))
    scales = scale * SCALE_STEP ** np.arange(3)
    lines = _fit_lines(tree, points, points, scales, width, (MIN_LINE_POINTS + 1) // 2)
    index = np.flatnonzero(lines.found)
    if len(index) < MIN_LINE_POINTS:
        return None
    direction, center = lines.direction[index], lines.center[index]
    offset = points[index] - center
    centered = center + np.einsum("ij,ij->i", offset, direction)[:, None] * direction
    spacing = float(np.median(lines.spacing[index]))
    tolerance = 2 * across / np.sqrt(np.maximum(lines.count[index], 1)) + 0.1 * spacing
    first, second = _links(centered, direction, tolerance, MAX_LINK_SPACINGS * spacing)
    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(len(index), len(index)))
    label = connected_components(graph, directed=False)[1]
    size = np.bincount(label)[label]
    good = size >= MAX_LINK_SPACINGS
    kept = np.zeros(len(points), dtype=bool)
    kept[index[good]] = True
    used = good[first]
    if np.mean(kept) < MIN_LINE_FRACTION:
        return None
    sampling = CloudSampling(spacing, across)
    step = spacing / 8
    return SparseStrands(kept, centered[good], _between(centered[first[used]], centered[second[used]], step), sampling)


def _links(points: Floats, direction: Floats, tolerance: Floats, reach: float) -> tuple[Ints, Ints]:
    """Return the pairs of neighbors along strands, (L,) and (L,): each point and the next ahead, and the next behind."""
    tree = cKDTree(points)
    distance, near = tree.query(points, k=min(len(points), 48), distance_upper_bound=reach)
    there = np.isfinite(distance)
    near = np.where(there, near, 0)
    offset = points[near] - points[:, None]
    axial = np.einsum("nkj,nj->nk", offset, direction)
    lateral = np.sqrt(np.maximum(distance**2 - axial**2, 0.0))
    aligned = np.abs(np.einsum("nkj,nj->nk", direction[near], direction)) > np.cos(2 * np.arctan(LINK_SLOPE))
    good = there & aligned & (np.where(there, lateral, np.inf) <= tolerance[:, None] + LINK_SLOPE * np.abs(axial))
    firsts, seconds = [], []
    for sign in (1, -1):
        ahead = np.where(good & (sign * axial > 1e-9 * reach), np.abs(axial) + 2 * lateral, np.inf)
        best = ahead.argmin(axis=1)
        has = np.isfinite(ahead[np.arange(len(points)), best])
        firsts.append(np.flatnonzero(has))
        seconds.append(near[has, best[has]])
    return np.concatenate(firsts), np.concatenate(seconds)


def _between(starts: Floats, ends: Floats, step: float) -> Floats:
    """Return points on the straight lines from starts to ends (L, 3), at most `step` apart."""
    count = np.ceil(np.linalg.norm(ends - starts, axis=1) / step).astype(int)
    count = np.maximum(count, 1)
    which = np.repeat(np.arange(len(starts)), count)
    number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    fraction = ((number + 0.5) / count[which])[:, None]
    return np.asarray(starts[which] * (1 - fraction) + ends[which] * fraction)


def _fit_lines(tree: cKDTree, points: Floats, at: Floats, scales: Floats, width: float | None, least: int) -> _Lines:
    """Fit a line to the neighborhood of each of S points (S, 3), at the least of the scales (K,) m at which there is one.

    width : m from the line within which points belong to it; None for a fraction of the scale. least : points of a line.
    """
    size, count = len(at), min(len(points), MAX_NEIGHBORS)
    lines = _Lines(
        np.zeros(size, dtype=bool), at.copy(), np.zeros((size, 3)), np.zeros(size), np.zeros(size), np.zeros(size),
        np.zeros(size, dtype=np.int64),
    )  # fmt: skip
    distance, near = tree.query(at, k=count)
    offset = points[near] - at[:, None]
    for scale in scales.tolist():
        todo = np.flatnonzero(~lines.found & ((distance[:, -1] >= scale) | (count == len(points))))
        if not len(todo):
            continue
        used = max(2, int(np.searchsorted(distance[todo].min(axis=0), 1.2 * scale)))
        fits = _fit_at(offset[todo, :used], distance[todo, :used], scale, LINE_WIDTH * scale if width is None else width)
        n, center, direction, variance, length, own = fits
        across = np.maximum(variance[:, 0] + variance[:, 1], 0.0) * n / np.maximum(n - 2, 1)
        good = (n >= least) & (across <= MAX_SPREAD_RATIO * variance[:, 2]) & (own <= 9 * across + (0.1 * scale) ** 2)
        done = todo[good]
        lines.found[done] = True
        lines.center[done] += center[good]
        lines.direction[done] = direction[good]
        lines.across[done] = np.sqrt(across[good])
        lines.spacing[done] = length[good] / (n[good] - 1)
        lines.scale[done] = scale
        lines.count[done] = n[good]
    return lines


def _fit_at(
    offset: Floats, distance: Floats, scale: float, width: float
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Fit lines at one scale to the offsets (S, K, 3) of neighbors, of the given distances (S, K).

    Returns of each line the number of points, the center and the direction (S, 3), the variances ascending (S, 3), the length,
    and the squared distance of the point itself from the line.
    """
    size = len(offset)
    inside = distance <= 1.2 * scale
    number = inside.sum(axis=1)
    pick = np.maximum(1, number[:, None] * np.arange(1, CANDIDATES + 1) // (CANDIDATES + 1))
    pick = np.minimum(pick, offset.shape[1] - 1)
    tried = unit(offset[np.arange(size)[:, None], pick])
    axial = offset @ tried.transpose(0, 2, 1)
    lateral = (distance**2)[:, :, None] - axial**2
    counted = (np.abs(axial) <= scale) & inside[:, :, None]
    best = (np.maximum(0.0, 1 - lateral / width**2) * counted).sum(axis=1).argmax(axis=1)
    direction = tried[np.arange(size), best]
    center = np.zeros((size, 3))
    for _ in range(3):
        moved = offset - center[:, None]
        axial = (moved @ direction[:, :, None])[:, :, 0]
        lateral = (moved**2).sum(axis=2) - axial**2
        member = (lateral <= width**2) & (np.abs((offset @ direction[:, :, None])[:, :, 0]) <= scale)
        n = np.maximum(member.sum(axis=1), 1)
        center = (offset * member[:, :, None]).sum(axis=1) / n[:, None]
        moved = (offset - center[:, None]) * member[:, :, None]
        variance, vectors = np.linalg.eigh(moved.transpose(0, 2, 1) @ moved / n[:, None, None])
        direction = vectors[:, :, 2]
    axial = (moved @ direction[:, :, None])[:, :, 0]
    length = axial.max(axis=1) - axial.min(axis=1)
    own = (center**2).sum(axis=1) - (center * direction).sum(axis=1) ** 2
    return member.sum(axis=1).astype(float), center, direction, variance, length, own
