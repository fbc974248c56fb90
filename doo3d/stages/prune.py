"""Remove overlapping segments: of two, the one in the shorter chain (Keipour et al., RA-L 2022, section III-E)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..config import PruneConfig
from ..errors import require
from ..geometry.curves import Curves
from ..geometry.polyline import unit
from ..kernels import keep_segments, near_cuboids
from ..types import Bools, Floats, Ints
from . import FrameContext

WIDTH_VOXELS = 1.5
"""Width of the cuboids in voxels (pixels in 2-D): paths that run in neighboring voxels overlap, others do not."""


@dataclass(frozen=True)
class Pruned:
    """The chains that pruning left, and the segments that it removed.

    Attributes
    ----------
    chains
        the joints of the chains that pruning left, and of the parts of chains that were split.
    removed
        (S, 2, D) m, D = 3 (in 2-D: px, D = 2), the two joints of each of the S removed segments, in the order of the chains given
        to `prune`.
    """

    chains: Curves
    removed: Floats


def prune(chains: Curves, context: FrameContext, config: PruneConfig) -> Pruned:
    """Remove overlapping segments: of two segments that overlap, the one in the chain with fewer segments is removed.

    The rule is that of Keipour et al. (RA-L 2022), section III-E. A segment counts as a cuboid with a square cross-section;
    segments overlap if their cuboids intersect. Neighbors in a chain, which share a joint, do not count. Of chains of equal
    length the later one loses its segment. A chain that loses an inner segment is split in two, a ring is opened.

    Parameters
    ----------
    chains
        the joints of the fitted chains.
    context
        the data of the frame; if `config.width` is not set, the cuboids are 1.5 of its voxels wide.
    config
        section `prune` of the settings.

    Returns
    -------
    The chains that are left, in the order given, and the segments removed.
    """
    if not len(chains):
        return Pruned(chains, np.zeros((0, 2, context.grid.centroids.shape[1])))
    width = config.width or WIDTH_VOXELS * context.voxel
    cuboids = Cuboids(chains.points[chains.segments], chains.points[chains.segments + 1], width)
    near = cuboids.near_pairs(chains.owner[chains.segments])
    points, bounds, closed, removed = keep_segments(chains.points, chains.bounds, chains.closed, *near, cuboids.overlap)
    return Pruned(Curves(points, bounds, closed) if len(removed) else chains, removed)


class Cuboids:
    """Segments as cuboids with a square cross-section; in 2-D they lie in the plane z = 0.

    Parameters
    ----------
    starts, ends
        (S, D) m, D = 3 (in 2-D: px, D = 2), the two joints of each of S segments, at least one.
    width
        edge of the cross-section, m (px in 2-D).
    """

    def __init__(self, starts: Floats, ends: Floats, width: float) -> None:
        self.starts, self.ends, self.width = starts, ends, width

    def near_pairs(self, owner: Ints) -> tuple[Ints, Bools]:
        """Return the pairs (i, j), i < j, that may intersect, in order: (K, 2), and those that do for certain, (K,).

        owner : (S,), chain of each segment. Consecutive segments of a chain are left out.
        """
        return near_cuboids(self.starts, self.ends, owner, self.width)

    def overlap(self, i: int, j: int) -> bool:
        """Tell whether the cuboids of two segments intersect, by the box-box test of FCL (package python-fcl)."""
        fcl, request = self._fcl
        return bool(fcl.collide(self._object(i), self._object(j), request, fcl.CollisionResult()))

    def _object(self, i: int) -> Any:
        fcl, (lengths, rotations, middles) = self._fcl[0], self._boxes
        return fcl.CollisionObject(fcl.Box(lengths[i], self.width, self.width), fcl.Transform(rotations[i], middles[i]))

    @cached_property
    def _fcl(self) -> tuple[Any, Any]:
        fcl = require("fcl")
        return fcl, fcl.CollisionRequest()

    @cached_property
    def _boxes(self) -> tuple[list[float], Floats, Floats]:
        level = ((0, 0), (0, 3 - self.starts.shape[1]))
        return _boxes_of(np.pad(self.starts, level), np.pad(self.ends, level))


def _boxes_of(starts: Floats, ends: Floats) -> tuple[list[float], Floats, Floats]:
    """Return lengths, rotations (S, 3, 3) whose first columns are the segments' directions, and middles (S, 3)."""
    offset = ends - starts
    length = np.linalg.norm(offset, axis=1)
    x = offset / length[:, None]
    axis = np.eye(3)[np.argmin(np.abs(x), axis=1)]
    y = unit(axis - x * np.einsum("ij,ij->i", axis, x)[:, None])
    return length.tolist(), np.stack((x, y, np.cross(x, y)), axis=2), (starts + ends) / 2
