"""Measure the distance of a chain's nodes from the same nodes of the true cable, as trackers are measured."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from ...types import Chain, Floats
from ..scenes.model import Truth

STARTS_PER_NODE = 10
"""Positions per node at which the first node of a closed cable is tried."""


def node_error(chain: Chain, truth: Truth) -> float:
    """Return the mean distance in mm of joint i of a chain from node i of the true cable.

    The nodes of the cable are evenly spaced along its axis, as many as the chain has joints. So a chain that lies on the axis but
    is shifted along it has an error, too. The lesser error of the chain's two directions is returned; on a closed cable, the
    least error of all positions of the first node.
    """
    if truth.closed:
        return 1e3 * _closed_error(chain.joints[:-1] if chain.closed else chain.joints, truth)
    nodes = axis_points(truth, np.linspace(0, truth.length, len(chain.joints)))
    return 1e3 * float(min(np.linalg.norm(chain.joints - ordered, axis=1).mean() for ordered in (nodes, nodes[::-1])))


def _closed_error(joints: Floats, truth: Truth) -> float:
    """Return the mean distance in m of joints (K, 3) from K even nodes of a closed cable, from the best start."""
    count = len(joints)
    starts = count * STARTS_PER_NODE
    ring = axis_points(truth, np.arange(starts) * truth.length / starts)
    start, node = np.arange(starts)[:, None], np.arange(count)[None]
    matching = (start + STARTS_PER_NODE * node) % len(ring)
    return float(min(cdist(ordered, ring)[node, matching].mean(axis=1).min() for ordered in (joints, joints[::-1])))


def axis_points(truth: Truth, arcs: Floats) -> Floats:
    """Return the points (K, 3) m of a cable's axis at arcs (K,) in m."""
    axis, axis_arcs = truth.axis, truth.arcs
    if truth.closed:
        axis, axis_arcs = np.vstack((axis, axis[:1])), np.append(axis_arcs, truth.length)
    return np.column_stack([np.interp(arcs, axis_arcs, axis[:, k]) for k in range(3)])
