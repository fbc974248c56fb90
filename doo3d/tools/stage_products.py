"""Convert the product of every stage to points and edges, for pictures, files and the viewer."""

import itertools
from collections.abc import Sequence
from functools import partial

import numpy as np

from ..pipeline import Stages
from ..scene.scene import Scene
from ..segment.working_picture import enlarged_points
from ..types import Array, Floats
from ..viz.palette import chain_color
from ..viz.stage_products import Product
from .explain import Explanation

PRUNED = (255, 50, 50)
VOXEL, SKELETON = (120, 190, 255), (255, 222, 60)
CONFIDENT, UNCERTAIN = (60, 220, 90), (255, 60, 60)
GRAY, WHITE = (150, 155, 165), (255, 255, 255)


def products(stages: Stages, explanation: Explanation) -> list[Product]:
    """Return the product of each stage as colored points and edges, in the order of the stages.

    The products are named "1-mask", "2-voxels", "3-skeleton", "4-branches", "5-segments", "6-pruned" (segments that pruning
    removed are red), "7-merges" (connections numbered, with their cost; green for confidence 1 to red for 0) and "8-chains"
    (junctions numbered). Points are in m (px of the picture in 2-D). The mask of a photograph that was scaled down may be larger
    than the picture by less than `Stages.scale` px.

    stages : the products of all stages of a frame. explanation : the explanation of the same frame, whose connections are
    numbered.
    """
    scene, at = stages.scene, partial(enlarged_points, scale=stages.observed.scale)
    mask = None if not scene.mask.size else scene.mask.repeat(stages.observed.scale, axis=0).repeat(stages.observed.scale, axis=1)
    pieces = [at(piece) for piece in stages.pruned.chains]
    return [
        Product("1-mask", at(scene.points), _point_colors(scene), mask=mask),
        _points("2-voxels", at(stages.graph.grid.centroids), VOXEL),
        _points("3-skeleton", at(stages.graph.skeleton.points), SKELETON),
        _lines("4-branches", [at(np.concatenate((path.points, path.points[: int(path.closed)]))) for path in stages.graph.paths]),
        _lines("5-segments", [at(chain) for chain in stages.fitted]),
        _pruned(pieces, explanation.pruned),
        _merges(pieces, explanation),
        _chains(stages),
    ]


def _chains(stages: Stages) -> Product:
    """Return the chains, with white points numbered "J0" at junctions."""
    product = _lines("8-chains", [enlarged_points(chain.joints, stages.observed.scale) for chain in stages.chains])
    if not stages.branched.junctions:
        return product
    at = enlarged_points(np.array([junction.position for junction in stages.branched.junctions]), stages.observed.scale)
    first = len(product.points)
    labels = {first + k: f"J{k}" for k in range(len(at))}
    points, colors = np.concatenate((product.points, at)), np.concatenate((product.colors, _uniform(len(at), WHITE)))
    return Product(product.name, points, colors, product.edges, labels=labels)


def merge_table(explanation: Explanation) -> str:
    """Return the connections of an explanation as a Markdown table, the cheapest first.

    Columns: number, ends, cost, terms of the cost, the cheapest alternative and its cost, confidence. `Choice` explains the unit
    of costs.
    """
    rows = ["| # | ends | cost | terms | next best | confidence |", "|---|---|---|---|---|---|"]
    for i, merge in enumerate(explanation.merges):
        terms = ", ".join(f"{name} {cost:.1f}" for name, cost in merge.chosen.terms.items() if round(cost, 1))
        runner_up = merge.runner_up
        best = f"{runner_up.ends[0]} - {runner_up.ends[1]}: {runner_up.cost:.1f}" if runner_up else "none"
        ends = " - ".join(merge.chosen.ends)
        rows.append(f"| {i + 1} | {ends} | {merge.chosen.cost:.1f} | {terms} | {best} | {merge.confidence:.2f} |")
    return "\n".join(rows)


def _point_colors(scene: Scene) -> Array:
    colors = scene.point_colors()
    return colors if len(colors) else _uniform(len(scene.points), GRAY)


def _uniform(count: int, color: Sequence[int]) -> Array:
    return np.tile(np.array(color, dtype=np.uint8), (count, 1))


def _points(name: str, points: Floats, color: Sequence[int]) -> Product:
    return Product(name, np.asarray(points, dtype=float), _uniform(len(points), color))


def _lines(name: str, lines: Sequence[Floats], colors: Sequence[Sequence[int]] | None = None) -> Product:
    """Return polylines (P, D) as one product, each with its color."""
    colors = colors or [chain_color(i) for i in range(len(lines))]
    if not lines:
        return Product(name, np.zeros((0, 3)), _uniform(0, GRAY))
    starts = np.cumsum([0, *(len(line) for line in lines)])
    edges = [np.column_stack((np.arange(a, b - 1), np.arange(a + 1, b))) for a, b in itertools.pairwise(starts)]
    per_point = [_uniform(len(line), color) for line, color in zip(lines, colors, strict=True)]
    return Product(name, np.concatenate(lines), np.concatenate(per_point), np.concatenate(edges))


def _pruned(pieces: Sequence[Floats], removed: Floats) -> Product:
    lines = [*pieces, *removed]
    colors: list[Sequence[int]] = [*(chain_color(i) for i in range(len(pieces))), *([PRUNED] * len(removed))]
    return _lines("6-pruned", lines, colors)


def _merges(pieces: Sequence[Floats], explanation: Explanation) -> Product:
    """Return the product of merging: the pieces in gray, and the numbered connections above them."""
    links = [merge.chosen.points for merge in explanation.merges]
    shades = [
        np.rint(m.confidence * np.array(CONFIDENT) + (1 - m.confidence) * np.array(UNCERTAIN)).astype(int).tolist()
        for m in explanation.merges
    ]
    product = _lines("7-merges", [*pieces, *links], [*([GRAY] * len(pieces)), *shades])
    first = sum(len(piece) for piece in pieces)
    labels = {first + 2 * i: f"{i + 1}: {merge.chosen.cost:.0f}" for i, merge in enumerate(explanation.merges)}
    return Product(product.name, product.points, product.colors, product.edges, labels=labels)
