"""Branches in place of a link: in clouds, where points lead both ends to other strands.

At a junction of three ends one is left over. Two such ends of neighboring junctions are no link, though no others are left there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ....geometry.curves import Curves
from ....geometry.polyline import arc_length, resample
from ....geometry.radii import STEP_RADII
from ....types import Floats
from ... import FrameContext
from ..candidates import Candidates

BRANCH_COST, NEARNESS_COST, MISS_COST = 60.0, 0.5, 20.0
"""Cost units of a branch, as much as a turn of a cable by 35 degrees; per mm from its end to the strand; and per diameter by
which it points past the place. At a crossing both ends point at one place."""

MIN_APART = 0.5
"""Smallest distance between the places where the two ends branch off, in lengths of the gap between these: at one place the ends
continue each other."""

COVERED_SHARE, SAMPLE_VOXELS = 0.95, 0.5
"""Share of a straight path that points must fill, and the spacing in voxels of the positions at which they are looked for."""


def branching(candidates: Candidates, evidence: FrameContext) -> Floats | None:
    """Return by how much two branches cost less than two free ends, for each pair of ends, (E, E) cost units.

    A branch leads to the place of least cost on a strand, within `merge.tangent_window_radii` radii, if points fill the straight
    path there, and if it is no end of a chain. Neither the end's own chain nor that of the other end is such a strand. None
    unless objects may branch, and for all data but clouds of surfaces without camera views.
    """
    if not (evidence.branches and evidence.shows_surface):
        return None
    points = candidates.points
    surface = _Surface(cKDTree(evidence.grid.centroids), candidates.radius + evidence.voxel, evidence.voxel)
    strands, owners = _strands(candidates, surface)
    chain = np.arange(len(points)) // 2
    costs = np.full((len(points), len(candidates.chains)), np.inf)
    places = np.zeros((*costs.shape, 3))
    for row, own in enumerate(chain.tolist()):
        for cost, place, hosts in _places(candidates, row, strands, owners):
            is_open = np.isinf(costs[row])
            is_open[list(hosts)] = False
            if own not in hosts and is_open.any() and surface.covers(points[row], place):
                costs[row, is_open], places[row, is_open] = cost, place
    apart = np.linalg.norm(places[:, chain] - places[:, chain].swapaxes(0, 1), axis=2) > MIN_APART * candidates.distance
    both = costs[:, chain] + costs[:, chain].T
    less = np.subtract(candidates.config.max_cost, both, out=np.zeros_like(both), where=apart & np.isfinite(both))
    return np.asarray(np.maximum(less, 0.0))


def _strands(candidates: Candidates, surface: _Surface) -> tuple[Curves, list[tuple[int, int]]]:
    """Return samples along all chains and across gaps that points fill, and for each of these the two chains it is part of."""
    points, chains = candidates.points, candidates.chains
    lines, owners = list(chains), [(k, k) for k in range(len(chains))]
    facing = (candidates.distance < candidates.window) & (candidates.turns < np.pi / 2)
    for a, b in np.argwhere(np.triu(facing, 1)).tolist():
        if a // 2 != b // 2 and surface.covers(points[a], points[b]):
            lines.append(points[[a, b]])
            owners.append((a // 2, b // 2))
    return Curves.of([_samples(line, STEP_RADII * candidates.radius) for line in lines]), owners


def _samples(line: Floats, spacing: float) -> Floats:
    along = arc_length(line)
    return resample(line, np.linspace(0, along[-1], max(2, round(along[-1] / spacing) + 1)))


def _places(
    candidates: Candidates, row: int, strands: Curves, owners: list[tuple[int, int]]
) -> Iterator[tuple[float, Floats, tuple[int, int]]]:
    """Yield cost and place of a branch from an end to each strand within reach, and the chains of the strand, by cost."""
    tangent, offset = candidates.tangents[row], strands.points - candidates.points[row]
    distance = np.linalg.norm(offset, axis=1)
    miss = np.linalg.norm(offset - np.clip(offset @ tangent, 0, None)[:, None] * tangent, axis=1) / (2 * candidates.radius)
    cost = BRANCH_COST + NEARNESS_COST * candidates.unit_cost * distance + MISS_COST * miss
    near = np.flatnonzero(distance < candidates.window)
    near = near[np.argsort(cost[near], kind="stable")]
    best = near[np.sort(np.unique(strands.owner[near], return_index=True)[1])]
    tips = strands.tips[: len(candidates.points)]
    for i in best[~np.isin(best, tips)].tolist():
        yield float(cost[i]), strands.points[i], owners[strands.owner[i]]


@dataclass(frozen=True)
class _Surface:
    """The measured surface of a cloud: its voxels, how far a path may run from them, and the edge of a voxel, m."""

    tree: cKDTree
    reach: float
    voxel: float

    def covers(self, start: Floats, end: Floats) -> bool:
        """Tell whether points fill the straight path between two positions (3,) m."""
        count = max(3, math.ceil(float(np.linalg.norm(end - start)) / (SAMPLE_VOXELS * self.voxel)))
        distance = self.tree.query(np.linspace(start, end, count), distance_upper_bound=self.reach)[0]
        return bool(np.isfinite(distance).mean() >= COVERED_SHARE)
