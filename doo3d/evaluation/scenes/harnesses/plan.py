"""Draw a harness in the plane: a trunk, and branches that leave it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from numpy.random import Generator

from ....types import Floats
from ..curves import STEP, oriented_curve, random_curves
from ..studio import Studio
from .strands import Strand, crossings_of, is_open

if TYPE_CHECKING:
    from .kinds import Kind

TRUNK_RADII, BRANCH_RATIOS = (0.004, 0.007), (0.5, 0.8)
"""m, radius of a trunk; radius of a branch as a fraction of that."""

TRUNK_LENGTHS, BRANCH_LENGTHS = (0.42, 0.75), (0.10, 0.24)
"""m."""

LEAVING_DEGREES = (35.0, 85.0)
"""Degrees between a branch and the trunk where the branch leaves."""

MIN_SPACING_RADII = 14.0
"""Radii of the trunk between two junctions, and from a junction to a tip of the trunk."""


def plan_harness(rng: Generator, studio: Studio, radius: float, kind: Kind) -> tuple[list[Strand], list[Floats]]:
    """Draw trunk and branches in the plane; returns no strands if they do not fit or cross too often."""
    wanted = int(rng.integers(kind.branches[0], kind.branches[1] + 1))
    usable = np.array(studio.usable_size())
    for _ in range(30):
        length = rng.uniform(*TRUNK_LENGTHS)
        trunk = oriented_curve(random_curves(rng, 1, length, 0.05)[0], rng.uniform(-0.4, 0.4))
        if (np.ptp(trunk, axis=0) > usable).any():
            continue
        trunk = trunk + rng.uniform(-0.4, 0.4, size=2) * (usable - np.ptp(trunk, axis=0))
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
            heading = trunk[min(index + 4, len(trunk) - 1)] - trunk[index - 4]
            angle = np.arctan2(heading[1], heading[0]) + side * np.radians(rng.uniform(*LEAVING_DEGREES))
            curve = random_curves(rng, 1, rng.uniform(*BRANCH_LENGTHS) * (1.5 if kind.crossings[1] else 1), 0.03)[0]
            curve = curve - curve[0]
            first = curve[4]
            turn = angle - np.arctan2(first[1], first[0])
            curve = curve @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + trunk[index]
            nodes.append(curve[-1])
            strands.append(strand_on_table(curve, thin, (1 + stations.index(index), len(nodes) - 1), radius))
        points = np.vstack([strand.curve for strand in strands])
        inside = (np.abs(points) < usable / 2).all()
        if inside and kind.crossings[0] <= len(crossings_of(strands)) <= kind.crossings[1] and is_open(strands, radius):
            return strands, nodes
    return [], []


def strand_on_table(curve: Floats, radius: float, nodes: tuple[int, int], trunk_radius: float, trunk: bool = False) -> Strand:
    """Return a strand that lies on the table, and rises to the trunk's axis at its first point."""
    along = np.arange(len(curve)) * STEP / (8 * trunk_radius)
    rise = np.clip(1 - along, 0, 1)
    height = np.full(len(curve), radius) + (trunk_radius - radius) * rise**2 * (3 - 2 * rise)
    return Strand(curve, radius, nodes, height, trunk)


def branch_points(rng: Generator, count: int, wanted: int, radius: float, kind: Kind) -> list[int] | None:
    """Return the index of the trunk point where each branch leaves; with `opposite` the first two at one place."""
    least = MIN_SPACING_RADII * radius / STEP
    places = wanted - 1 if kind.opposite else wanted
    for _ in range(20):
        at = np.sort(rng.uniform(least, count - 1 - least, size=places))
        if places == 1 or np.diff(at).min() > least:
            chosen = [int(value) for value in rng.permutation(at)]
            return [chosen[0], *chosen] if kind.opposite else chosen
    return None
