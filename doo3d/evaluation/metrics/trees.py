"""Score branched objects against trees of known shape: junctions, tips, edges, and crossings taken for branches."""

import itertools
from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ...types import Chain, Detection, Floats
from ..scenes.model import Scene, Tree, Truth
from .crossings import true_crossings as crossings_of_cables
from .nodes import axis_points
from .record import TIME, Record, Records, added, amount, parts, share

NODE_RADII = 3.0
"""Greatest distance of a detected junction or tip from its true node, in radii of the node's thickest strand."""

EDGE_RADII = 3.0
"""Distance from a true strand, in its radii, within which its chain's joints must lie, except the fraction EDGE_OUTSIDE."""

EDGE_OUTSIDE = 0.06
"""Fraction of a chain's joints that may lie off the true strand; the same as in the score of single cables."""


COLUMNS = (
    share(("objects", "right"), 16, "objects", parts("objects", right="right"), "{}/{} {:.0f} %"),
    amount(("", "spurious"), 11, "spurious", added("spurious")),
    share(("junctions", "found"), 18, "junctions", parts("junctions", right="found"), "{}/{} {:.0f} %"),
    amount(("", "false"), 8, "false", added("false")),
    share(("crossings", "found"), 18, "crossings", parts("crossings", right="crossed"), "{}/{}"),
    amount(("", "taken"), 8, "taken", added("taken")),
    share(
        ("told", "apart"),
        13,
        "places",
        lambda rows: (_sum(rows, "junctions", "crossings"), _sum(rows, "found", "crossed")),
        "{2:.1f} %",
    ),
    TIME,
)
"""Columns of the table: true objects detected right; spurious objects; true junctions found, and false ones; crossings detected
as crossings, and those detected as junctions; junctions and crossings found together."""


def _sum(rows: Records, *keys: str) -> int:
    return sum(row[key] for row in rows for key in keys)


def score_trees(detection: Detection, scene: Scene) -> Record:
    """Return the counts of one frame with branched objects.

    objects, right: number of true objects, and of those found with every junction, tip and edge right. spurious: detected objects
    that match no right one. junctions, found, false: true junctions, those found, and detected junctions that match no true one.
    crossings, crossed, taken: true crossings of strands in the view, those detected as a crossing, and those detected as a
    junction. faults: the total of wrong objects, wrong junctions, and crossings detected as junctions.

    Parameters
    ----------
    detection
        the detection with `merge.branches`, in the camera's optical frame.
    scene
        the true scene, with its trees.
    """
    nodes = np.concatenate([tree.nodes for tree in scene.trees])
    degree = np.concatenate([tree.degree for tree in scene.trees])
    reach = NODE_RADII * np.concatenate([_node_radii(tree, scene) for tree in scene.trees])
    places, kinds, of_end = _places(detection)
    matched = _matched(places, nodes, reach, kinds >= 3, degree >= 3)
    used: list[int] = []
    first = 0
    for tree in scene.trees:
        ends = [tuple(matched.get(of_end[chain, side], -1) - first for side in (0, 1)) for chain in range(len(detection.chains))]
        found = (k for k, each in enumerate(detection.objects) if _is_right(tree, scene, detection, each.chains, ends))
        used += itertools.islice(found, 1)
        first += len(tree.nodes)
    right = len(used)
    is_junction = degree >= 3
    hits = {node for place, node in matched.items() if is_junction[node] and kinds[place] >= 3}
    crossings = true_crossings(scene)
    junctions = np.array([junction.position for junction in detection.junctions]).reshape(-1, 3)
    limit = 2 * NODE_RADII * max(cable.radius for cable in scene.cables)
    away = [p for p in junctions if np.linalg.norm(nodes[is_junction] - p, axis=1).min(initial=np.inf) > limit]
    at = [any(np.linalg.norm(p - crossing) < limit for p in away) for crossing in crossings]
    detected = [each.point for each in detection.crossings]
    crossed = [any(np.linalg.norm(p - crossing) < limit for p in detected) for crossing in crossings]
    counts = {
        "objects": len(scene.trees),
        "right": right,
        "spurious": len(detection.objects) - len(set(used)),
        "junctions": int(is_junction.sum()),
        "found": len(hits),
        "false": len(detection.junctions) - len(hits),
        "crossings": len(crossings),
        "taken": sum(map(bool, at)),
        "crossed": sum(found and not taken for found, taken in zip(crossed, at, strict=True)),
    }
    missed = counts["objects"] - right + counts["junctions"] - counts["found"]
    faults = missed + counts["spurious"] + counts["false"] + counts["taken"]
    return Record(counts | {"faults": faults, "correct": faults == 0})


