"""Build a scene of a harness of a given kind: plan, heights, tubes, boxes."""

import itertools
from bisect import bisect_right
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from ..model import Scene, Solid, Tree, Truth
from ..stacking import spline_axis
from ..studio import Studio, cable_color, make_studio
from .boxes import box_on_junction, wide_box
from .heights import are_clear, hanging_shape, lay
from .kinds import Kind
from .plan import TRUNK_RADII, Plan, plan_harness, plan_two
from .strands import add_touching
from .swaps import plan_swap

Size = tuple[int, int]
"""Width and height of the image, px."""


def harness(kind: Kind, rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one harness: a trunk with branches, each a tube whose axis begins on the trunk's axis.

    Parameters
    ----------
    kind
        numbers of branches and crossings, and further properties of the scene.
    rng
        the random number generator to draw from.
    size
        (width, height) px of the image.

    Returns
    -------
    The scene in the camera's optical frame, with a tree for each object; None if the draw cannot be built.
    """
    studio = make_studio(rng, size)
    radius = rng.uniform(*TRUNK_RADII)
    plan = _plan(rng, studio, radius, kind)
    if plan is None:
        return None
    strands, nodes, starts = plan.strands, plan.nodes, [*plan.starts]
    if kind.touching:
        starts.append(len(nodes))
        if not add_touching(rng, strands, nodes):
            return None
    if not lay(rng, strands, radius, kind):
        return None
    lift = hanging_shape(rng) if kind.hanging else None
    axes = []
    for strand in strands:
        points = np.column_stack((strand.curve, strand.height))
        if lift is not None:
            points[:, 2] += lift(points[:, :2])
        axes.append(spline_axis(points))
    if not all(studio.contains(axis) for axis in axes) or not are_clear(axes, strands, radius):
        return None
    at = np.zeros((len(nodes), 3))
    for strand, axis in zip(strands, axes, strict=True):
        at[list(strand.nodes)] = axis[[0, -1]]
    group = [bisect_right(starts, strand.nodes[0]) - 1 for strand in strands]
    colors = [cable_color(rng) for _ in starts] if kind.two else [cable_color(rng)] * len(starts)
    cables = tuple(
        Truth(studio.to_camera(axis), strand.radius, color=colors[k])
        for strand, axis, k in zip(strands, axes, group, strict=True)
    )
    boxes: tuple[Solid, ...] | None = ()
    if kind.hidden:
        boxes = wide_box(rng, studio, strands, axes, at) if kind.wide else box_on_junction(rng, studio, strands, at)
    if boxes is None:
        return None
    table = studio.table(-rng.uniform(0.08, 0.3)) if kind.hanging else studio.table()
    trees = []
    for k, (start, stop) in enumerate(itertools.pairwise([*starts, len(nodes)])):
        edges = [(n, strands[n].nodes[0] - start, strands[n].nodes[1] - start) for n in range(len(strands)) if group[n] == k]
        trees.append(Tree(studio.to_camera(at[start:stop]), tuple(edges)))
    return replace(studio.scene(cables, boxes, table), trees=tuple(trees))


def _plan(rng: Generator, studio: Studio, radius: float, kind: Kind) -> Plan | None:
    if kind.swapping:
        return plan_swap(rng, studio, radius)
    return plan_two(rng, studio, radius, kind) if kind.two else plan_harness(rng, studio, radius, kind)
