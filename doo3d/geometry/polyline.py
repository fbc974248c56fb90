"""Compute with polylines and vectors in 2-D and 3-D, by the shape of the arrays."""

import math

import numpy as np

from .. import kernels
from ..types import Array, Floats

TINY = 1e-12
"""Tolerance for comparisons of unit vectors, above the rounding of float64."""

LEAST_WEIGHT = 1e-6
"""Weight of a point where the weights determine nothing, relative to the largest: rounding of float64, 1e-16, to the power
that keeps six digits of the result."""


def unit(vectors: Array) -> Floats:
    """Return vectors scaled to length 1; zero vectors stay zero.

    vectors : (..., D), one vector (D,) or an array of them. Returns float64 in the same shape.
    """
    vectors = np.asarray(vectors, dtype=float)
    norm = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(norm > 0, norm, 1.0))


def angle(a: Array, b: Array) -> Floats:
    """Return the angles between vectors in radians.

    a, b : (..., D) vectors of any length. Returns (...) in [0, pi]; pi / 2 if one of the two vectors is zero, 0 if both are.

    The half-angle form of Kahan is exact near 0 and pi, where arccos loses digits.
    """
    a, b = unit(a), unit(b)
    return np.asarray(2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))


def steps(points: Floats, closed: bool = False) -> Floats:
    """Return the distances between consecutive points of a polyline.

    points : (P, D). closed : True adds the distance from the last point to the first. Returns (P - 1,), or (P,) if closed.
    """
    points = np.asarray(points, dtype=float)
    step = (np.concatenate((points[1:], points[:1])) if closed else points[1:]) - (points if closed else points[:-1])
    return np.asarray(np.sqrt(np.einsum("nd,nd->n", step, step)))


def net_turns(points: Floats) -> float:
    """Return the number of full turns that a polyline (P, D) makes to one side; turns to opposite sides cancel."""
    along = np.pad(unit(np.diff(points, axis=0)), ((0, 0), (0, 3 - points.shape[1])))
    axis = unit(np.cross(along[:-1], along[1:]))
    return float(np.linalg.norm(angle(along[:-1], along[1:]) @ axis) / math.tau)


def arc_length(points: Floats) -> Floats:
    """Return the arc length from the first point of a polyline to each point, (P,).

    points : (P, D). The first value is 0.
    """
    return np.cumsum(np.append(np.zeros(min(len(points), 1)), steps(points)))


def resample(points: Floats, at: Array) -> Floats:
    """Return the points of a polyline at given arc lengths.

    Parameters
    ----------
    points
        (P, D), P >= 1 points.
    at
        (S,) arc lengths from the first point. Lengths below 0 or beyond the end give the end points.

    Returns
    -------
    (S, D), in the unit of the points.
    """
    along = arc_length(points)
    return np.column_stack([np.interp(at, along, values) for values in np.asarray(points).T])


def densify(points: Floats, spacing: float) -> Floats:
    """Return evenly spaced points along a polyline, both ends included.

    points : (P, D). spacing : largest arc length between neighboring points. Returns (Q, D), Q >= 2 points.
    """
    total = float(arc_length(points)[-1])
    return resample(points, np.linspace(0.0, total, max(2, math.ceil(total / spacing) + 1)))


def whittaker_smooth(values: Floats, weights: Floats, strength: float, order: int = 2) -> Floats:
    """Smooth a sequence of points by the Whittaker smoother.

    Each point has its own weight matrix, so that a position may count across the object but not along it. Where the weights
    are near zero the result is the smoothest connection of the points on either side (Eilers, Analytical Chemistry 75, 2003).

    Parameters
    ----------
    values
        (P, D), the P points.
    weights
        (P, D, D), weight matrix of each point, symmetric and positive semidefinite.
    strength
        weight of smoothness, in the unit of the weights; 0 leaves the points unchanged.
    order
        order of the differences that are penalized: 2 favors straight lines.

    Returns
    -------
    (P, D), the smoothed points; the given ones if there are no more than `order`.

    Notes
    -----
    With the values v and the weights W, the result x minimizes sum (x - v)' W (x - v) + strength * sum |order-th
    difference of x|^2. If the weights do not determine it, such as all zero, each point has LEAST_WEIGHT in addition.
    """
    values, weights = np.ascontiguousarray(values), np.ascontiguousarray(weights)
    try:
        return kernels.whittaker_smooth(values, weights, strength, order)
    except ValueError:
        least = LEAST_WEIGHT * (float(weights.max(initial=0)) + strength)
        return kernels.whittaker_smooth(values, weights + least * np.eye(values.shape[1]), strength, order)


def perpendicular(direction: Floats) -> Floats:
    """Return a unit vector perpendicular to a given one, the same for the same input.

    direction : (D,) unit vector, D = 2 or 3. Returns (D,).
    """
    axis = np.eye(len(direction))[np.argmin(np.abs(direction))]
    return unit(axis - direction * (axis @ direction))
