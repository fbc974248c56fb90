"""Planar curves for cables to lie along: random smooth ones, where they cross, and how close they come."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from ...types import Bools, Floats, Ints

STEP = 0.002  # m between the points of a planar curve
COARSE = 3  # every so manieth point is looked at when candidates are tried


@dataclass(frozen=True)
class Crossings:
    """Where strands cross.

    first, second : (C,) fractional indices into the points, first < second. angles : (C,) radians between them, 0 to pi/2.
    """

    first: Floats
    second: Floats
    angles: Floats


def random_curves(rng: Generator, count: int, length: float, bend: float) -> Floats:
    """(count, P, 2) m: curves of random smooth curvature, never bent tighter than the radius `bend` in m."""
    points = round(length / STEP) + 1
    knots = max(4, round(length / rng.uniform(0.06, 0.14)))
    values = rng.normal(size=(knots, count)) * rng.uniform(1.0, 0.7 / bend, size=count)
    curvature = CubicSpline(np.linspace(0, 1, knots), values)(np.linspace(0, 1, points)).T
    curvature = np.tanh(curvature * bend / 0.95) * 0.95 / bend
    heading = np.cumsum(curvature * STEP, axis=1)
    steps = STEP * np.stack((np.cos(heading), np.sin(heading)), axis=-1)
    return np.asarray(np.cumsum(steps, axis=1))


def turned_flat(curve: Floats, angle: float) -> Floats:
    """(P, 2): the curve centred, its long side along x, then turned by `angle` in radians."""
    centred = curve - curve.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    flat = centred @ axes.T
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    flat = flat @ turn
    return np.asarray(flat - (flat.max(axis=0) + flat.min(axis=0)) / 2)


def find_crossings(points: Floats, strand: Ints) -> Crossings:
    """Every proper intersection of polylines.

    Parameters
    ----------
    points : (P, 2) m, the polylines one after the other. strand : (P,) int, which polyline a point belongs to.
    """
    start = np.flatnonzero(strand[1:] == strand[:-1])
    a, b = points[start], points[start + 1]
    d = b - a
    offset = a[None, :] - a[:, None]
    turn = d[:, None, 0] * d[None, :, 1] - d[:, None, 1] * d[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (offset[..., 0] * d[None, :, 1] - offset[..., 1] * d[None, :, 0]) / turn
        u = (offset[..., 0] * d[:, None, 1] - offset[..., 1] * d[:, None, 0]) / turn
    hit = (t >= 0) & (t < 1) & (u >= 0) & (u < 1) & (start[None, :] > start[:, None] + 1)
    i, j = np.nonzero(hit)
    size = np.linalg.norm(d, axis=1)
    angles = np.arcsin(np.clip(np.abs(turn[i, j]) / (size[i] * size[j]), 0, 1))
    return Crossings(start[i] + t[i, j], start[j] + u[i, j], angles)


def near_pairs(points: Floats, strand: Ints, reach: float, apart: float) -> tuple[Ints, Ints, Floats]:
    """Pairs of points nearer than `reach` that are not simply neighbours along one strand.

    Parameters
    ----------
    points : (P, D) m, STEP apart along each strand. strand : (P,) int.
    reach, apart : m; `apart` is the arc length from which points of one strand count as a pair.

    Returns
    -------
    i, j : (Q,) indices, i < j. distance : (Q,) m.
    """
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    i, j = pairs.min(axis=1), pairs.max(axis=1)
    pair = (strand[i] != strand[j]) | ((j - i) * STEP > apart)
    i, j = i[pair], j[pair]
    return i, j, np.linalg.norm(points[i] - points[j], axis=1)


def explained(i: Ints, j: Ints, crossings: Crossings, reach: float) -> Bools:
    """(Q,) bool: the pair of points i, j is near because its strands cross within `reach` in m of both."""
    if len(crossings.first) == 0:
        return np.zeros(len(i), dtype=bool)
    a = np.abs(i[:, None] - crossings.first[None, :])
    b = np.abs(j[:, None] - crossings.second[None, :])
    return np.asarray((np.maximum(a, b) * STEP < reach).any(axis=1))


def tidy(points: Floats, strand: Ints, clearance: float, min_angle: float = np.radians(32.0)) -> Crossings | None:
    """The crossings, when strands keep `clearance` in m everywhere else and cross clearly; None when they do not."""
    crossings = find_crossings(points[::COARSE], strand[::COARSE])
    crossings = Crossings(crossings.first * COARSE, crossings.second * COARSE, crossings.angles)
    if (crossings.angles < min_angle).any() or _crowded(points, strand, crossings, clearance):
        return None
    thin, apart = slice(None, None, COARSE), 1.6 * clearance
    i, j, _ = near_pairs(points[thin], strand[thin], clearance, apart / COARSE)
    if not explained(i * COARSE, j * COARSE, crossings, 2.5 * clearance).all():
        return None
    return find_crossings(points, strand) if len(crossings.first) else crossings


def _crowded(points: Floats, strand: Ints, crossings: Crossings, clearance: float) -> bool:
    """Crossings so near each other, or so near a tip, along a strand that nothing lies flat between them."""
    places = np.sort(np.concatenate((crossings.first, crossings.second)))
    tips = np.flatnonzero(np.diff(strand, prepend=-1, append=-1) != 0).astype(float)
    tip_gap = np.abs(places[:, None] - tips[None, :]).min(initial=np.inf)
    return bool((np.diff(places) * STEP < 1.5 * clearance).any() or tip_gap * STEP < 2.0 * clearance)
