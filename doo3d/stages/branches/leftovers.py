"""Separate branches of neighboring junctions that merging joined to each other, since no other ends were left there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...geometry.polyline import arc_length, resample, unit
from ...geometry.radii import STEP_RADII
from ...types import Floats
from .. import Assembly, FrameContext
from .clouds import Surface, bridged_place
from .costs import BRANCH_COST
from .strands import ARM_RADII, NODE_RADII

MIN_APART = 0.5
"""Smallest distance between the junctions of the two ends, in lengths of the gap between these: at one position the ends continue
each other."""


def part_leftovers(assemblies: Sequence[Assembly], context: FrameContext) -> list[Assembly]:
    """Separate the objects of a cloud at gaps whose two ends are more likely branches of other strands.

    Merging joins ends in pairs. At a junction of three ends one end is left over, and two such ends of neighboring junctions may
    be joined to each other. The join is removed if points connect both ends to another strand at a lower cost.

    Parameters
    ----------
    assemblies
        the pieces of each object in order, as merging joined them.
    context
        the data of the frame. Only clouds of surfaces without camera views are changed.

    Returns
    -------
    The objects in the same order; the parts of a separated object take its place.
    """
    surface = Surface.of(context)
    result = list(assemblies)
    if surface is None:
        return result
    kept: set[tuple[int, int]] = set()
    while True:
        gaps = [
            (cost, i, k)
            for i, assembly in enumerate(result)
            for k, cost in enumerate(assembly.costs)
            if not assembly.closed and (id(assembly), k) not in kept
        ]
        if not gaps:
            return result
        _, i, k = max(gaps)
        assembly = result[i]
        axes = [_axis(each, context.radius) for number, each in enumerate(result) if number != i]
        if assembly.costs[k] > _branching_cost(assembly, k, axes, surface, context.radius):
            result[i : i + 1] = [part for part in _parted(assembly, k) if _length(part) > NODE_RADII * context.radius]
        else:
            kept.add((id(assembly), k))


def _branching_cost(assembly: Assembly, gap: int, axes: Sequence[Floats], surface: Surface, radius: float) -> float:
    """Return the cost of two branches in place of a join; infinite if there are no two places where the ends branch off."""
    total, places = 0.0, []
    ends = assembly.pieces[gap], assembly.pieces[gap + 1][::-1]
    for piece in ends:
        along = arc_length(piece)
        tangent = unit(piece[-1] - resample(piece, np.array([max(0.0, along[-1] - ARM_RADII[1] * radius)]))[0])
        found = [(bridged_place(piece[-1], tangent, radius, axis, radius, surface), axis) for axis in axes]
        costs = [math.inf if place is None else place[1] for place, _ in found]
        if min(costs, default=math.inf) == math.inf:
            return math.inf
        place, axis = found[int(np.argmin(costs))]
        assert place is not None
        total += BRANCH_COST + place[1]
        places.append(axis[place[0]])
    apart, across = np.linalg.norm(places[0] - places[1]), np.linalg.norm(ends[0][-1] - ends[1][-1])
    return total if apart > MIN_APART * across else math.inf


def _axis(assembly: Assembly, radius: float) -> Floats:
    """Return samples along the pieces and gaps of an object, (S, D) m (px in 2-D)."""
    line = assembly.pieces[0]
    for piece, path in zip(assembly.pieces[1:], assembly.gap_paths, strict=False):
        line = np.concatenate((line, path.points(radius), piece))
    along = arc_length(line)
    at = np.linspace(0, along[-1], max(2, round(along[-1] / (STEP_RADII * radius)) + 1))
    return resample(line, at)


def _parted(assembly: Assembly, gap: int) -> tuple[Assembly, Assembly]:
    """Return the two parts of an object before and after one of its gaps."""
    first, last = slice(gap), slice(gap + 1, None)
    return (
        Assembly(assembly.pieces[: gap + 1], assembly.gap_paths[first], assembly.costs[first], False, assembly.confidence[first]),
        Assembly(assembly.pieces[gap + 1 :], assembly.gap_paths[last], assembly.costs[last], False, assembly.confidence[last]),
    )


def _length(assembly: Assembly) -> float:
    return sum(float(arc_length(piece)[-1]) for piece in assembly.pieces)
