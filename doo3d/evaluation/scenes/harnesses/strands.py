"""Check strands in the plane for crossings and clearance, and add a cable that only touches a strand."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree

from ....types import Floats
from ..curves import STEP, curve_crossings, headed_curve, random_curves
from ..studio import pick

CLEARANCE = 1.6
"""Least distance in the plane between two strands that do not cross, in sums of their radii."""

NEAR_JUNCTION_RADII = 7.0
"""Distance from a junction, in radii of the trunk, within which its strands may be near each other."""

MIN_CROSSING_ANGLE = np.radians(35.0)


@dataclass
class Strand:
    """A strand in the plane: P points (P, 2) m, 2 mm apart, radius, heights (P,) m, its two nodes, and whether it is a trunk."""

    curve: Floats
    radius: float
    nodes: tuple[int, int]
    height: Floats
    trunk: bool = False


def crossings_of(strands: list[Strand], min_angle: float = MIN_CROSSING_ANGLE) -> list[tuple[int, int, int, int]]:
    """Return the crossings of strands in the plane, except at junctions: (strand, its point, other strand, its point).

    A crossing at an angle below `min_angle` (radians) is (-1, 0, 0, 0).
    """
    points = np.vstack([strand.curve for strand in strands])
    number = np.repeat(np.arange(len(strands)), [len(strand.curve) for strand in strands])
    first = np.cumsum([0, *(len(strand.curve) for strand in strands)])
    found = curve_crossings(points, number)
    result = []
    for i, j, angle in zip(found.first, found.second, found.angles, strict=True):
        a, b = int(number[int(i)]), int(number[int(j)])
        p, q = int(i) - int(first[a]), int(j) - int(first[b])
        shared = set(strands[a].nodes) & set(strands[b].nodes)
        if a != b and shared and min(p, len(strands[a].curve) - p) < 6 and min(q, len(strands[b].curve) - q) < 6:
            continue
        result.append((a, p, b, q) if angle > min_angle else (-1, 0, 0, 0))
    return result


def cross_far_from_ends(strands: list[Strand], crossings: list[tuple[int, int, int, int]], radius: float) -> bool:
    """Return whether all crossings are far from junctions and tips; `radius` is that of the thickest strand, m."""
    reach = 2.5 * NEAR_JUNCTION_RADII * radius / STEP
    return all(min(p, len(strands[a].curve) - p, q, len(strands[b].curve) - q) >= reach for a, p, b, q in crossings)


def is_open(
    strands: list[Strand], radius: float, min_angle: float = MIN_CROSSING_ANGLE, beside: tuple[int, int] | None = None
) -> bool:
    """Return whether strands are near each other only at junctions and crossings, and cross far from junctions and tips.

    Parameters
    ----------
    strands
        the strands.
    radius
        radius of the thickest strand, m.
    min_angle
        least angle of a crossing, radians.
    beside
        indices of two strands, smaller first, that may run side by side.
    """
    crossings = crossings_of(strands, min_angle)
    if any(crossing[0] < 0 for crossing in crossings):
        return False
    if not cross_far_from_ends(strands, crossings, radius):
        return False
    for a, first in enumerate(strands):
        for b in range(a, len(strands)):
            if (a, b) == beside:
                continue
            second = strands[b]
            limit = CLEARANCE * (first.radius + second.radius)
            i, j = near_points(first.curve, second.curve, limit, limit if a == b else 0.0)
            for crossing in crossings:
                if (crossing[0], crossing[2]) == (a, b):
                    far = (np.abs(i - crossing[1]) > 3 * limit / STEP) | (np.abs(j - crossing[3]) > 3 * limit / STEP)
                    i, j = i[far], j[far]
            if a != b:
                for node in set(first.nodes) & set(second.nodes):
                    from_first = i if first.nodes[0] == node else len(first.curve) - 1 - i
                    from_second = j if second.nodes[0] == node else len(second.curve) - 1 - j
                    far = np.maximum(from_first, from_second) * STEP > NEAR_JUNCTION_RADII * radius
                    i, j = i[far], j[far]
            if len(i):
                return False
    return True


def near_points(first: Floats, second: Floats, limit: float, apart: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the index pairs of points nearer than `limit`; on one curve, only pairs more than 4 limits apart along it."""
    pairs = cKDTree(first).sparse_distance_matrix(cKDTree(second), limit, output_type="coo_matrix")
    i, j = pairs.row, pairs.col
    if apart:
        chosen = (j - i) * STEP > 4 * apart
        i, j = i[chosen], j[chosen]
    return i, j


def add_touching(rng: Generator, strands: list[Strand], nodes: list[Floats]) -> bool:
    """Add a separate cable whose tip touches a strand from the side; return False if there is no room."""
    radius = max(strand.radius for strand in strands)
    for _ in range(30):
        host = pick(rng, strands)
        reach = int(2.5 * NEAR_JUNCTION_RADII * radius / STEP)
        if len(host.curve) <= 2 * reach + 2:
            continue
        index = int(rng.integers(reach, len(host.curve) - reach))
        heading = host.curve[index + 2] - host.curve[index - 2]
        normal = rng.choice((-1, 1)) * np.array([-heading[1], heading[0]]) / np.linalg.norm(heading)
        thin = host.radius * rng.uniform(0.6, 1.0)
        gap = rng.uniform(0.0, 0.0006)
        flat = np.sqrt((host.radius + thin) ** 2 - (host.radius - thin) ** 2)
        curve = random_curves(rng, 1, rng.uniform(0.12, 0.22), 0.03)[0]
        angle = np.arctan2(normal[1], normal[0]) + rng.uniform(-0.5, 0.5)
        curve = headed_curve(curve, angle) + host.curve[index] + normal * (flat + gap)
        added = Strand(curve, thin, (len(nodes), len(nodes) + 1), np.full(len(curve), thin))
        limit = CLEARANCE * (radius + thin)
        clear = True
        for strand in strands:
            i, _ = near_points(curve, strand.curve, limit, 0.0)
            clear &= not len(i) or (strand is host and bool((i * STEP < 3 * limit).all()))
        if clear:
            strands.append(added)
            nodes.extend((curve[0], curve[-1]))
            return True
    return False
