"""How far the nodes of a chain lie from the same nodes of the true cable, as trackers count them."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from ...types import Chain, Floats
from ..scenes.model import Truth

SEAMS = 10  # places per node at which a ring is tried to begin


def node_error(chain: Chain, truth: Truth) -> float:
    """Mean distance in mm between joint i of the chain and node i of the cable, as many and evenly along it.

    Order counts, place along the cable counts, too; of the two directions, and of a ring's beginnings, the better.
    """
    if truth.closed:
        return 1e3 * _round(chain.joints[:-1] if chain.closed else chain.joints, truth)
    nodes = _at(truth, np.linspace(0, truth.length, len(chain.joints)))
    return 1e3 * float(min(np.linalg.norm(chain.joints - way, axis=1).mean() for way in (nodes, nodes[::-1])))


def _round(joints: Floats, truth: Truth) -> float:
    """The mean distance in m of nodes (K, 3) to K nodes round a ring, begun where it fits best."""
    count = len(joints)
    ring = _at(truth, np.arange(count * SEAMS) * truth.length / (count * SEAMS))
    start, node = np.arange(count * SEAMS)[:, None], np.arange(count)[None]
    gap = [cdist(way, ring)[node, (start + SEAMS * node) % len(ring)].mean(axis=1).min() for way in (joints, joints[::-1])]
    return float(min(gap))


def _at(truth: Truth, arcs: Floats) -> Floats:
    """(K, 3) points of the axis at arcs (K,) in m."""
    axis, along = truth.axis, truth.arcs
    if truth.closed:
        axis, along = np.vstack((axis, axis[:1])), np.append(along, truth.length)
    return np.column_stack([np.interp(arcs, along, axis[:, k]) for k in range(3)])
