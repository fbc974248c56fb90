"""Planar curves laid on a table: heights at which strands rest on the table and on each other without touching through."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, vstack
from scipy.spatial import cKDTree

from ...types import Bools, Floats, Ints
from .curves import STEP, Crossings, near_pairs

SPACING = 0.0005  # m between the points of a true axis
CONTACT = 2.04  # radii between the axes of strands that lie on each other: 2 and a little for the sampling
VERTICAL_BEND = 10.0  # radii, tightest bend up or down


def heights(points: Floats, strand: Ints, crossings: Crossings, over: Bools, radius: float) -> Floats | None:
    """(P,) m above the table: the lowest axis that keeps strands apart, bends gently and stays a radius up.

    A linear programme: least sum of heights; where strands come nearer than their thickness in the plane, the
    upper one keeps the rest of the distance above the lower one; the second difference is bounded.

    Parameters
    ----------
    points : (P, 2) m, STEP apart. strand : (P,) int. over : (C,) bool, the first strand of the crossing is the upper.

    Returns
    -------
    None when no such heights exist (crossings too near each other).
    """
    if len(crossings.first) == 0:
        return np.full(len(points), radius)
    contact, apart = _contacts(points, strand, crossings, over, radius)
    bend = _second_difference(strand)
    most = np.full(bend.shape[0], STEP**2 / (VERTICAL_BEND * radius))
    limits: Any = vstack((contact, bend, -bend))
    found = linprog(np.ones(len(points)), limits, np.concatenate((-apart, most, most)), bounds=(radius, None), method="highs")
    return np.asarray(found.x) if found.status == 0 else None


def _contacts(points: Floats, strand: Ints, crossings: Crossings, over: Bools, radius: float) -> tuple[csr_matrix, Floats]:
    """Rows that give lower minus upper height, and (Q,) m that the upper has to be above: near pairs, thin crossings."""
    i, j, gap = near_pairs(points, strand, CONTACT * radius, 6 * radius)
    nearest = np.maximum(np.abs(i[:, None] - crossings.first), np.abs(j[:, None] - crossings.second)).argmin(axis=1)
    upper, lower = np.where(over[nearest], i, j), np.where(over[nearest], j, i)
    apart = np.sqrt((CONTACT * radius) ** 2 - gap**2)
    rows, ones = np.arange(len(i)), np.ones(len(i))
    contact = csr_matrix((np.r_[-ones, ones], (np.r_[rows, rows], np.r_[upper, lower])), (len(i), len(points)))
    if radius >= STEP:
        return contact, apart
    # a cable thinner than the steps is missed by pairs of points: hold it apart where the lines themselves cross
    top = np.where(over, crossings.first, crossings.second)
    bottom = np.where(over, crossings.second, crossings.first)
    exact = _between(bottom, len(points)) - _between(top, len(points))
    return vstack((contact, exact)).tocsr(), np.r_[apart, np.full(len(top), CONTACT * radius)]


def _between(index: Floats, count: int) -> csr_matrix:
    """(Q, count): rows that interpolate at fractional indices."""
    whole, part, rows = index.astype(int), index % 1, np.arange(len(index))
    return csr_matrix((np.r_[1 - part, part], (np.r_[rows, rows], np.r_[whole, whole + 1])), (len(index), count))


def _second_difference(strand: Ints) -> csr_matrix:
    middle = np.flatnonzero((strand[2:] == strand[1:-1]) & (strand[1:-1] == strand[:-2])) + 1
    rows = np.arange(len(middle))
    values = np.r_[np.ones(len(middle)), np.full(len(middle), -2.0), np.ones(len(middle))]
    places = (np.r_[rows, rows, rows], np.r_[middle - 1, middle, middle + 1])
    return csr_matrix((values, places), (len(middle), len(strand)))


def resampled(points: Floats, spacing: float = SPACING, closed: bool = False) -> Floats:
    """(Q, D): a smooth curve through the points, sampled at equal arc length of at most `spacing` in m."""
    if closed:
        points = np.vstack((points, points[:1]))
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    spline = CubicSpline(along, points, bc_type="periodic" if closed else "not-a-knot")
    fine = spline(np.linspace(0, along[-1], 4 * len(points)))
    arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))))
    at = np.linspace(0, arc[-1], int(np.ceil(arc[-1] / spacing)) + 1)
    result = spline(np.interp(at, arc, np.linspace(0, along[-1], len(fine))))
    return np.asarray(result[:-1] if closed else result)


def lowest_clearance(axes: list[Floats], radius: float) -> float:
    """The least distance between two strands' axes, in diameters, over all cables (the cap of a search at 2 diameters).

    Points of one axis within 6 radii of arc are one strand. Axes are (P, 3) m, SPACING apart.
    """
    points = np.vstack(axes)
    strand = np.repeat(np.arange(len(axes)), [len(axis) for axis in axes])
    pairs = cKDTree(points).query_pairs(4 * radius, output_type="ndarray")
    if len(pairs) == 0:
        return 2.0
    far = (strand[pairs[:, 0]] != strand[pairs[:, 1]]) | (np.abs(pairs[:, 0] - pairs[:, 1]) * SPACING > 6 * radius)
    gap = np.linalg.norm(points[pairs[far, 0]] - points[pairs[far, 1]], axis=1)
    return float(gap.min(initial=4 * radius)) / (2 * radius)


def least_bend(axis: Floats) -> float:
    """Least radius of curvature in m of an axis (P, 3) of equal steps, over 8 steps so that rounding does not show."""
    step = 8
    first, second = axis[step:-step] - axis[: -2 * step], axis[2 * step :] - axis[step:-step]
    size = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    turn = np.arccos(np.clip(np.einsum("ij,ij->i", first, second) / size, -1, 1))
    return float(np.sqrt(size).mean() / max(float(turn.max()), 1e-9))
