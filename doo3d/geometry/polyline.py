"""Dimension-generic maths: D is 2 or 3, decided by the arrays."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import solveh_banded

from ..kernels import polyline as lines
from ..types import Array, Floats

TINY = 1e-12


def unit(vectors: Array) -> Floats:
    """(..., D) -> (..., D) of length 1; zero vectors stay zero."""
    vectors = np.asarray(vectors, dtype=float)
    if vectors.ndim <= 2:
        return np.asarray(lines.unit(vectors) if vectors.ndim == 1 else lines.unit_rows(vectors))
    norm = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(norm > 0, norm, 1.0))


def angle(a: Array, b: Array) -> Floats:
    """Angle between (..., D) and (..., D), radians in [0, pi]; pi / 2 where one is zero.

    By the half-angle form of Kahan, exact near 0 and pi where arccos loses digits.
    """
    a, b = unit(a), unit(b)
    return np.asarray(2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))


def steps(points: Floats, closed: bool = False) -> Floats:
    """(P, D) -> (P - 1,) distances between consecutive points ((P,) where closed)."""
    return np.asarray(lines.steps(np.asarray(points, dtype=float), closed))


def arc_length(points: Floats) -> Floats:
    """(P, D) -> (P,) length along the polyline from its first point."""
    return np.asarray(lines.arc_length(points))


def resample(points: Floats, at: Array) -> Floats:
    """Points of the polyline (P, D) at the arc lengths `at` (S,) -> (S, D); beyond its ends, its ends."""
    along = lines.arc_length(points)
    return np.column_stack([np.interp(at, along, column) for column in points.T])


def densify(points: Floats, spacing: float) -> Floats:
    """The polyline (P, D) as points at equal arc length, `spacing` apart or a little less; ends kept."""
    total = float(arc_length(points)[-1])
    return resample(points, np.linspace(0.0, total, max(2, math.ceil(total / spacing) + 1)))


def tangents(points: Floats, closed: bool = False) -> Floats:
    """(P, D) -> (P, D) unit tangents by central differences."""
    if closed:
        return unit(np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0))
    return unit(np.gradient(points, axis=0))


def moving_mean(points: Floats, half: int, closed: bool = False) -> Floats:
    """(P, D) with each point the mean of itself and `half` on either side; near free ends the window shrinks."""
    count = len(points)
    half = min(half, (count - 1) // 2)
    if half < 1:
        return points
    if closed:
        points = np.concatenate((points[-half:], points, points[:half]))
    means = np.asarray(lines.moving_mean(points, half))
    return means[half:-half] if closed else means


def whittaker_smooth(values: Floats, weights: Floats, strength: float, order: int = 2) -> Floats:
    """The sequence x (P, D) that minimises sum (x - v)' W (x - v) + strength * sum |order-th difference of x|^2.

    Whittaker's smoother (Eilers, Analytical Chemistry 75, 2003), with a weight matrix for every point so that a place
    may be known across the object and not along it. values : (P, D). weights : (P, D, D), symmetric, not negative.
    Where weights are near zero the result is the smoothest way across. One banded system.
    """
    count, dim = values.shape
    if count <= order or strength <= 0:
        return values
    difference = [(-1.0) ** (order - k) * math.comb(order, k) for k in range(order + 1)]
    bands = np.zeros((order * dim + 1, count * dim))
    for k in range(order + 1):
        row = np.zeros(count)
        for j in range(order + 1 - k):
            row[j + k : count - order + j + k] += strength * difference[j] * difference[j + k]
        bands[(order - k) * dim] = np.repeat(row, dim)
    for a in range(dim):
        for b in range(a, dim):
            bands[order * dim - (b - a), b::dim] += weights[:, a, b]
    right = np.einsum("pij,pj->pi", weights, values).ravel()
    return np.asarray(solveh_banded(bands, right)).reshape(count, dim)


def perpendicular(direction: Floats) -> Floats:
    """(D,) unit -> a (D,) unit vector square to it, always the same for the same direction."""
    axis = np.eye(len(direction))[np.argmin(np.abs(direction))]
    return unit(axis - direction * (axis @ direction))