def true_crossings(scene: Scene) -> Floats:
    """Return the points of upper strands where strands cross in the view without meeting, (C, 3) m."""
    junctions = np.concatenate([np.zeros((0, 3)), *(tree.nodes[tree.degree >= 3] for tree in scene.trees)])
    crossings = crossings_of_cables(scene.cables)
    found: list[Floats] = []
    for upper, arc in zip(crossings.cable[:, 0], crossings.arc[:, :1], strict=True):
        point, limit = axis_points(scene.cables[upper], arc)[0], 6 * scene.cables[upper].radius
        apart = all(np.linalg.norm(other - point) > 3 * limit for other in found)
        if apart and np.linalg.norm(junctions - point, axis=1).min(initial=np.inf) >= limit:
            found.append(point)
    return np.array(found).reshape(-1, 3)


def _node_radii(tree: Tree, scene: Scene) -> Floats:
    radii = np.zeros(len(tree.nodes))
    for cable, a, b in tree.edges:
        radii[[a, b]] = np.maximum(radii[[a, b]], scene.cables[cable].radius)
    return radii


def _places(detection: Detection) -> tuple[Floats, np.ndarray, dict[tuple[int, int], int]]:
    """Return the detected junctions and tips: positions (K, 3), number of ends (K,), and the place of each chain end."""
    places: list[Floats] = []
    kinds: list[int] = []
    of_end: dict[tuple[int, int], int] = {}
    for junction in detection.junctions:
        for end in junction.ends:
            of_end[end.chain, end.end] = len(places)
        places.append(junction.position)
        kinds.append(len(junction.ends))
    for number, chain in enumerate(detection.chains):
        for side in (0, 1):
            if (number, side) not in of_end:
                of_end[number, side] = len(places)
                places.append(chain.joints[-side])
                kinds.append(1)
    return np.array(places).reshape(-1, 3), np.array(kinds, dtype=int), of_end


def _matched(places: Floats, nodes: Floats, reach: Floats, joined: np.ndarray, true_joined: np.ndarray) -> dict[int, int]:
    """Match detected places with true nodes of the same kind within reach, one to one, at the least total distance."""
    if not len(places):
        return {}
    distance = np.linalg.norm(places[:, None] - nodes[None], axis=2)
    allowed = (distance <= reach) & (joined[:, None] == true_joined[None])
    rows, columns = linear_sum_assignment(np.where(allowed, distance, 1e3))
    return {int(i): int(j) for i, j in zip(rows, columns, strict=True) if allowed[i, j]}


def _is_right(tree: Tree, scene: Scene, detection: Detection, chains: Sequence[int], ends: Sequence[tuple[int, ...]]) -> bool:
    """Return whether the chains of one detected object are the edges of a tree, between the right nodes.

    Each chain must also follow its strand. ends : for each chain, the nodes of the tree at its two ends.
    """
    if Counter(tuple(sorted(ends[chain])) for chain in chains) != Counter(tuple(sorted(edge[1:])) for edge in tree.edges):
        return False
    return all(
        any(
            _runs_along(detection.chains[chain], scene.cables[cable])
            for cable, *nodes in tree.edges
            if sorted(nodes) == sorted(ends[chain])
        )
        for chain in chains
    )


def _runs_along(chain: Chain, truth: Truth) -> bool:
    distance = cKDTree(truth.axis).query(chain.joints)[0]
    return float((distance > EDGE_RADII * truth.radius).mean()) <= EDGE_OUTSIDE
