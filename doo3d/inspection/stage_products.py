"""Every stage's product as points and lines, for pictures, files and the viewer."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..pipeline import Stages
from ..types import Array, Chain, Floats, Foreground
from ..viz.palette import chain_color
from ..viz.stage_products import Product
from .explain import Explanation

PRUNED = (255, 50, 50)
VOXEL, BONE = (120, 190, 255), (255, 222, 60)
SURE, UNSURE = (60, 220, 90), (255, 60, 60)
DIM = (150, 155, 165)


def products(stages: Stages, explanation: Explanation) -> list[Product]:
    """What the stages made, in their order: mask, voxels, skeleton, branches, segments, segments after pruning with what went in
    red, merges with their order and cost, green where they are sure and red where not, and the chains.
    """
    foreground = stages.context.foreground
    return [
        Product("1-mask", foreground.points, _seen_colors(foreground), mask=foreground.mask),
        _dots("2-voxels", stages.context.grid.centroids, VOXEL),
        _dots("3-skeleton", stages.skeleton.points, BONE),
        _lines("4-branches", [np.concatenate((path.points, path.points[: int(path.closed)])) for path in stages.paths]),
        _lines("5-segments", [chain.joints for chain in stages.fitted]),
        _pruned(stages.pruned.chains, stages.pruned.removed),
        _merges(stages, explanation),
        _lines("8-chains", [chain.joints for chain in stages.chains]),
    ]


def merge_table(explanation: Explanation) -> str:
    """The merges in order with their costs, as Markdown."""
    rows = ["| # | ends | cost | terms | next best | sure |", "|---|---|---|---|---|---|"]
    for i, merge in enumerate(explanation.merges):
        terms = ", ".join(f"{name} {cost:.1f}" for name, cost in merge.chosen.terms.items() if round(cost, 1))
        other = merge.runner_up
        best = f"{other.ends[0]} - {other.ends[1]}: {other.cost:.1f}" if other else "none"
        ends = " - ".join(merge.chosen.ends)
        rows.append(f"| {i + 1} | {ends} | {merge.chosen.cost:.1f} | {terms} | {best} | {merge.confidence:.2f} |")
    return "\n".join(rows)


def _seen_colors(foreground: Foreground) -> Array:
    if foreground.color is None or foreground.pixels is None:
        return _plain(len(foreground.points), DIM)
    return foreground.color[foreground.pixels[:, 1], foreground.pixels[:, 0]]


def _plain(count: int, color: Sequence[int]) -> Array:
    return np.tile(np.array(color, dtype=np.uint8), (count, 1))


def _dots(name: str, points: Floats, color: Sequence[int]) -> Product:
    return Product(name, np.asarray(points, dtype=float), _plain(len(points), color))


def _lines(name: str, lines: Sequence[Floats], colors: Sequence[Sequence[int]] | None = None) -> Product:
    """Polylines (P, D), each in a colour of its own."""
    colors = colors or [chain_color(i) for i in range(len(lines))]
    if not lines:
        return Product(name, np.zeros((0, 3)), _plain(0, DIM))
    starts = np.cumsum([0, *(len(line) for line in lines)])
    edges = [np.column_stack((np.arange(a, b - 1), np.arange(a + 1, b))) for a, b in itertools.pairwise(starts)]
    painted = [_plain(len(line), color) for line, color in zip(lines, colors, strict=True)]
    return Product(name, np.concatenate(lines), np.concatenate(painted), np.concatenate(edges))


def _pruned(chains: list[Chain], gone: Floats) -> Product:
    lines = [*(chain.joints for chain in chains), *gone]
    colors: list[Sequence[int]] = [*(chain_color(i) for i in range(len(chains))), *([PRUNED] * len(gone))]
    return _lines("6-pruned", lines, colors)


def _merges(stages: Stages, explanation: Explanation) -> Product:
    """The pieces in grey, and the connections over them, numbered."""
    links = [merge.chosen.points for merge in explanation.merges]
    shades = [
        np.rint(m.confidence * np.array(SURE) + (1 - m.confidence) * np.array(UNSURE)).astype(int).tolist()
        for m in explanation.merges
    ]
    pieces = [chain.joints for chain in stages.pruned.chains]
    product = _lines("7-merges", [*pieces, *links], [*([DIM] * len(pieces)), *shades])
    first = sum(len(piece) for piece in pieces)
    labels = {first + 2 * i: f"{i + 1}: {merge.chosen.cost:.0f}" for i, merge in enumerate(explanation.merges)}
    return Product(product.name, product.points, product.colors, product.edges, labels=labels)
