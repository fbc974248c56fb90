"""Draw random smooth curves in the plane for cables, and find their crossings and the clearance of their strands."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from ...types import Bools, Floats, Ints

STEP = 0.002
"""Distance in m between the points of a planar curve."""

COARSE_STRIDE = 3
"""Stride of the points in the first, coarse test for crossings, for speed."""


@dataclass(frozen=True)
class CurveCrossings:
    """The C places where planar curves cross themselves or each other.

    Attributes
    ----------
    first, second
        (C,) positions of the crossing on the two pieces of curve that meet there, as fractional indices into the points of all
        curves (2.5 is halfway from point 2 to point 3); first < second.
    angles
        (C,) radians between the two pieces, 0 to pi/2.
    """

    first: Floats
    second: Floats
    angles: Floats


def random_curves(rng: Generator, count: int, length: float, min_radius: float) -> Floats:
    """Draw planar curves of random, smoothly changing curvature: (count, P, 2) m, P points each, 2 mm apart.

    Each curve starts near the origin, and may cross itself.

    Parameters
    ----------
    rng
        the random number generator to draw from.
    count
        number of curves.
    length
        length of each curve, m.
    min_radius
        least radius of curvature, m.
    """
    points = round(length / STEP) + 1
    knots = max(4, round(length / rng.uniform(0.06, 0.14)))
    values = rng.normal(size=(knots, count)) * rng.uniform(1.0, 0.7 / min_radius, size=count)
    curvature = CubicSpline(np.linspace(0, 1, knots), values)(np.linspace(0, 1, points)).T
    curvature = np.tanh(curvature * min_radius / 0.95) * 0.95 / min_radius
    angle = np.cumsum(curvature * STEP, axis=1)
    steps = STEP * np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    return np.asarray(np.cumsum(steps, axis=1))


def resample_polyline(points: Floats, step: float) -> Floats:
    """Return evenly spaced points along a planar polyline, (Q, 2) m, beginning with its first point.

    The last point of the polyline is left out.

    Parameters
    ----------
    points
        (P, 2) m, the polyline.
    step
        distance along the polyline from one returned point to the next, m.
    """
    arcs = arcs_of(points)
    even_arcs = np.arange(0, arcs[-1], step)
    return np.column_stack((np.interp(even_arcs, arcs, points[:, 0]), np.interp(even_arcs, arcs, points[:, 1])))


def oriented_curve(curve: Floats, angle: float) -> Floats:
    """Rotate a planar curve of P points to a given angle, and center its bounding box at the origin: (P, 2) m.

    The curve may be mirrored, too.

    Parameters
    ----------
    curve
        (P, 2) m.
    angle
        radians from the x axis to the longest principal axis, positive towards y.
    """
    centered = curve - curve.mean(axis=0)
    _, _, axes = np.linalg.svd(centered, full_matrices=False)
    aligned = centered @ axes.T
    return turned_curve(aligned, angle)


def rotation(angle: float) -> Floats:
    """Return the matrix (2, 2) that turns row vectors by an angle, radians counter-clockwise."""
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def turned_curve(curve: Floats, angle: float) -> Floats:
    """Return a planar curve (P, 2) turned by an angle in radians, with its bounding box centered at the origin."""
    turned = curve @ rotation(angle)
    return np.asarray(turned - (turned.max(axis=0) + turned.min(axis=0)) / 2)


def headed_curve(curve: Floats, angle: float, step: int = 4) -> Floats:
    """Move a planar curve (P, 2) m to start at the origin, and rotate its first `step` steps to an angle in radians."""
    curve = curve - curve[0]
    return np.asarray(curve @ rotation(angle - np.arctan2(curve[step, 1], curve[step, 0])))


def offset_curve(curve: Floats, offset: Floats) -> Floats:
    """Return the points (P, 2) m at offsets (P,) m to the left of a planar curve."""
    tangent = np.gradient(curve, axis=0)
    normal = np.column_stack((-tangent[:, 1], tangent[:, 0])) / np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.asarray(curve + offset[:, None] * normal)


def arcs_of(points: Floats) -> Floats:
    """Return the arc length from the first point of a polyline (P, D) m to each point, (P,) m."""
    return np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))


def curve_crossings(points: Floats, strand: Ints | None = None) -> CurveCrossings:
    """Return every place where planar polylines cross themselves or each other.

    Parameters
    ----------
    points
        (P, 2) m, the points of all polylines one after the other.
    strand
        (P,) int, index of the polyline that each point belongs to; None for one polyline.

    Returns
    -------
    CurveCrossings
        sorted by `first`; of length 0 if there are none.
    """
    start = np.arange(len(points) - 1) if strand is None else np.flatnonzero(strand[1:] == strand[:-1])
    a, b = points[start], points[start + 1]
    d = b - a
    offset = a[None, :] - a[:, None]
    determinant = d[:, None, 0] * d[None, :, 1] - d[:, None, 1] * d[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (offset[..., 0] * d[None, :, 1] - offset[..., 1] * d[None, :, 0]) / determinant
        u = (offset[..., 0] * d[:, None, 1] - offset[..., 1] * d[:, None, 0]) / determinant
    hit = (t >= 0) & (t < 1) & (u >= 0) & (u < 1) & (start[None, :] > start[:, None] + 1)
    i, j = np.nonzero(hit)
    size = np.linalg.norm(d, axis=1)
    angles = np.arcsin(np.clip(np.abs(determinant[i, j]) / (size[i] * size[j]), 0, 1))
    return CurveCrossings(start[i] + t[i, j], start[j] + u[i, j], angles)


def near_pairs(points: Floats, strand: Ints, max_distance: float, min_arc: float) -> tuple[Ints, Ints, Floats]:
    """Return the Q pairs of points that are near each other, except for neighbors along one polyline.

    Parameters
    ----------
    points
        (P, D) m, the points of all polylines one after the other, 2 mm apart.
    strand
        (P,) int, index of the polyline that each point belongs to.
    max_distance
        greatest distance between the points of a pair, m.
    min_arc
        arc length in m by which two points of the same polyline must be apart to be a pair.

    Returns
    -------
    i, j : (Q,) indices of the points of each pair, i < j.
    distance : (Q,) m, between the points.
    """
    pairs = cKDTree(points).query_pairs(max_distance, output_type="ndarray")
    i, j = pairs.min(axis=1), pairs.max(axis=1)
    counts = (strand[i] != strand[j]) | ((j - i) * STEP > min_arc)
    i, j = i[counts], j[counts]
    return i, j, np.linalg.norm(points[i] - points[j], axis=1)


def near_crossing(i: Ints, j: Ints, crossings: CurveCrossings, max_arc: float) -> Bools:
    """Return which of Q pairs of points are near each other because their curves cross there, (Q,) bool.

    Parameters
    ----------
    i, j
        (Q,) indices of the points of each pair, i < j, as from `near_pairs`.
    crossings
        the crossings of the same curves; none gives False for all pairs.
    max_arc
        arc length in m; a pair is at a crossing if both of its points are within this length of the crossing.
    """
    if len(crossings.first) == 0:
        return np.zeros(len(i), dtype=bool)
    a = np.abs(i[:, None] - crossings.first[None, :])
    b = np.abs(j[:, None] - crossings.second[None, :])
    return np.asarray((np.maximum(a, b) * STEP < max_arc).any(axis=1))


def clear_crossings(points: Floats, strand: Ints, clearance: float, min_angle: float = np.radians(32.0)) -> CurveCrossings | None:
    """Return the crossings of curves if cables can lie along these curves, else None.

    The result is None if curves cross at an angle below `min_angle`, if a crossing is too near to another one or to a tip along a
    curve (about 1.5 to 2 clearances), or if curves come nearer to each other than `clearance` without crossing.

    Parameters
    ----------
    points
        (P, 2) m, the points of all curves one after the other, 2 mm apart.
    strand
        (P,) int, index of the curve that each point belongs to.
    clearance
        least distance between curves away from their crossings, m.
    min_angle
        least angle between curves that cross, radians.
    """
    crossings = curve_crossings(points[::COARSE_STRIDE], strand[::COARSE_STRIDE])
    crossings = CurveCrossings(crossings.first * COARSE_STRIDE, crossings.second * COARSE_STRIDE, crossings.angles)
    if (crossings.angles < min_angle).any() or _are_crowded(points, strand, crossings, clearance):
        return None
    coarse, min_arc = slice(None, None, COARSE_STRIDE), 1.6 * clearance
    i, j, _ = near_pairs(points[coarse], strand[coarse], clearance, min_arc / COARSE_STRIDE)
    if not near_crossing(i * COARSE_STRIDE, j * COARSE_STRIDE, crossings, 2.5 * clearance).all():
        return None
    return curve_crossings(points, strand) if len(crossings.first) else crossings


def _are_crowded(points: Floats, strand: Ints, crossings: CurveCrossings, clearance: float) -> bool:
    """Return whether crossings are too near to each other or to a tip for the strand to reach the table in between."""
    indices = np.sort(np.concatenate((crossings.first, crossings.second)))
    tips = np.flatnonzero(np.diff(strand, prepend=-1, append=-1) != 0).astype(float)
    tip_gap = np.abs(indices[:, None] - tips[None, :]).min(initial=np.inf)
    return bool((np.diff(indices) * STEP < 1.5 * clearance).any() or tip_gap * STEP < 2.0 * clearance)
