"""Score branched objects against trees of known shape: junctions, tips, edges, and crossings taken for branches."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ...types import Detection, Floats
from ..scenes.model import Scene, Tree
from .record import TIME, Record, Records, added, amount, parts, share

NODE_RADII = 3.0
"""Radii of the thickest strand at a true node within which a detected junction or tip is that node."""

EDGE_RADII = 3.0
"""Radii of a true strand within which the joints of its chain must lie, all but the share EDGE_OUTSIDE."""

EDGE_OUTSIDE = 0.06
"""Share of a chain's joints that may lie off the true strand, as for the score of single cables."""


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
"""The columns of the table: of the true objects those right, and detected objects that are none of these; junctions found, and
detected at no true one; crossings at which a crossing and no junction was detected, and those at which a junction was; junctions
and crossings found, of all."""


def _sum(rows: Records, *keys: str) -> int:
    return sum(row[key] for row in rows for key in keys)


def score_trees(detection: Detection, scene: Scene) -> Record:
    """Return the counts of one frame.

    objects, right: true objects, and those found with every junction and tip at its place and every edge right. spurious:
    detected objects that are none of the right ones. junctions, found, false: true junctions, those found, and detected junctions
    at no true one. crossings, taken: true crossings of strands in the view, and those at which a junction was detected. crossed:
    those at which a crossing was detected, and no junction. faults: of objects, of junctions, and of crossings taken for
    junctions.

    Parameters
    ----------
    detection
        what was found with `merge.branches`, in the camera's optical frame.
    scene
        the true scene, with its trees.
    """
    nodes = np.concatenate([tree.nodes for tree in scene.trees])
    degree = np.concatenate([tree.degree for tree in scene.trees])
    reach = NODE_RADII * np.concatenate([_node_radii(tree, scene) for tree in scene.trees])
    places, kinds, of_end = _places(detection)
    matched = _matched(places, nodes, reach, kinds >= 3, degree >= 3)
    right, used = 0, set()
    first = 0
    for tree in scene.trees:
        own = range(first, first + len(tree.nodes))
        for number, each in enumerate(detection.objects):
            if _is_right(tree, scene, detection, each.chains, of_end, matched, own):
                right += 1
                used.add(number)
                break
        first += len(tree.nodes)
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
        "spurious": len(detection.objects) - len(used),
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
    axes = [cable.axis for cable in scene.cables]
    pixels = [scene.camera.project(axis) for axis in axes]
    meet = [tree.nodes[tree.degree >= 3] for tree in scene.trees]
    junctions = np.concatenate(meet) if meet else np.zeros((0, 3))
    found: list[Floats] = []
    for a in range(len(axes)):
        for b in range(a, len(axes)):
            pairs = cKDTree(pixels[a]).sparse_distance_matrix(cKDTree(pixels[b]), 1.5, output_type="coo_matrix")
            for i, j in zip(pairs.row.tolist(), pairs.col.tolist(), strict=True):
                if a == b and abs(i - j) < 60:
                    continue
                point = axes[a][i] if axes[a][i][2] < axes[b][j][2] else axes[b][j]
                limit = 6 * scene.cables[a].radius
                if np.linalg.norm(junctions - point, axis=1).min(initial=np.inf) < limit:
                    continue
                if all(np.linalg.norm(other - point) > 3 * limit for other in found):
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
    """Return detected place -> true node of the same kind within reach, one to one, at the least total distance."""
    if not len(places):
        return {}
    distance = np.linalg.norm(places[:, None] - nodes[None], axis=2)
    allowed = (distance <= reach) & (joined[:, None] == true_joined[None])
    rows, columns = linear_sum_assignment(np.where(allowed, distance, 1e3))
    return {int(i): int(j) for i, j in zip(rows, columns, strict=True) if allowed[i, j]}


def _is_right(
    tree: Tree,
    scene: Scene,
    detection: Detection,
    chains: Sequence[int],
    of_end: dict[tuple[int, int], int],
    matched: dict[int, int],
    own: range,
) -> bool:
    """Tell whether the chains of one detected object are the edges of a tree, between the right nodes and along the strands."""
    if len(chains) != len(tree.edges):
        return False
    ends = [tuple(sorted(matched.get(of_end[number, side], -1) - own.start for side in (0, 1))) for number in chains]
    true = [tuple(sorted(edge[1:])) for edge in tree.edges]
    if Counter(ends) != Counter(true):
        return False
    for number, pair in zip(chains, ends, strict=True):
        near = []
        for cable, a, b in tree.edges:
            if tuple(sorted((a, b))) == pair:
                truth = scene.cables[cable]
                distance = cKDTree(truth.axis).query(detection.chains[number].joints)[0]
                near.append(float((distance > EDGE_RADII * truth.radius).mean()) <= EDGE_OUTSIDE)
        if not any(near):
            return False
    return True
