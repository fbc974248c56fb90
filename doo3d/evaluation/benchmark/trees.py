"""Evaluate the detection of branched objects on rendered harnesses."""

from functools import partial

import numpy as np

from ...config import Config
from ...types import Array, Chain, ChainEnd, Detection, Junction, LinearObject
from ..metrics.record import Record
from ..metrics.trees import COLUMNS, score_trees
from ..scenes.model import Scene
from .cases import Case, KnownFrame, scene_cases
from .evaluate import Masking, detect_safely, given_mask
from .pictures import panels, truth_chain
from .run import Benchmark


def tree_benchmark(config: Config, method: Masking = "mask") -> Benchmark:
    """Return the benchmark of branched objects; `merge.branches` is on in the config, `method` is as for `frame_benchmark`."""
    measure = partial(measure_tree, config=config, method=method)
    return Benchmark(measure, COLUMNS, _panels, tree_caption, lambda row: row.faults)


tree_cases = scene_cases
"""Return a case for every family of branched objects and every seed."""


def measure_tree(case: Case, config: Config, method: Masking) -> list[Record]:
    """Render a case, run the detection, and return its record; a failed detection is scored without chains."""
    known: KnownFrame = case.load()
    assert known.scene is not None
    detection, end = detect_safely(known.data, config, given_mask(known.scene.name, known, method))
    return [case.record(score_trees(detection, known.scene) | end, detection)]


def _panels(row: Record) -> tuple[Array, Array]:
    """Draw the detected trees over their frame, and the true trees over the same frame."""
    known = row.case.load()
    return panels(known.data, row.detection, true_trees(known.scene))


def true_trees(scene: Scene) -> Detection:
    """Return the true trees of a scene as a detection: a chain for each strand, junctions and objects."""
    chains: list[Chain] = []
    junctions: list[Junction] = []
    objects = []
    for tree in scene.trees:
        first = len(chains), len(junctions)
        ends: dict[int, list[ChainEnd]] = {}
        for cable, *nodes in tree.edges:
            for side, node in enumerate(nodes):
                ends.setdefault(node, []).append(ChainEnd(len(chains), side))
            chains.append(truth_chain(scene.cables[cable]))
        for node, met in sorted(ends.items()):
            if len(met) > 2:
                radii = np.array([chains[end.chain].radius for end in met])
                junctions.append(Junction(tree.nodes[node], tuple(sorted(met)), radii))
        objects.append(LinearObject(tuple(range(first[0], len(chains))), tuple(range(first[1], len(junctions))), 1))
    return Detection(tuple(chains), junctions=tuple(junctions), objects=tuple(objects))


def tree_caption(row: Record) -> str:
    """Return a caption for the picture of a record, in one line: its name and its faults, or that it is correct."""
    faults = [
        f"{row.right} of {row.objects} objects right" if row.right < row.objects else "",
        f"{row.spurious} spurious objects" if row.spurious else "",
        f"{row.found} of {row.junctions} junctions found" if row.found < row.junctions else "",
        f"{row.false} false junctions" if row.false else "",
        f"{row.taken} of {row.crossings} crossings taken for junctions" if row.taken else "",
    ]
    return f"{row.frame}   {row.get('error') or '; '.join(filter(None, faults)) or 'correct'}   (detection left, truth right)"
