"""Of two segments that overlap, the one in the shorter chain goes (paper, section III-E)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..config import PruneConfig
from ..errors import require
from ..geometry.polyline import unit
from ..types import Bools, Chain, Floats, Ints
from . import FrameContext

WIDTH_OVER_VOXEL = 1.5
"""Width of the cuboids in voxels (pixels in 2-D): paths that run in neighboring voxels overlap, others do not."""


def prune(chains: list[Chain], context: FrameContext, config: PruneConfig) -> list[Chain]:
    """Chains without overlaps; a chain that loses an inner segment falls in two, one that loses all vanishes.

    The width of the cuboids is chosen from the voxel of the context when the config does not give it.
    """
    if not chains:
        return []
    width = config.width or WIDTH_OVER_VOXEL * context.voxel
    owner = np.repeat(np.arange(len(chains)), [len(chain.joints) - 1 for chain in chains])
    starts = np.concatenate([chain.joints[:-1] for chain in chains])
    ends = np.concatenate([chain.joints[1:] for chain in chains])
    kept = _keep(overlaps(starts, ends, width), owner, [chain.closed for chain in chains])
    result: list[Chain] = []
    for c, chain in enumerate(chains):
        result += _runs(chain, kept[owner == c])
    return result


def _keep(pairs: list[tuple[int, int]], owner: np.ndarray[tuple[int], np.dtype[np.int64]], closed: list[bool]) -> Bools:
    kept = np.ones(len(owner), dtype=bool)
    size = np.bincount(owner)
    first = np.concatenate(([0], np.cumsum(size)[:-1]))
    total = size.copy()
    for i, j in pairs:
        a, b = owner[i], owner[j]
        apart = j - i
        if a == b and (apart == 1 or (closed[a] and i == first[a] and apart == total[a] - 1)):
            continue  # neighbours share a joint
        if kept[i] and kept[j]:
            loser = j if size[b] <= size[a] else i
            kept[loser] = False
            size[owner[loser]] -= 1
    return kept


def _runs(chain: Chain, kept: Bools) -> list[Chain]:
    """The runs of kept segments of one chain, as chains."""
    if kept.all():
        return [chain]
    edges = np.flatnonzero(np.diff(np.concatenate(([False], kept, [False])).astype(int)))
    return [Chain(chain.joints[a : b + 1], chain.segment_length) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def overlaps(starts: Floats, ends: Floats, width: float) -> list[tuple[int, int]]:
    """Which of the segments (S, D) -> (S, D), as square cuboids of `width`, intersect: pairs i < j, sorted.

    FCL's dynamic AABB tree finds the pairs, its box-box test decides. In 2-D the cuboids lie in the plane z = 0.
    Segments that have nothing but the one before and the one after within their reach are not given to FCL at all; two
    in a row always touch and are listed only where FCL saw them.
    """
    near = _crowded(starts, ends, width)
    if not len(near):
        return []
    fcl = require("fcl")
    if starts.shape[1] == 2:
        zero = np.zeros((len(starts), 1))
        starts, ends = np.hstack((starts, zero)), np.hstack((ends, zero))
    lengths, rotations, middles = _boxes(starts[near], ends[near])
    boxes = [
        fcl.Box(length, width, width) for length in lengths
    ]  # contacts name the geometry, so it must live as long as they do
    objects = [
        fcl.CollisionObject(box, fcl.Transform(rotation, middle))
        for box, rotation, middle in zip(boxes, rotations, middles, strict=True)
    ]
    index = {id(box): int(i) for box, i in zip(boxes, near, strict=True)}
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(objects)
    manager.setup()
    request = fcl.CollisionRequest(num_max_contacts=64 * len(boxes) ** 2, enable_contact=False)
    data = fcl.CollisionData(request=request, result=fcl.CollisionResult())
    manager.collide(data, fcl.defaultCollisionCallback)
    found = {(index[id(contact.o1)], index[id(contact.o2)]) for contact in data.result.contacts}
    return sorted((min(pair), max(pair)) for pair in found)


def _crowded(starts: Floats, ends: Floats, width: float) -> Ints:
    """The segments with another one, not the next, so near that their cuboids could intersect: ascending indices."""
    reach = float(np.linalg.norm(ends - starts, axis=1).max()) + np.sqrt(2.0) * width
    pairs = cKDTree((starts + ends) / 2).query_pairs(reach * (1 + 1e-9), output_type="ndarray")
    return np.unique(pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > 1])


def _boxes(starts: Floats, ends: Floats) -> tuple[list[float], Floats, Floats]:
    """Lengths, rotations (S, 3, 3) whose first columns run along the segments, and middles (S, 3)."""
    along = ends - starts
    length = np.linalg.norm(along, axis=1)
    x = along / length[:, None]
    axis = np.eye(3)[np.argmin(np.abs(x), axis=1)]
    y = unit(axis - x * np.einsum("ij,ij->i", axis, x)[:, None])
    return length.tolist(), np.stack((x, y, np.cross(x, y)), axis=2), (starts + ends) / 2
