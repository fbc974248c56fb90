"""Compare chains with their matched objects: distances from the axis, of nodes and of ends, and radii."""

from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from ...types import Chain, Floats
from ..scenes.model import Truth
from .correct import IMAGE_RMS
from .distances import end_error, rms_mm
from .observed import Observed
from .record import Metric, number

STARTS_PER_NODE = 10
"""Number of tried positions of the first node of a closed cable, per distance between nodes."""


def node_error(chain: Chain, truth: Truth) -> float:
    """Return the mean distance in mm of joint i of a chain from node i of the true cable.

    The nodes of the cable are evenly spaced along its axis, as many as the chain has joints. A chain on the axis but shifted
    along it has an error, too. The smaller error of the chain's two directions is returned; on a closed cable, the smallest error
    over all positions of the first node.
    """
    if truth.closed:
        return 1e3 * _closed_error(chain.joints[:-1] if chain.closed else chain.joints, truth)
    nodes = axis_points(truth, np.linspace(0, truth.length, len(chain.joints)))
    return 1e3 * float(min(np.linalg.norm(chain.joints - ordered, axis=1).mean() for ordered in (nodes, nodes[::-1])))


def _closed_error(joints: Floats, truth: Truth) -> float:
    """Return the mean distance in m of joints (K, 3) from K even nodes of a closed cable, with the best first node."""
    count = len(joints)
    starts = count * STARTS_PER_NODE
    ring = axis_points(truth, np.arange(starts) * truth.length / starts)
    start, node = np.arange(starts)[:, None], np.arange(count)[None]
    matching = (start + STARTS_PER_NODE * node) % len(ring)
    return float(min(cdist(ordered, ring)[node, matching].mean(axis=1).min() for ordered in (joints, joints[::-1])))


def axis_points(truth: Truth, arcs: Floats) -> Floats:
    """Return the points (K, 3) m of a cable's axis at arc lengths (K,) m."""
    axis_arcs = np.append(truth.arcs, truth.length) if truth.closed else truth.arcs
    return np.column_stack([np.interp(arcs, axis_arcs, column) for column in truth.line.T])


def measure(match: Observed) -> dict[str, Any]:
    """Return the distances from the axes, nodes and tips, and the ratio of radii; NaN if no object has a chain.

    rms_seen, rms_hidden: RMS distance from the true axes where these are seen, and hidden, mm. The others are means over the
    objects with a chain. node_error: distance of joint i of the chain from node i of its object, which has as many evenly spaced
    nodes, mm. end_error: distance of chain ends from the tips of open objects, mm. radius_ratio: detected divided by true radius.
    """
    return {
        "rms_seen": rms_mm([part.distance[part.seen] for part in match.distances]),
        "rms_hidden": rms_mm([part.distance[~part.seen] for part in match.distances]),
        "node_error": _mean([node_error(chain, truth) for chain, truth in match.matched]),
        "end_error": _mean([end_error(chain, truth) for chain, truth in match.matched if not truth.closed]),
        "radius_ratio": _mean([chain.radius / truth.radius for chain, truth in match.matched]),
    }


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


METRIC = Metric(
    measure,
    (
        number(("RMS seen", "mm"), 9, "rms_seen", 2),
        number(("hidden", "mm"), 7, "rms_hidden", 2),
        IMAGE_RMS,
        number(("nodes", "mm"), 6, "node_error", 1),
        number(("ends", "mm"), 6, "end_error", 1),
        number(("radius", "ratio"), 7, "radius_ratio", 2),
    ),
)
