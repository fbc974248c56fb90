"""Compare chains and cables as sets of points, and node by node: the metrics that other projects report."""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ...types import Bools, Floats
from ..scenes.model import Truth
from .distances import sample_chain
from .observed import Observed
from .record import Metric, number

F_LIMITS_MM = (2, 5, 10)
"""Distances in mm within which a point counts as right in the F score."""


def measure(match: Observed) -> dict[str, Any]:
    """Return the distances of the chains from the cables, as sets of points 1 mm apart, and node by node.

    to_truth, to_chains: mean distance of the chains' points from the nearest axis, and of the axes' points from the nearest chain
    (the two directions of the Chamfer distance), mm. f_2, f_5, f_10: harmonic mean of the shares of both within 2, 5 and 10 mm, 0
    to 1. Of the chains matched with a cable, node by node, with 50 nodes each: position_rms, root mean square distance, mm;
    nodes_seen and nodes_hidden, mean distance of nodes that the camera sees, and of hidden ones, mm; edge_error, mean deviation
    of the distance of neighboring nodes, as a fraction of the true distance. NaN without chains, or without a matched one.
    """
    from ..sequences.nodes import node_offsets

    found = np.concatenate([np.zeros((0, 3)), *(sample_chain(chain)[0] for chain in match.chains)])
    true = np.concatenate([np.zeros((0, 3)), *(truth.axis for truth in match.truths)])
    there, back = _distances_mm(found, true), _distances_mm(true, found)
    values: dict[str, Any] = {"to_truth": _mean(there), "to_chains": _mean(back)}
    for limit in F_LIMITS_MM:
        shares = [float((distances <= limit).mean()) if len(distances) else 0.0 for distances in (there, back)]
        values[f"f_{limit}"] = 2 * shares[0] * shares[1] / max(sum(shares), np.finfo(float).tiny)
    offsets = [(node_offsets([chain], [truth], keeps_direction=False)[0], truth) for chain, truth in match.matched]
    known = [(offset, truth) for offset, truth in offsets if np.isfinite(offset).all()]
    distance = np.concatenate([np.zeros(0), *(1e3 * np.linalg.norm(offset, axis=1) for offset, _ in known)])
    seen = np.concatenate([np.zeros(0, dtype=bool), *(_seen_nodes(truth) for _, truth in known)])
    edges = np.concatenate([np.zeros(0), *(_edge_errors(offset, truth) for offset, truth in known)])
    nodes = {"nodes_seen": _mean(distance[seen]), "nodes_hidden": _mean(distance[~seen]), "edge_error": _mean(edges)}
    return values | {"position_rms": _mean(distance**2) ** 0.5} | nodes


def _distances_mm(points: Floats, others: Floats) -> Floats:
    """Return the distance in mm of each point from the nearest of the others; infinite if there are none."""
    return 1e3 * cKDTree(others).query(points)[0] if len(points) and len(others) else np.full(len(points), np.inf)


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) and np.isfinite(values).all() else float("nan")


def _seen_nodes(truth: Truth) -> Bools:
    """Return which of a cable's 50 nodes the camera sees, (50,) bool."""
    from ..sequences.nodes import true_nodes

    seen = np.ones(len(truth.axis), dtype=bool) if truth.seen is None else truth.seen
    return np.asarray(seen[cKDTree(truth.axis).query(true_nodes(truth))[1]])


def _edge_errors(offset: Floats, truth: Truth) -> Floats:
    """Return the deviation of each distance of neighboring nodes, as a fraction of the true one; offset : (50, 3) m."""
    from ..sequences.nodes import true_nodes

    nodes = true_nodes(truth)
    true, found = (np.linalg.norm(np.diff(each, axis=0), axis=1) for each in (nodes, nodes + offset))
    return np.asarray(np.abs(found - true) / true)


METRIC = Metric(
    measure,
    (
        number(("edges", "%"), 6, "edge_error", 1, np.mean, 100),
        number(("position", "RMSE mm"), 8, "position_rms", 1),
        number(("to truth", "mm"), 8, "to_truth", 2),
        number(("to chains", "mm"), 9, "to_chains", 2),
        *(number(("F score", f"{limit} mm"), 7, f"f_{limit}", 1, np.mean, 100) for limit in F_LIMITS_MM),
        number(("nodes", "seen mm"), 7, "nodes_seen", 1),
        number(("nodes", "hidden"), 7, "nodes_hidden", 1),
    ),
)
