"""Build a scene of a harness of some kind: plan, heights, tubes, boxes."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ..model import Scene, Tree, Truth
from ..stacking import spline_axis
from ..studio import cable_color, make_studio
from .boxes import box_on_junction
from .heights import are_clear, hanging_shape, lay
from .kinds import Kind
from .plan import TRUNK_RADII, plan_harness
from .touching import add_touching

Size = tuple[int, int]
"""Width and height of the image, px."""


def harness(kind: Kind, rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one harness: a trunk with branches, each a tube whose axis begins on the trunk's axis.

    Parameters
    ----------
    kind
        number of branches and crossings, and what else is in the scene.
    rng
        the random number generator to draw from.
    size
        (width, height) px of the image.

    Returns
    -------
    The scene in the camera's optical frame, with one tree (two with a touching cable); None if the draw cannot be built.
    """
    studio = make_studio(rng, size)
    radius = rng.uniform(*TRUNK_RADII)
    strands, nodes = plan_harness(rng, studio, radius, kind)
    if not strands:
        return None
    count = len(nodes)
    if kind.touching and not add_touching(rng, strands, nodes):
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
    color = cable_color(rng)
    cables = tuple(Truth(studio.to_camera(axis), strand.radius, color=color) for strand, axis in zip(strands, axes, strict=True))
    boxes = box_on_junction(rng, studio, strands, at) if kind.hidden else ()
    table = studio.table(-rng.uniform(0.08, 0.3)) if kind.hanging else studio.table()
    edges = [(k, *strand.nodes) for k, strand in enumerate(strands)]
    trees = [Tree(studio.to_camera(at[:count]), tuple(edge for edge in edges if edge[1] < count))]
    if kind.touching:
        trees.append(Tree(studio.to_camera(at[count:]), ((edges[-1][0], 0, 1),)))
    return Scene("", "", 0, studio.camera, cables, boxes, table, studio.light, trees=tuple(trees))
