"""Remove overlapping segments: of two, the one in the shorter chain (Keipour et al., RA-L 2022, section III-E)."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..config import PruneConfig
from ..errors import ConfigError, require
from ..geometry.curves import Curves, runs
from ..geometry.limits import MAX_NEAR_PAIRS
from ..geometry.polyline import unit
from ..types import Bools, Floats, Ints
from ..types.stopwatch import timed

WIDTH_VOXELS = 1.5
"""Width of the cuboids in voxels (pixels in 2-D): paths that run in neighboring voxels overlap, others do not."""

ONE_LAYER: Ints = np.zeros(0, dtype=np.int64)
"""Layers of chains that all lie in one."""


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


@timed("prune")
def prune(chains: Curves, voxel: float, config: PruneConfig, layer: Ints = ONE_LAYER) -> Pruned:
    """Remove overlapping segments: of two segments that overlap, the one in the chain with fewer segments is removed.

    The rule is that of Keipour et al. (RA-L 2022), section III-E. A segment counts as a cuboid with a square cross-section;
    segments overlap if FCL finds that their cuboids intersect. Neighbors in a chain, which share a joint, do not count. Of
    chains of equal length the later one loses its segment. A chain that loses an inner segment is split in two, a ring is opened.

    Parameters
    ----------
    chains
        the joints of the fitted chains.
    voxel
        m (1 px in 2-D), edge of a voxel; if `config.width` is not set, the cuboids are 1.5 of them wide.
    config
        section `prune` of the settings.
    layer
        (C,), the layer that each chain lies in: chains of different layers overlap. Empty if there is one layer.

    Returns
    -------
    The chains that are left, in the order given, and the segments removed.

    Raises
    ------
    ConfigError : the segments are so long or so wide that more than `MAX_NEAR_PAIRS` pairs may overlap.
    """
    if not len(chains):
        return Pruned(chains, np.zeros((0, 2, chains.points.shape[1])))
    width = config.width or WIDTH_VOXELS * voxel
    starts, ends = chains.points[chains.segments], chains.points[chains.segments + 1]
    owner = chains.owner[chains.segments]
    pairs = near_pairs(starts, ends, owner, width)
    if layer.size:
        of_segment = layer[owner]
        pairs = pairs[of_segment[pairs[:, 0]] == of_segment[pairs[:, 1]]]
    overlapping = pairs[cuboids_intersect(starts, ends, pairs, width)]
    kept = _kept_segments(chains, overlapping)
    removed = np.stack((starts, ends), axis=1)[~kept]
    if not len(removed):
        return Pruned(chains, removed)
    lines, closed = [], []
    for line, is_closed, own in zip(chains, chains.closed, np.split(kept, chains.segment_bounds[1:-1]), strict=True):
        left = runs(own)
        lines += [line[first : end + 1] for first, end in left]
        closed += [bool(is_closed and own.all())] * len(left)
    return Pruned(Curves.of(lines, closed), removed)


def _kept_segments(chains: Curves, overlapping: Ints) -> Bools:
    """Return which segments stay, (S,): of each two that overlap, (K, 2), in this order, one is removed unless one already was.

    The first and the last segment of a ring share a joint and stay.
    """
    owner, bounds = chains.owner[chains.segments].tolist(), chains.segment_bounds.tolist()
    left = np.diff(bounds).tolist()
    kept = [True] * len(owner)
    for i, j in overlapping.tolist():
        a, b = owner[i], owner[j]
        meet = a == b and chains.closed[a] and (i, j) == (bounds[a], bounds[a + 1] - 1)
        if kept[i] and kept[j] and not meet:
            loser = j if left[b] <= left[a] else i
            kept[loser] = False
            left[owner[loser]] -= 1
    return np.array(kept)


def near_pairs(starts: Floats, ends: Floats, owner: Ints, width: float) -> Ints:
    """Return the pairs of segments whose cuboids may intersect, since the spheres around the cuboids do.

    Parameters
    ----------
    starts, ends
        (S, D) m, D = 3 (in 2-D: px, D = 2), the two joints of each of S segments.
    owner
        (S,), chain of each segment. Consecutive segments of a chain, which share a joint, are left out.
    width
        edge of the cuboids' square cross-section, m (px in 2-D).

    Returns
    -------
    (K, 2) indices (i, j) with i < j, in lexicographic order.

    Raises
    ------
    ConfigError : there are more than `MAX_NEAR_PAIRS`.
    """
    diameter = np.sqrt(np.sum((ends - starts) ** 2, axis=1).max(initial=0) + 2 * width**2)  # of the largest sphere
    tree = cKDTree((starts + ends) / 2)
    count = (int(tree.count_neighbors(tree, diameter)) - len(starts)) // 2  # without a list of them
    if count > MAX_NEAR_PAIRS:
        raise ConfigError(
            f"fit.segment_length, prune.width: {count} pairs of segments within {diameter:.3g} of each other may overlap, "
            f"the limit is {MAX_NEAR_PAIRS}: set shorter segments or a smaller width, or segment more narrowly",
            code="value-out-of-bounds",
        )
    pairs: Ints = tree.query_pairs(diameter, output_type="ndarray")
    first, second = pairs.T
    pairs = pairs[(second > first + 1) | (owner[first] != owner[second])]
    return pairs[np.lexsort(pairs.T[::-1])]


def cuboids_intersect(starts: Floats, ends: Floats, pairs: Ints, width: float) -> Bools:
    """Test pairs of segments, taken as cuboids, for intersection: the box-box test of FCL (package python-fcl).

    Parameters
    ----------
    starts, ends, width
        as for `near_pairs`. In 2-D the cuboids lie in the plane z = 0.
    pairs
        (K, 2), the segments to be tested.

    Returns
    -------
    (K,) whether the two cuboids of each pair intersect.
    """
    if not len(pairs):
        return np.zeros(0, dtype=bool)
    fcl = require("fcl")
    request = fcl.CollisionRequest()
    level = ((0, 0), (0, 3 - starts.shape[1]))
    lengths, rotations, middles = _boxes_of(np.pad(starts, level), np.pad(ends, level))
    boxes = {
        k: fcl.CollisionObject(fcl.Box(lengths[k], width, width), fcl.Transform(rotations[k], middles[k]))
        for k in np.unique(pairs).tolist()
    }
    # each test has a result of its own: one that is used again stays "colliding"
    return np.array([fcl.collide(boxes[i], boxes[j], request, fcl.CollisionResult()) > 0 for i, j in pairs.tolist()])


def _boxes_of(starts: Floats, ends: Floats) -> tuple[list[float], Floats, Floats]:
    """Return lengths, rotations (S, 3, 3) whose first columns are the segments' directions, and middles (S, 3)."""
    offset = ends - starts
    length = np.linalg.norm(offset, axis=1)
    x = offset / length[:, None]
    axis = np.eye(3)[np.argmin(np.abs(x), axis=1)]
    y = unit(axis - x * np.einsum("ij,ij->i", axis, x)[:, None])
    return length.tolist(), np.stack((x, y, np.cross(x, y)), axis=2), (starts + ends) / 2
