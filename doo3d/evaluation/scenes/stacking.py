"""Compute the heights at which strands rest on a table and on each other without intersecting."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, vstack
from scipy.spatial import cKDTree

from ...types import Bools, Floats, Ints
from .curves import STEP, CurveCrossings, arcs_of, near_pairs

AXIS_SPACING = 0.0005
"""Distance in m between the points of a true axis."""

CONTACT_RADII = 2.04
"""Distance between the axes of strands on top of each other, in radii: 2, and a little for the sampling."""

OWN_ARC_RADII = 6.0
"""Length along a cable, in radii, within which its points cannot touch each other."""

MIN_VERTICAL_BEND_RADII = 10.0
"""Least bend radius up or down, in radii of the cable."""


def resting_heights(points: Floats, strand: Ints, crossings: CurveCrossings, over: Bools, radius: float) -> Floats | None:
    """Return the lowest heights at which cables rest on the table and on each other without intersecting.

    Parameters
    ----------
    points
        (P, 2) m, the points of all cables one after the other, 2 mm apart.
    strand
        (P,) int, index of the cable that each point belongs to.
    crossings
        where the cables cross in the plane.
    over
        (C,) bool, for each of the C crossings: True if the strand that comes first along the points is on top.
    radius
        radius of all cables, m.

    Returns
    -------
    (P,) m, height of the axis above the table at each point; None if there are no such heights, because crossings are too near
    each other.

    Notes
    -----
    The heights solve a linear program with the least sum of heights. Each point is at least a radius above the table. Where two
    pieces of cable are nearer in the plane than their thickness, the upper one is enough higher not to intersect the lower one.
    The second difference of the heights is bounded, so that bends up and down are gentle.
    """
    if len(crossings.first) == 0:
        return np.full(len(points), radius)
    contact, min_gap = _contacts(points, strand, crossings, over, radius)
    bend = _second_difference(strand)
    max_bend = np.full(bend.shape[0], STEP**2 / (MIN_VERTICAL_BEND_RADII * radius))
    limits: Any = vstack((contact, bend, -bend))
    bounds = np.concatenate((-min_gap, max_bend, max_bend))
    solution = linprog(np.ones(len(points)), limits, bounds, bounds=(radius, None), method="highs")
    return np.asarray(solution.x) if solution.status == 0 else None


def _contacts(points: Floats, strand: Ints, crossings: CurveCrossings, over: Bools, radius: float) -> tuple[csr_matrix, Floats]:
    """Return the contacts of strands, from near pairs of points and, for thin cables, from the crossings.

    Parameters
    ----------
    points, strand, crossings, over, radius
        the arguments of `resting_heights`.

    Returns
    -------
    rows : (Q, P), lower minus upper height.
    min_gap : (Q,) m by which the upper strand must be above the lower one.
    """
    i, j, distance = near_pairs(points, strand, CONTACT_RADII * radius, 6 * radius)
    nearest = np.maximum(np.abs(i[:, None] - crossings.first), np.abs(j[:, None] - crossings.second)).argmin(axis=1)
    upper, lower = np.where(over[nearest], i, j), np.where(over[nearest], j, i)
    min_gap = np.sqrt((CONTACT_RADII * radius) ** 2 - distance**2)
    rows, ones = np.arange(len(i)), np.ones(len(i))
    contact = csr_matrix((np.r_[-ones, ones], (np.r_[rows, rows], np.r_[upper, lower])), (len(i), len(points)))
    if radius >= STEP:
        return contact, min_gap
    # pairs of points miss a cable thinner than the steps: keep it apart where the lines themselves cross
    top = np.where(over, crossings.first, crossings.second)
    bottom = np.where(over, crossings.second, crossings.first)
    exact = _interpolation(bottom, len(points)) - _interpolation(top, len(points))
    return vstack((contact, exact)).tocsr(), np.r_[min_gap, np.full(len(top), CONTACT_RADII * radius)]


def _interpolation(index: Floats, count: int) -> csr_matrix:
    """Return a matrix (Q, count) that interpolates linearly at Q fractional indices."""
    whole, t, rows = index.astype(int), index % 1, np.arange(len(index))
    return csr_matrix((np.r_[1 - t, t], (np.r_[rows, rows], np.r_[whole, whole + 1])), (len(index), count))


def _second_difference(strand: Ints) -> csr_matrix:
    middle = np.flatnonzero((strand[2:] == strand[1:-1]) & (strand[1:-1] == strand[:-2])) + 1
    rows = np.arange(len(middle))
    values = np.r_[np.ones(len(middle)), np.full(len(middle), -2.0), np.ones(len(middle))]
    positions = (np.r_[rows, rows, rows], np.r_[middle - 1, middle, middle + 1])
    return csr_matrix((values, positions), (len(middle), len(strand)))


def spline_axis(points: Floats, spacing: float = AXIS_SPACING, closed: bool = False) -> Floats:
    """Return evenly spaced points on the cubic spline through given points, (Q, D) m.

    Parameters
    ----------
    points
        (P, D) m, P points.
    spacing
        greatest arc length from one returned point to the next, m.
    closed
        whether the curve is a ring, whose first point follows the last; it is repeated neither in `points` nor in the result.
    """
    if closed:
        points = np.vstack((points, points[:1]))
    chord_arcs = arcs_of(points)
    spline = CubicSpline(chord_arcs, points, bc_type="periodic" if closed else "not-a-knot")
    fine = spline(np.linspace(0, chord_arcs[-1], 4 * len(points)))
    arcs = arcs_of(fine)
    even_arcs = np.linspace(0, arcs[-1], int(np.ceil(arcs[-1] / spacing)) + 1)
    result = spline(np.interp(even_arcs, arcs, np.linspace(0, chord_arcs[-1], len(fine))))
    return np.asarray(result[:-1] if closed else result)


def min_clearance(axes: list[Floats], radii: Floats | float) -> float:
    """Return the least distance between the axes of strands in sums of their radii: 1 if they touch, 2 at most.

    Two parts of one cable count as two strands if they are more than 6 radii apart along it.

    Parameters
    ----------
    axes
        (P, 3) m for each cable, P points 0.5 mm apart.
    radii
        m, the radius of each cable, or of all.
    """
    points, counts = np.vstack(axes), [len(axis) for axis in axes]
    strand, radius = np.repeat(np.arange(len(axes)), counts), np.repeat(np.broadcast_to(radii, len(axes)), counts)
    i, j = cKDTree(points).query_pairs(4 * float(np.max(radii)), output_type="ndarray").T
    far = (strand[i] != strand[j]) | (np.abs(i - j) * AXIS_SPACING > OWN_ARC_RADII * radius[i])
    i, j = i[far], j[far]
    return float((np.linalg.norm(points[i] - points[j], axis=1) / (radius[i] + radius[j])).min(initial=2.0))


def min_bend_radius(axis: Floats) -> float:
    """Return the least radius of curvature in m along an axis, (P, 3) m, of P evenly spaced points.

    For a straight axis the result is huge but finite. The axis needs at least 17 points, because directions are taken over 8
    points.
    """
    step = 8
    first, second = axis[step:-step] - axis[: -2 * step], axis[2 * step :] - axis[step:-step]
    size = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    angle = np.arccos(np.clip(np.einsum("ij,ij->i", first, second) / size, -1, 1))
    return float(np.sqrt(size).mean() / max(float(angle.max()), 1e-9))
