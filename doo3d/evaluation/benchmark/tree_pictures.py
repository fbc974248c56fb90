"""Draw the trees that were detected in a rendered scene beside the true trees."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...types import Array, Chain, ChainEnd, Detection, Junction, LinearObject
from ...viz import draw
from ..rendering.renderer import render
from ..scenes.model import Scene
from .pictures import cropped, truth_chain, with_caption, write_png
from .trees import TreeRow


def tree_picture(row: TreeRow) -> Array:
    """Draw the detected trees over their frame, with the true trees over the same frame to the right and a caption above.

    Parameters
    ----------
    row
        the result for one scene, with its detection and the builder of its scene.

    Returns
    -------
    (H, W, 3) uint8 RGB, cropped to the cables and chains with a margin.

    Raises
    ------
    ValueError : the row has no scene or no detection.
    """
    if row.scene is None or row.detection is None:
        raise ValueError(f"{row.name}: the scene is unknown")
    scene = row.scene()
    both = row.detection, true_trees(scene)
    joints = [chain.joints for detection in both for chain in detection.chains]
    frame = cropped(render(scene, row.sensor).frame, np.concatenate([*joints, np.zeros((0, 3))]))
    return with_caption(np.concatenate([draw(frame, detection) for detection in both], axis=1), tree_caption(row))


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


def tree_caption(row: TreeRow) -> str:
    """Return a caption for the picture of a row, in one line: its name and its faults, or that it is correct."""
    score = row.score
    faults = [
        f"{score.right} of {score.objects} objects right" if score.right < score.objects else "",
        f"{score.spurious} spurious objects" if score.spurious else "",
        f"{score.found} of {score.junctions} junctions found" if score.found < score.junctions else "",
        f"{score.false} false junctions" if score.false else "",
        f"{score.taken} of {score.crossings} crossings taken for junctions" if score.taken else "",
    ]
    return f"{row.name}   {row.error or '; '.join(filter(None, faults)) or 'correct'}   (detection left, truth right)"


def write_tree_pictures(folder: Path, rows: Sequence[TreeRow]) -> list[Path]:
    """Write a PNG for each row into a folder, which is made if necessary, and return the paths, in the order of the rows."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for row in rows:
        paths.append(folder / f"{row.name}.png")
        write_png(paths[-1], tree_picture(row))
    return paths
