"""Polylines and vectors in 2-D and 3-D: the arrays decide which."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import solveh_banded

from ..kernels import polyline as kernel
from ..types import Array, Floats

TINY = 1e-12


def unit(vectors: Array) -> Floats:
    """Return vectors (..., D) scaled to length 1; zero vectors stay zero."""
    vectors = np.asarray(vectors, dtype=float)
    if vectors.ndim <= 2:
        return np.asarray(kernel.unit(vectors) if vectors.ndim == 1 else kernel.unit_rows(vectors))
    norm = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(norm > 0, norm, 1.0))


def angle(a: Array, b: Array) -> Floats:
    """Return the angles (...) between vectors (..., D), radians in [0, pi]; pi / 2 where one is zero.

    By the half-angle form of Kahan, exact near 0 and pi where arccos loses digits.
    """
    a, b = unit(a), unit(b)
    return np.asarray(2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))


def steps(points: Floats, closed: bool = False) -> Floats:
    """Return the distances between consecutive points (P, D): (P - 1,), or (P,) where closed."""
    return np.asarray(kernel.steps(np.asarray(points, dtype=float), closed))


def arc_length(points: Floats) -> Floats:
    """Return the length (P,) along a polyline (P, D) from its first point to each."""
    return np.asarray(kernel.arc_length(points))


def resample(points: Floats, at: Array) -> Floats:
    """Return the points (S, D) of a polyline (P, D) at arc lengths (S,); beyond its ends, its end points."""
    along = kernel.arc_length(points)
    return np.column_stack([np.interp(at, along, column) for column in points.T])


def densify(points: Floats, spacing: float) -> Floats:
    """Return points of a polyline (P, D) at equal arc lengths, `spacing` apart or a little less, both ends included."""
    total = float(arc_length(points)[-1])
    return resample(points, np.linspace(0.0, total, max(2, math.ceil(total / spacing) + 1)))


def tangents(points: Floats, closed: bool = False) -> Floats:
    """Return the unit tangents (P, D) of a polyline (P, D) by central differences."""
    if closed:
        return unit(np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0))
    return unit(np.gradient(points, axis=0))


def moving_mean(points: Floats, half_width: int, closed: bool = False) -> Floats:
    """Return each point of a polyline as the mean of a window about it, which shrinks near free ends.

    Parameters
    ----------
    points
        (P, D)
    half_width
        points on either side; less where the polyline is short
    closed
        whether the last point is followed by the first

    Returns
    -------
    (P, D)
    """
    count = len(points)
    half_width = min(half_width, (count - 1) // 2)
    if half_width < 1:
        return points
    if closed:
        points = np.concatenate((points[-half_width:], points, points[:half_width]))
    means = np.asarray(kernel.moving_mean(points, half_width))
    return means[half_width:-half_width] if closed else means


def whittaker_smooth(values: Floats, weights: Floats, strength: float, order: int = 2) -> Floats:
    """Smooth a sequence of points by Whittaker's smoother (Eilers, Analytical Chemistry 75, 2003).

    The result x minimises sum (x - v)' W (x - v) + strength * sum |order-th difference of x|^2. Every point has a weight matrix
    of its own, so that a position may be measured across the object and not along it. Where weights are near zero the result is
    the smoothest connection. One banded system is solved.

    Parameters
    ----------
    values
        (P, D)
    weights
        (P, D, D), symmetric, not negative
    strength
        of the smoothing; 0 leaves the values as they are
    order
        of the difference that is kept small

    Returns
    -------
    (P, D)
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
    """Return a unit vector (D,) perpendicular to a unit vector (D,), always the same for the same direction."""
    axis = np.eye(len(direction))[np.argmin(np.abs(direction))]
    return unit(axis - direction * (axis @ direction))
