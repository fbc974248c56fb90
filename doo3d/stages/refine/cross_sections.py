"""The cross-sections of a cylinder at samples along its axis: its surface points there, and the circle they lie on.

A camera sees half a shell: its points lie in front of the axis, pi / 4 of a radius in the mean. In the plane square to
the axis a point with the lateral offset u from the axis lies sqrt(r^2 - u^2) in front of it. All functions work on S samples
along all paths of a frame; `path` (S,) int is the path of each, and estimates are pooled over `window_half` samples of the same
path on either side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...geometry.polyline import perpendicular, unit
from ...kernels.nearest import nearest
from ...types import Array, Floats, Ints

MAX_SURFACE_POINTS = 10_000
"""Surface points that suffice to measure on; more are subsampled evenly."""

MIN_POINTS = 5
"""Points that a circle is fitted to at least."""

DEPTH_IMAGE_KURTOSIS, EVEN_SURFACE_KURTOSIS = 1.8, 1.5
"""Kurtosis of the lateral offsets of a half shell: points of a depth image, and points spread evenly over the surface."""

CENTRAL_PART = 0.8
"""Radii from the middle within which surface points measure the depth of the axis; farther out the surface falls away."""

GAUSS_NEWTON_STEPS = 8


@dataclass(frozen=True)
class SectionAxes:
    """Axes at S samples: tangent, lateral (square to the view) and depth (away from the sensor), each (S, D) unit.

    In 2-D there is no depth, and those vectors are zero.
    """

    tangent: Floats
    lateral: Floats
    depth: Floats


def section_axes(positions: Floats, tangent: Floats, viewpoint: Floats | None) -> SectionAxes:
    """Return the axes at samples seen from a viewpoint.

    Parameters
    ----------
    positions
        (S, 3) m.
    tangent
        (S, 3) unit.
    viewpoint
        (3,) m; None: any axes that turn little from one sample to the next.
    """
    if viewpoint is not None:
        lateral = unit(np.cross(positions - viewpoint, tangent))
        for bad in np.flatnonzero(~lateral.any(axis=1)):
            lateral[bad] = perpendicular(tangent[bad])
    else:
        lateral = np.empty_like(tangent)
        previous = perpendicular(tangent[0])
        for i, t in enumerate(tangent):
            side = previous - (previous @ t) * t
            previous = unit(side) if side @ side > 1e-12 else perpendicular(t)
            lateral[i] = previous
    return SectionAxes(tangent, lateral, np.cross(tangent, lateral))


def planar_axes(tangent: Floats) -> SectionAxes:
    """Return the axes at samples in an image, from tangents (S, 2)."""
    return SectionAxes(tangent, np.column_stack((-tangent[:, 1], tangent[:, 0])), np.zeros_like(tangent))


def window_sum(values: Array, path: Ints, window_half: int) -> Floats:
    """Return the sums of (S,) or (S, C) values over `window_half` samples on either side, within each path."""
    total = np.concatenate((np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)))
    index = np.arange(len(values))
    starts = np.concatenate(([0], np.flatnonzero(np.diff(path)) + 1))
    ends = np.concatenate((starts[1:], [len(values)]))
    run = np.searchsorted(starts, index, side="right") - 1
    low, high = np.maximum(index - window_half, starts[run]), np.minimum(index + window_half + 1, ends[run])
    return np.asarray(total[high] - total[low])


def thinned(points: Array) -> Array:
    """Return about MAX_SURFACE_POINTS of the points (N, C), evenly, always the same ones."""
    return np.ascontiguousarray(points[:: max(1, -(-len(points) // MAX_SURFACE_POINTS))])


@dataclass(frozen=True)
class CrossSections:
    """Surface points in the cross-sections of the samples they belong to.

    Attributes
    ----------
    sample
        (N,) int, the sample of each point.
    lateral, depth
        (N,) m, offset of the point from the sample along its axes.
    """

    sample: Ints
    lateral: Floats
    depth: Floats


def cross_sections(points: Floats, positions: Floats, axes: SectionAxes, reach: Floats) -> CrossSections:
    """Return each point in the cross-section of its nearest sample.

    Parameters
    ----------
    points
        (N, 3) m.
    positions
        (S, 3) m.
    axes
        at the samples.
    reach
        (S,) m; points farther from their sample are left out.
    """
    distance, near = nearest(points, positions, float(reach.max()), True)
    kept = distance < reach[near]
    near = near[kept]
    offset = points[kept] - positions[near]
    lateral, depth = (np.einsum("ij,ij->i", offset, axis[near]) for axis in (axes.lateral, axes.depth))
    return CrossSections(near, lateral, depth)


def axis_depth(sections: CrossSections, path: Ints, radius: Floats, window_half: int) -> tuple[Floats, Floats]:
    """Estimate how deep the axis lies behind samples that lie in the middle of the silhouette.

    The mean of depth + sqrt(r^2 - u^2) over the points with |u| < 0.8 r, without those that differ by more than three deviations.

    Returns
    -------
    depth : (S,) m along the depth axis from the sample.
    count : (S,) number of points it is estimated from.
    """
    good = np.abs(sections.lateral) < CENTRAL_PART * radius[sections.sample]
    sample = sections.sample[good]
    depth = sections.depth[good] + np.sqrt(radius[sample] ** 2 - sections.lateral[good] ** 2)
    samples = len(path)
    for last in (False, True):
        count = window_sum(np.bincount(sample, minlength=samples), path, window_half)
        total = window_sum(np.bincount(sample, weights=depth, minlength=samples), path, window_half)
        mean = total / np.maximum(count, 1e-9)
        if last or not len(sample):
            break
        residual = np.abs(depth - mean[sample])
        inside = residual <= max(4.5 * float(np.median(residual)), 1e-9)
        sample, depth = sample[inside], depth[inside]
    return mean, count


def fit_half_shell(sections: CrossSections, path: Ints, window_half: int) -> tuple[Floats, Floats, Floats]:
    """Fit a half shell to the lateral spread of the points of each cross-section.

    Points of a depth image lie evenly over the width: their lateral offsets have the variance r^2 / 3 and the kurtosis 1.8.
    Points that lie evenly on the surface, as a voxel filter leaves them, have r^2 / 2 and 1.5. The kurtosis of all points
    tells how far to go from one factor to the other.

    Returns
    -------
    middle : (S,) m, lateral offset of the shell's middle.
    radii : (S,) m; NaN where there are fewer than MIN_POINTS points.
    count : (S,) number of points.
    """

    def pooled(values: Floats) -> Floats:
        return window_sum(np.bincount(sections.sample, weights=values, minlength=len(path)), path, window_half)

    count = pooled(np.ones_like(sections.lateral))
    safe = np.maximum(count, 1e-9)
    middle = pooled(sections.lateral) / safe
    lateral = sections.lateral - middle[sections.sample]
    variance = pooled(lateral**2) / safe
    scaled = lateral / np.sqrt(np.maximum(variance, 1e-18))[sections.sample]
    kurtosis = float(np.mean(scaled**4)) if len(scaled) else DEPTH_IMAGE_KURTOSIS
    factor = float(np.clip(3 - (DEPTH_IMAGE_KURTOSIS - kurtosis) / 0.3, 2.0, 3.0))
    return middle, np.where(count >= MIN_POINTS, np.sqrt(factor * variance), np.nan), count


def is_seen_from(
    viewpoint: Floats, sections: CrossSections, path: Ints, positions: Floats, axes: SectionAxes, window_half: int
) -> bool:
    """Tell whether the points look like the half shells that are seen from a viewpoint (3,) m.

    The circle through each cross-section then has its center behind the points, as seen from there; the points of a
    whole tube have it in their middle.
    """
    center, radii, count = fit_circles(sections, path, None, window_half)
    mean = np.zeros_like(center)
    for column, values in enumerate((sections.lateral, sections.depth)):
        sums = np.bincount(sections.sample, weights=values, minlength=len(path))
        mean[:, column] = window_sum(sums, path, window_half) / np.maximum(count, 1e-9)
    good = (count >= MIN_POINTS) & np.isfinite(radii)
    behind = (center - mean)[good] / np.maximum(radii[good], 1e-9)[:, None]
    depth = behind[:, :1] * axes.lateral[good] + behind[:, 1:] * axes.depth[good]
    ray = unit(positions[good] - viewpoint)
    return bool(good.any()) and float(np.median(np.einsum("ij,ij->i", depth, ray))) > 0.4


def fit_circles(
    sections: CrossSections, path: Ints, radius: Floats | None, window_half: int, steps: int = GAUSS_NEWTON_STEPS
) -> tuple[Floats, Floats, Floats]:
    """Fit a circle to each cross-section: least squares of the distance to the circle, by Gauss-Newton.

    It starts from the algebraic fit of Kasa (1976), which alone makes the circles of short arcs too small.

    Parameters
    ----------
    sections
        the surface points.
    path
        (S,) int.
    radius
        (S,) m, of circles whose center alone is fitted; None: the radius is fitted too.
    window_half
        samples pooled on either side.
    steps
        of Gauss-Newton.

    Returns
    -------
    center : (S, 2) m, (lateral, depth) from the sample.
    radii : (S,) m; NaN where there are fewer than MIN_POINTS points.
    count : (S,) number of points.
    """
    samples, u, w, at = len(path), sections.lateral, sections.depth, sections.sample

    def pooled(values: Floats) -> Floats:
        return window_sum(np.bincount(at, weights=values, minlength=samples), path, window_half)

    count = pooled(np.ones_like(u))
    safe = np.maximum(count, 1e-9)
    center, algebraic = _kasa_fit(u, w, at, pooled, safe)
    radii = np.where(np.isfinite(algebraic), algebraic, 0.0) if radius is None else radius.copy()
    for _ in range(steps):
        du, dw = u - center[at, 0], w - center[at, 1]
        distance = np.maximum(np.hypot(du, dw), 1e-12)
        nu, nw, residual = du / distance, dw / distance, distance - radii[at]
        one = np.ones_like(nu) * (radius is None)
        rows = (nu, nw, one)
        matrix = np.stack([pooled(a * b) for a in rows for b in rows], -1).reshape(-1, 3, 3)
        matrix += 1e-3 * safe[:, None, None] * np.eye(3)
        step = np.linalg.solve(matrix, np.stack([pooled(a * residual) for a in rows], -1)[..., None])[..., 0]
        limit = np.maximum(radii, 1e-9) / 2
        center += np.clip(step[:, :2], -limit[:, None], limit[:, None])
        radii = radii + np.clip(step[:, 2], -limit, limit)
    radii[count < MIN_POINTS] = np.nan
    return center, radii, count


def _kasa_fit(u: Floats, w: Floats, at: Ints, pooled: Callable[[Floats], Floats], count: Floats) -> tuple[Floats, Floats]:
    """Return center (S, 2) and radius (S,) by least squares of u^2 + w^2 = 2 a u + 2 b w + c, about each sample's mean."""
    mean = np.column_stack((pooled(u), pooled(w))) / count[:, None]
    u, w = u - mean[at, 0], w - mean[at, 1]
    q = u * u + w * w
    uu, uw, ww, su, sw, n, uq, wq, sq = map(pooled, (u * u, u * w, w * w, u, w, np.ones_like(u), u * q, w * q, q))
    matrix = np.stack((uu, uw, su, uw, ww, sw, su, sw, n), -1).reshape(-1, 3, 3)
    spread = np.maximum(uu + ww, 1e-18)
    matrix += 1e-6 * spread[:, None, None] * np.diag((1.0, 1.0, 0.0))
    matrix[n < MIN_POINTS] = np.eye(3)
    a, b, c = np.linalg.solve(matrix, np.stack((uq, wq, sq), -1)[..., None])[..., 0].T
    radius = np.sqrt(np.maximum(c + (a * a + b * b) / 4, 0.0))
    radius[n < MIN_POINTS] = np.nan
    return np.where(n[:, None] < MIN_POINTS, mean, mean + np.column_stack((a, b)) / 2), radius
