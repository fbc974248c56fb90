"""Attach and join ends in clouds, where points show where the surface continues, but no camera shows empty space.

An end beside a strand belongs to that strand if points fill the straight path between them. Where part of the surface was not
measured, the two sides are joined straight across the gap, at a low cost per length, unless they are connected otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...geometry.disjoint_set import DisjointSet
from ...geometry.polyline import angle
from ...types import Bools, Floats
from .. import FrameContext
from .costs import JOIN_COST, MISS_COST, NEARNESS_COST, TURN_COST
from .strands import ARM_RADII, MIN_ANGLE, FreeEnds, SampledChain

GAP_COST = 0.3
"""Cost units per mm of a gap between parts that nothing else connects: a gap of 0.25 m leaves room for a bend of 30 degrees."""

COVERED_SHARE = 0.95
"""Share of a path that must be filled with points."""

SAMPLE_VOXELS = 0.5
"""Spacing, in voxels, of the positions on a path at which points are looked for."""


@dataclass(frozen=True)
class Surface:
    """The measured surface of a cloud, to test whether points fill the straight path between two positions.

    Attributes
    ----------
    tree
        the centroids of the voxels.
    voxel
        m, edge of a voxel.
    radius
        m, first estimate of the object's radius: the axis lies that deep below the surface.
    """

    tree: cKDTree
    voxel: float
    radius: float

    @staticmethod
    def of(context: FrameContext) -> Surface | None:
        """Return the surface of a cloud without camera views; None for other data, and for a cloud of sparse points."""
        sampling = context.foreground.sampling
        if sampling is None or sampling.is_sparse or context.visibility is not None or not len(context.grid.centroids):
            return None
        return Surface(cKDTree(context.grid.centroids), context.voxel, context.radius)

    def covers(self, start: Floats, end: Floats) -> bool:
        """Tell whether points fill the straight path between two positions (3,) m."""
        count = max(3, math.ceil(float(np.linalg.norm(end - start)) / (SAMPLE_VOXELS * self.voxel)))
        way = np.linspace(start, end, count)
        distance = self.tree.query(way, distance_upper_bound=self.radius + self.voxel)[0]
        return bool(np.isfinite(distance).mean() >= COVERED_SHARE)


def bridged_place(
    point: Floats, tangent: Floats, radius: float, axis: Floats, radii: Floats | float, surface: Surface
) -> tuple[int, float] | None:
    """Find the position on a strand that is connected to an end by a straight path filled with points.

    Parameters
    ----------
    point, tangent
        (3,) m and unit, the end and its direction.
    radius
        m, of the end's strand.
    axis, radii
        (S, 3) m, samples along the other strand, and its radius at each, (S,) m, or everywhere.
    surface
        the measured surface.

    Returns
    -------
    Index of the strand's sample, and the cost of the attachment in cost units; None if points do not fill the path.
    """
    offset = axis - point
    distance = np.linalg.norm(offset, axis=1)
    near = distance < ARM_RADII[1] * radius
    if not near.any():
        return None
    miss = np.linalg.norm(offset - np.clip(offset @ tangent, 0, None)[:, None] * tangent, axis=1) / (radii + radius)
    cost = np.where(near, 1000 * NEARNESS_COST * distance + MISS_COST * miss, np.inf)
    best = int(cost.argmin())
    return (best, float(cost[best])) if surface.covers(point, axis[best]) else None


def hidden_place(point: Floats, tangent: Floats, strand: SampledChain, max_gap: float) -> tuple[int, float] | None:
    """Find the position on a strand that an end points at across a gap without points.

    Parameters
    ----------
    point, tangent
        (3,) m and unit, the end and its direction.
    strand
        the other strand.
    max_gap
        m, longest gap.

    Returns
    -------
    Index of the strand's sample, and the cost of the attachment in cost units; None if all samples are farther than `max_gap`.
    """
    offset = strand.points - point
    distance = np.linalg.norm(offset, axis=1)
    if distance.min() > max_gap:
        return None
    turn = angle(np.broadcast_to(tangent, offset.shape), offset)
    aside = angle(offset, np.gradient(strand.points, axis=0))
    possible = (distance <= max_gap) & (np.minimum(aside, np.pi - aside) > MIN_ANGLE)
    cost = np.where(possible, 1000 * GAP_COST * distance + TURN_COST * turn, np.inf)
    best = int(cost.argmin())
    return best, float(cost[best])


def gap_links(ends: FreeEnds, is_free: Bools, group: Sequence[int], max_gap: float) -> list[tuple[int, int, float]]:
    """Choose pairs of free ends to join across gaps, if their strands belong to different objects so far.

    Parameters
    ----------
    ends
        the E free ends of all strands.
    is_free
        (E,) bool, False for an end that meets a strand.
    group
        number of the object of each strand.
    max_gap
        m, longest gap.

    Returns
    -------
    (row, row, cost) of each join by ascending cost: rows of the two ends, and cost units. An end is joined at most once, and no
    join connects an object with itself.
    """
    rows = np.flatnonzero(is_free)
    points, tangents = ends.points[rows], ends.tangents[rows]
    offset = points[None] - points[:, None]
    distance = np.linalg.norm(offset, axis=2)
    turn = angle(np.broadcast_to(tangents[:, None], offset.shape), -np.broadcast_to(tangents[None], offset.shape))
    bend = angle(np.broadcast_to(tangents[:, None], offset.shape), offset)
    cost = 1000 * GAP_COST * distance + TURN_COST * (turn + np.maximum(bend, bend.T))
    cost[distance > max_gap] = np.inf
    objects = DisjointSet(group)
    links, used = [], np.zeros(len(rows), dtype=bool)
    first, second = np.triu_indices(len(rows), 1)
    order = np.argsort(cost[first, second], kind="stable")
    for a, b in zip(first[order].tolist(), second[order].tolist(), strict=True):
        if cost[a, b] > JOIN_COST:
            break
        if not (used[a] or used[b]) and objects.join(ends.strand[rows[a]], ends.strand[rows[b]]):
            used[[a, b]] = True
            links.append((int(rows[a]), int(rows[b]), float(cost[a, b])))
    return links
