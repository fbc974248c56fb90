"""Draw a harness in the plane: a trunk, and branches that leave it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator

from ....types import Floats
from ..curves import COARSE_STRIDE, STEP, headed_curve, oriented_curve, random_curves, rotation
from ..studio import Studio
from .kinds import Kind
from .strands import Strand, cross_far_from_ends, crossings_of, is_open

TRUNK_RADII, BRANCH_RATIOS = (0.004, 0.007), (0.5, 0.8)
"""Least and greatest radius of a trunk in m, and radius of a branch as a fraction of the trunk's."""

TRUNK_LENGTHS, BRANCH_LENGTHS = (0.42, 0.75), (0.10, 0.24)
"""Least and greatest length of a trunk and of a branch, m."""

LEAVING_DEGREES = (35.0, 85.0)
"""Least and greatest angle in degrees between a branch and the trunk at their junction."""

MIN_SPACING_RADII = 14.0
"""Least distance between two junctions, and from a junction to a tip of the trunk, in radii of the trunk."""


@dataclass(frozen=True)
class Plan:
    """Objects in the plane.

    Attributes
    ----------
    strands
        their strands, object by object.
    nodes
        (2,) m each, the tips and junctions, object by object.
    starts
        index of the first node of each object.
    """

    strands: list[Strand]
    nodes: list[Floats]
    starts: list[int] = field(default_factory=lambda: [0])

    def with_object(self, other: Plan) -> Plan:
        """Return the plan with the objects of another one added."""
        first = len(self.nodes)
        moved = [replace(strand, nodes=(strand.nodes[0] + first, strand.nodes[1] + first)) for strand in other.strands]
        starts = [*self.starts, *(start + first for start in other.starts)]
        return Plan([*self.strands, *moved], [*self.nodes, *other.nodes], starts)


def plan_harness(rng: Generator, studio: Studio, radius: float, kind: Kind) -> Plan | None:
    """Draw the trunk and branches of a harness in the plane; None if they do not fit or cross too often."""
    wanted = int(rng.integers(kind.branches[0], kind.branches[1] + 1))
    usable = np.array(studio.usable_size())
    for _ in range(30):
        length = rng.uniform(*TRUNK_LENGTHS)
        trunk = oriented_curve(random_curves(rng, 1, length, 0.05)[0], rng.uniform(-0.4, 0.4))
        if (np.ptp(trunk, axis=0) > usable).any():
            continue
        trunk = trunk + studio.shift_in_view(rng, trunk)
        indices = branch_points(rng, len(trunk), wanted, radius, kind)
        if indices is None:
            continue
        stations = sorted(set(indices))
        nodes = [trunk[0], *(trunk[i] for i in stations), trunk[-1]]
        bounds = [0, *stations, len(trunk) - 1]
        strands = [strand_on_table(trunk[a : b + 1], radius, (k, k + 1), radius, trunk=True)
                   for k, (a, b) in enumerate(itertools.pairwise(bounds))]  # fmt: skip
        side = rng.choice((-1, 1))
        for index in indices:
            side = -side if kind.opposite or rng.random() < 0.5 else side
            thin = radius * rng.uniform(*BRANCH_RATIOS)
            curve = leaving_curve(rng, trunk, index, side, 1.5 if kind.crossings[1] else 1.0)
            nodes.append(curve[-1])
            strands.append(strand_on_table(curve, thin, (1 + stations.index(index), len(nodes) - 1), radius))
        points = np.vstack([strand.curve for strand in strands])
        inside = (np.abs(points) < usable / 2).all()
        if inside and kind.crossings[0] <= len(crossings_of(strands)) <= kind.crossings[1] and is_open(strands, radius):
            return Plan(strands, nodes)
    return None


def plan_two(rng: Generator, studio: Studio, radius: float, kind: Kind) -> Plan | None:
    """Draw two harnesses that cross each other as often as `kind` says, but not themselves; None if they do not fit."""
    single = replace(kind, crossings=(0, 0))
    first = plan_harness(rng, studio, radius, single)
    if first is None:
        return None
    usable = np.array(studio.usable_size())
    for _ in range(8):
        second = plan_harness(rng, studio, radius * rng.uniform(0.75, 1.0), single)
        for _ in range(40):
            moved = None if second is None else placed(rng, second, usable)
            if moved is None:
                continue
            plan = first.with_object(moved)
            coarse = [replace(strand, curve=strand.curve[::COARSE_STRIDE]) for strand in plan.strands]
            crossings = crossings_of(coarse)
            if not kind.crossings[0] <= len(crossings) <= kind.crossings[1] or min(crossings)[0] < 0:
                continue
            if cross_far_from_ends(coarse, crossings, radius / COARSE_STRIDE) and is_open(plan.strands, radius):
                return plan
    return None


def leaving_curve(rng: Generator, trunk: Floats, index: int, side: int, longer: float = 1.0) -> Floats:
    """Draw the curve of a branch, (P, 2) m.

    Parameters
    ----------
    rng
        the random number generator to draw from.
    trunk
        (Q, 2) m, the trunk.
    index
        index of the trunk point where the branch leaves.
    side
        1 to leave to the left of the trunk, -1 to the right.
    longer
        factor by which the usual length is multiplied.
    """
    heading = trunk[min(index + 4, len(trunk) - 1)] - trunk[index - 4]
    angle = np.arctan2(heading[1], heading[0]) + side * np.radians(rng.uniform(*LEAVING_DEGREES))
    curve = random_curves(rng, 1, rng.uniform(*BRANCH_LENGTHS) * longer, 0.03)[0]
    return np.asarray(headed_curve(curve, angle) + trunk[index])


def placed(rng: Generator, plan: Plan, usable: Floats) -> Plan | None:
    """Turn a plan and move it to a random place on the table; None if it does not fit."""
    points = np.vstack([strand.curve for strand in plan.strands])
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    turn = rotation(rng.uniform(-0.4, 0.4) - float(np.arctan2(axes[0, 1], axes[0, 0])))
    points = points @ turn
    low, high = points.min(axis=0), points.max(axis=0)
    room = usable - (high - low)
    if (room < 0).any():
        return None
    shift = rng.uniform(-0.45, 0.45, size=2) * room - (low + high) / 2
    strands = [replace(strand, curve=strand.curve @ turn + shift) for strand in plan.strands]
    return Plan(strands, [node @ turn + shift for node in plan.nodes], plan.starts)


def strand_on_table(curve: Floats, radius: float, nodes: tuple[int, int], trunk_radius: float, trunk: bool = False) -> Strand:
    """Return a strand that lies on the table, and rises to the trunk's axis at its first point."""
    along = np.arange(len(curve)) * STEP / (8 * trunk_radius)
    rise = np.clip(1 - along, 0, 1)
    height = np.full(len(curve), radius) + (trunk_radius - radius) * rise**2 * (3 - 2 * rise)
    return Strand(curve, radius, nodes, height, trunk)


def branch_points(rng: Generator, count: int, wanted: int, radius: float, kind: Kind) -> list[int] | None:
    """Draw the index of the trunk point where each branch leaves; with `kind.opposite`, the first two are equal."""
    least = MIN_SPACING_RADII * radius / STEP
    places = wanted - 1 if kind.opposite else wanted
    for _ in range(20):
        at = np.sort(rng.uniform(least, count - 1 - least, size=places))
        if places == 1 or np.diff(at).min() > least:
            chosen = [int(value) for value in rng.permutation(at)]
            return [chosen[0], *chosen] if kind.opposite else chosen
    return None
