"""Remove overlapping segments: of two, the one in the shorter chain (Keipour et al., RA-L 2022, section III-E)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..config import PruneConfig
from ..errors import require
from ..geometry.polyline import unit
from ..types import Bools, Chain, Floats, Ints
from . import FrameContext

WIDTH_VOXELS = 1.5
"""Width of the cuboids in voxels (pixels in 2-D): paths that run in neighboring voxels overlap, others do not."""

CONTACTS_PER_PAIR = 64
"""Contacts that FCL may report, per pair of cuboids; it stops looking when there are more."""


@dataclass(frozen=True)
class Pruned:
    """The chains that pruning left, and the segments that it removed.

    Attributes
    ----------
    chains
        the chains that are left, and the parts of chains that were split.
    removed
        (S, 2, D) m, D = 3 (in 2-D: px, D = 2), the two joints of each of the S removed segments, in the order of the chains given
        to `prune`.
    """

    chains: list[Chain]
    removed: Floats


def prune(chains: list[Chain], context: FrameContext, config: PruneConfig) -> Pruned:
    """Remove overlapping segments: of two segments that overlap, the one in the chain with fewer segments is removed.

    The rule is that of Keipour et al. (RA-L 2022), section III-E. A segment counts as a cuboid with a square cross-section;
    segments overlap if their cuboids intersect. Neighbors in a chain, which share a joint, do not count. Of chains of equal
    length the later one loses its segment. A chain that loses an inner segment is split in two, a ring is opened.

    Parameters
    ----------
    chains
        the fitted chains.
    context
        the data of the frame; if `config.width` is not set, the cuboids are 1.5 of its voxels wide.
    config
        section `prune` of the settings.

    Returns
    -------
    The chains that are left, in the order given, and the segments removed.
    """
    if not chains:
        return Pruned([], np.zeros((0, 2, context.grid.centroids.shape[1])))
    width = config.width or WIDTH_VOXELS * context.voxel
    owner = np.repeat(np.arange(len(chains)), [len(chain.joints) - 1 for chain in chains])
    starts = np.concatenate([chain.joints[:-1] for chain in chains])
    ends = np.concatenate([chain.joints[1:] for chain in chains])
    kept = _keep(overlaps(starts, ends, width), owner, [chain.closed for chain in chains])
    left: list[Chain] = []
    for i, chain in enumerate(chains):
        left += _runs(chain, kept[owner == i])
    return Pruned(left, np.stack((starts[~kept], ends[~kept]), axis=1))


def _keep(pairs: Sequence[tuple[int, int]], owner: Ints, closed: Sequence[bool]) -> Bools:
    """Return the segments that are kept, (S,) bool.

    Parameters
    ----------
    pairs
        segments i < j that overlap, in order.
    owner
        (S,), number of the chain of each segment.
    closed
        of each chain, whether its last segment meets its first.
    """
    kept = np.ones(len(owner), dtype=bool)
    size = np.bincount(owner)
    first = np.concatenate(([0], np.cumsum(size)[:-1]))
    total = size.copy()
    for i, j in pairs:
        a, b = owner[i], owner[j]
        if a == b and (j - i == 1 or (closed[a] and i == first[a] and j - i == total[a] - 1)):
            continue  # neighbors share a joint
        if kept[i] and kept[j]:
            loser = j if size[b] <= size[a] else i
            kept[loser] = False
            size[owner[loser]] -= 1
    return kept


def _runs(chain: Chain, kept: Bools) -> list[Chain]:
    """Return the runs of kept segments of one chain, (N,) bool, as chains."""
    if kept.all():
        return [chain]
    edges = np.flatnonzero(np.diff(np.concatenate(([False], kept, [False])).astype(int)))
    return [Chain(chain.joints[a : b + 1], chain.segment_length) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def overlaps(starts: Floats, ends: Floats, width: float) -> list[tuple[int, int]]:
    """Find the pairs of segments that intersect, each taken as a cuboid with a square cross-section.

    In 2-D the cuboids lie in the plane z = 0. The test is the box-box test of FCL (package python-fcl).

    Parameters
    ----------
    starts, ends
        (S, D) m, D = 3 (in 2-D: px, D = 2), the two joints of each of S segments, at least one.
    width
        edge of the cross-section, m (px in 2-D).

    Returns
    -------
    Pairs (i, j) of segment indices with i < j, sorted. Ignore the pairs of segments that share a joint: they always touch, and
    only some of them are listed.
    """
    near = _crowded(starts, ends, width)
    if not len(near):
        return []
    fcl = require("fcl")
    if starts.shape[1] == 2:
        zero = np.zeros((len(starts), 1))
        starts, ends = np.hstack((starts, zero)), np.hstack((ends, zero))
    lengths, rotations, middles = _boxes(starts[near], ends[near])
    # contacts name the geometry, so it must live as long as they do
    boxes = [fcl.Box(length, width, width) for length in lengths]
    objects = [
        fcl.CollisionObject(box, fcl.Transform(rotation, middle))
        for box, rotation, middle in zip(boxes, rotations, middles, strict=True)
    ]
    index = {id(box): int(i) for box, i in zip(boxes, near, strict=True)}
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(objects)
    manager.setup()
    request = fcl.CollisionRequest(num_max_contacts=CONTACTS_PER_PAIR * len(boxes) ** 2, enable_contact=False)
    data = fcl.CollisionData(request=request, result=fcl.CollisionResult())
    manager.collide(data, fcl.defaultCollisionCallback)
    pairs = {(index[id(contact.o1)], index[id(contact.o2)]) for contact in data.result.contacts}
    return sorted((min(pair), max(pair)) for pair in pairs)


def _crowded(starts: Floats, ends: Floats, width: float) -> Ints:
    """Return the segments with another one, not the next, whose cuboid could intersect theirs: ascending indices.

    Of the nearest segments three may be the segment itself and the two next to it, so with one more there is another if any.
    """
    reach = float(np.linalg.norm(ends - starts, axis=1).max()) + np.sqrt(2.0) * width
    middles = (starts + ends) / 2
    near = cKDTree(middles).query(middles, k=4, distance_upper_bound=reach * (1 + 1e-9))[1]
    count = np.arange(len(middles))
    return np.flatnonzero(((near < len(middles)) & (np.abs(near - count[:, None]) > 1)).any(axis=1))


def _boxes(starts: Floats, ends: Floats) -> tuple[list[float], Floats, Floats]:
    """Return lengths, rotations (S, 3, 3) whose first columns are the segments' directions, and middles (S, 3)."""
    offset = ends - starts
    length = np.linalg.norm(offset, axis=1)
    x = offset / length[:, None]
    axis = np.eye(3)[np.argmin(np.abs(x), axis=1)]
    y = unit(axis - x * np.einsum("ij,ij->i", axis, x)[:, None])
    return length.tolist(), np.stack((x, y, np.cross(x, y)), axis=2), (starts + ends) / 2
