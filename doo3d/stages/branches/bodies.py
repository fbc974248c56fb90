"""Decide where two strands pass each other in contact: two branches opposite each other on a trunk, or a crossing.

At a branch the axes meet at one depth. At a crossing they are one sum of radii apart, and both strands go on smoothly and keep
their radius.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...geometry.curves import Curves
from ...geometry.polyline import unit
from ...types import Floats
from .costs import BRANCH_COST, MISFIT_COST, TURN_COST
from .planar import planar_radius_change, planar_turn, radius_change
from .readings import Meeting
from .strands import ARM_RADII, MIN_ANGLE, SampledChain

SMOOTH_KINK = 0.1
"""Radians by which a strand that should continue smoothly may bend at a position without cost."""

CONTACT_RADII, PLANAR_CONTACT_RADII = 1.35, 0.65
"""Sums of radii between two axes up to which strands touch, in space, and in the image, where they must cross."""


def body_meetings(strands: Sequence[SampledChain], viewpoint: Floats | None) -> list[Meeting]:
    """Return the possible junctions where two strands pass each other in contact, away from their ends.

    strands : all strands. viewpoint : (3,) m, position of the camera; None in 2-D, and where it is unknown.

    Returns a meeting for each contact. Its gain is the cost of a crossing minus that of two opposite branches.
    """
    meetings = []
    for a, p, b, q in _nearest_samples(strands):
        first, second = strands[a], strands[b]
        points, at = (first.points[p], second.points[q]), (float(first.along[p]), float(second.along[q]))
        both = float(first.radii[p] + second.radii[q])
        if first.is_near_end(at[0], 2 * both) or second.is_near_end(at[1], 2 * both):
            continue
        apart = _distance(first, p, second, q) / both
        towards = None if viewpoint is None else unit(points[0] - viewpoint)
        if len(points[0]) == 3:
            crossing, branch = MISFIT_COST * max(0.0, 1 - apart), BRANCH_COST + MISFIT_COST * min(apart, 1.0)
            for strand, position in ((first, at[0]), (second, at[1])):
                crossing += MISFIT_COST * max(0.0, strand.kink(position, both, towards) - SMOOTH_KINK)
                crossing += MISFIT_COST * radius_change(strand, position)
        else:
            place = (first, at[0], second, at[1])
            crossing, branch = TURN_COST * planar_turn(*place) + MISFIT_COST * planar_radius_change(*place), BRANCH_COST
        weight = np.array([first.radii[p] ** 2, second.radii[q] ** 2])
        middle = (weight[0] * points[0] + weight[1] * points[1]) / weight.sum()
        meetings.append(Meeting(crossing - branch, middle, ((a, at[0]), (b, at[1]))))
    return meetings


def _distance(first: SampledChain, p: int, second: SampledChain, q: int) -> float:
    """Return how far apart two axes pass each other, m (px in 2-D), as straight lines at samples p and q, which lie near."""
    offset = first.points[p] - second.points[q]
    if len(offset) == 3:
        normal = np.cross(first.direction(p), second.direction(q))
        if np.linalg.norm(normal) > math.sin(MIN_ANGLE):
            return abs(float(offset @ unit(normal)))
    return float(np.linalg.norm(offset))


def _nearest_samples(strands: Sequence[SampledChain]) -> Iterator[tuple[int, int, int, int]]:
    """Yield (strand, sample, strand, sample) where axes come nearest to each other, one for each stretch of contact."""
    curves = Curves.of([strand.points for strand in strands])
    points, number, first = curves.points, curves.owner, curves.bounds
    radii = np.concatenate([strand.radii for strand in strands])
    along = np.concatenate([strand.along for strand in strands])
    factor = CONTACT_RADII if points.shape[1] == 3 else PLANAR_CONTACT_RADII
    pairs = cKDTree(points).query_pairs(2 * factor * float(radii.max()), output_type="ndarray")
    if not len(pairs):
        return
    a, b = pairs.min(axis=1), pairs.max(axis=1)
    distance = np.linalg.norm(points[a] - points[b], axis=1)
    own = (number[a] == number[b]) & (np.abs(along[a] - along[b]) < ARM_RADII[1] * radii[a])
    chosen = (distance < factor * (radii[a] + radii[b])) & ~own
    a, b, distance = a[chosen], b[chosen], distance[chosen]
    if not len(a):
        return
    places = cKDTree(np.column_stack((a, b, number[a] * 1e6, number[b] * 1e6))).query_pairs(6.0, output_type="ndarray")
    links = coo_matrix((np.ones(len(places)), places.T), (len(a), len(a)))
    count, group = connected_components(links, directed=False)
    order = np.lexsort((distance, group))
    for best in order[np.searchsorted(group[order], np.arange(count))].tolist():
        p, q = int(a[best]), int(b[best])
        yield int(number[p]), p - int(first[number[p]]), int(number[q]), q - int(first[number[q]])
