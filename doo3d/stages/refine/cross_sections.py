"""Where the axis of a cylinder lies, and how thick it is, from the part of its surface that was seen.

A camera sees half a shell: its points lie in front of the axis, pi / 4 of a radius in the mean. In the plane square to
the axis a point at the lateral place u from it has the depth -sqrt(r^2 - u^2) from it. All functions work on
stations: places (S, 3) m along all paths of a frame, close together, each with its tangent.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...geometry.polyline import perpendicular, unit
from ...kernels.nearest import lateral_sums, nearest
from ...types import Array, Camera, Floats, Ints

ENOUGH = 10_000
"""Points that suffice to measure on; more are thinned out evenly."""

PIXELS = 20_000
"""The same of the mask's pixels, whose number is the width of the object."""


GOLDEN = (1 + 5**0.5) / 2


@dataclass(frozen=True)
class Frames:
    """Axes at S stations: tangent, lateral (square to the view) and away (from the sensor, square to both), (S, 3) unit."""

    tangent: Floats
    lateral: Floats
    away: Floats


def frames_towards(places: Floats, tangent: Floats, viewpoint: Floats | None) -> Frames:
    """Axes at places (S, 3) with tangents (S, 3); without a viewpoint, any that turn little from one to the next."""
    if viewpoint is not None:
        lateral = unit(np.cross(places - viewpoint, tangent))
        for bad in np.flatnonzero(~lateral.any(axis=1)):
            lateral[bad] = perpendicular(tangent[bad])
    else:
        lateral = np.empty_like(tangent)
        previous = perpendicular(tangent[0])
        for i, t in enumerate(tangent):
            side = previous - (previous @ t) * t
            previous = unit(side) if side @ side > 1e-12 else perpendicular(t)
            lateral[i] = previous
    return Frames(tangent, lateral, np.cross(tangent, lateral))


def flat_frames(tangent: Floats) -> Frames:
    """Axes at stations in an image, from tangents (S, 2); there is no away."""
    return Frames(tangent, np.column_stack((-tangent[:, 1], tangent[:, 0])), np.zeros_like(tangent))


def window_sum(values: Array, path: Ints, half: int) -> Floats:
    """Sums of (S,) or (S, C) values over `half` stations on either side, within each path: path (S,) is its number."""
    total = np.concatenate((np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)))
    index = np.arange(len(values))
    starts = np.concatenate(([0], np.flatnonzero(np.diff(path)) + 1))
    ends = np.concatenate((starts[1:], [len(values)]))
    run = np.searchsorted(starts, index, side="right") - 1
    low, high = np.maximum(index - half, starts[run]), np.minimum(index + half + 1, ends[run])
    return np.asarray(total[high] - total[low])


@dataclass(frozen=True)
class Silhouette:
    """What the mask says at S stations: how far its middle lies aside, m, and half its width, m (px in 2-D)."""

    offset: Floats
    radius: Floats


def silhouette(
    places: Floats, frames: Frames, path: Ints, mask_pixels: Array, camera: Camera | None, reach: Floats, half: int
) -> Silhouette:
    """Middle and width of the mask across each station.

    Every pixel of the mask goes to the nearest station in the image. Their number over the length of the
    station's piece is the width, without bias from the pixel grid; the mean of their offsets is the middle. A metre
    sideways is a number of pixels that depends on the place in the image as well as on the depth.

    mask_pixels : (N, 2), (u, v). camera : None where the places are pixels. reach : (S,) m, pixels farther from a
    station do not belong to it.
    """
    pixels, across, scale = _in_image(places, frames, camera)
    some = on_lattice(mask_pixels).astype(float)
    share = len(mask_pixels) / max(1, len(some))
    reach = reach * np.abs(scale)
    distance, near = nearest(some, pixels, float(reach.max()), True)
    sums = lateral_sums(some, distance, near, pixels, across, reach)
    count, total = (window_sum(share * each, path, half) for each in sums)
    radius = count / np.maximum(window_sum(_lengths(pixels, path), path, half), 1e-9) / np.abs(scale) / 2
    return Silhouette(total / np.maximum(count, 1e-9) / scale, radius)


def _in_image(places: Floats, frames: Frames, camera: Camera | None) -> tuple[Floats, Floats, Floats]:
    """Stations in the image: (S, 2) px, (S, 2) unit across the path, (S,) px per unit of `frames.lateral` along that, signed."""
    if camera is None:
        return places, frames.lateral, np.ones(len(places))
    step = 1e-4
    pixels = camera.project(places)
    along = unit(camera.project(places + step * frames.tangent) - pixels)
    across = np.column_stack((-along[:, 1], along[:, 0]))
    scale = np.einsum("ij,ij->i", camera.project(places + step * frames.lateral) - pixels, across) / step
    return pixels, across, np.where(np.abs(scale) > 1e-6, scale, 1e-6)


def thinned(rows: Array) -> Array:
    """About ENOUGH of the rows (N, C), evenly, always the same ones."""
    return np.ascontiguousarray(rows[:: max(1, -(-len(rows) // ENOUGH))])


def on_lattice(pixels: Array) -> Array:
    """About PIXELS of the pixels (N, 2), on a lattice that is nearly as fine in every direction: areas keep their share."""
    step = -(-len(pixels) // PIXELS)
    if step <= 1:
        return pixels
    slope = min((k for k in range(1, step) if math.gcd(k, step) == 1), key=lambda k: abs(k - step / GOLDEN))
    return np.asarray(pixels[(pixels[:, 0] + slope * pixels[:, 1]) % step == 0])


def _lengths(pixels: Floats, path: Ints) -> Floats:
    """The length of image, px, that each station stands for: half way to either neighbour on its path."""
    step = np.linalg.norm(np.diff(pixels, axis=0), axis=1) * (np.diff(path) == 0)
    return np.asarray((np.concatenate(([0.0], step)) + np.concatenate((step, [0.0]))) / 2)


@dataclass(frozen=True)
class Section:
    """Surface points in the cross-sections of the stations they belong to.

    station : (N,) int. lateral, away : (N,) m from the station.
    """

    station: Ints
    lateral: Floats
    away: Floats


def sections(points: Floats, places: Floats, frames: Frames, reach: Floats) -> Section:
    """Each point (N, 3) m in the cross-section of its nearest station, those farther than its `reach` (S,) m left out."""
    distance, near = nearest(points, places, float(reach.max()), True)
    kept = distance < reach[near]
    near = near[kept]
    offset = points[kept] - places[near]
    return Section(near, np.einsum("ij,ij->i", offset, frames.lateral[near]), np.einsum("ij,ij->i", offset, frames.away[near]))


def axis_depth(section: Section, path: Ints, radius: Floats, half: int) -> tuple[Floats, Floats]:
    """How far the axis lies away from each station, m, and how many points say so: (S,), (S,).

    The mean of away + sqrt(r^2 - u^2) over the points with |u| < 0.8 r, those that disagree by more than three
    deviations left out. Stations must lie in the middle of the silhouette.
    """
    good = np.abs(section.lateral) < 0.8 * radius[section.station]
    station = section.station[good]
    depth = section.away[good] + np.sqrt(radius[station] ** 2 - section.lateral[good] ** 2)
    stations = len(path)
    for last in (False, True):
        count = window_sum(np.bincount(station, minlength=stations), path, half)
        mean = window_sum(np.bincount(station, weights=depth, minlength=stations), path, half) / np.maximum(count, 1e-9)
        if last or not len(station):
            break
        residual = np.abs(depth - mean[station])
        inside = residual <= max(4.5 * float(np.median(residual)), 1e-9)
        station, depth = station[inside], depth[inside]
    return mean, count


def shell(section: Section, path: Ints, half: int) -> tuple[Floats, Floats, Floats]:
    """Middle and radius of a half shell from how its points spread sideways, pooled over `half` stations on either side.

    Points of a depth image lie evenly over the width, so their lateral places have the variance r^2 / 3 and the kurtosis 1.8;
    points that lie evenly on the surface, as a voxel filter leaves them, have r^2 / 2 and 1.5. The kurtosis tells.
    Returns the lateral middle (S,) m, radii (S,) m, and counts (S,).
    """

    def pooled(values: Floats) -> Floats:
        return window_sum(np.bincount(section.station, weights=values, minlength=len(path)), path, half)

    count = pooled(np.ones_like(section.lateral))
    safe = np.maximum(count, 1e-9)
    middle = pooled(section.lateral) / safe
    aside = section.lateral - middle[section.station]
    variance = pooled(aside**2) / safe
    scaled = aside / np.sqrt(np.maximum(variance, 1e-18))[section.station]
    kurtosis = float(np.mean(scaled**4)) if len(scaled) else 1.8
    factor = float(np.clip(3 - (1.8 - kurtosis) / 0.3, 2.0, 3.0))
    return middle, np.where(count >= 5, np.sqrt(factor * variance), np.nan), count


def faces(section: Section, path: Ints, places: Floats, frames: Frames, half: int, viewpoint: Floats) -> bool:
    """Whether the points look like the half shells that are seen from `viewpoint`.

    Then the circle through each cross-section has its middle behind the points, as seen from there; the points of a
    whole tube have it in their middle.
    """
    center, radii, count = circles(section, path, None, half)
    mean = np.zeros_like(center)
    for column, values in enumerate((section.lateral, section.away)):
        sums = np.bincount(section.station, weights=values, minlength=len(path))
        mean[:, column] = window_sum(sums, path, half) / np.maximum(count, 1e-9)
    good = (count >= 5) & np.isfinite(radii)
    behind = (center - mean)[good] / np.maximum(radii[good], 1e-9)[:, None]
    depth = behind[:, :1] * frames.lateral[good] + behind[:, 1:] * frames.away[good]
    ray = unit(places[good] - viewpoint)
    return bool(good.any()) and float(np.median(np.einsum("ij,ij->i", depth, ray))) > 0.4


def circles(section: Section, path: Ints, radius: Floats | None, half: int, rounds: int = 8) -> tuple[Floats, Floats, Floats]:
    """The circle through each station's cross-section, pooled over `half` stations on either side.

    Least squares of the distance to the circle by Gauss-Newton, begun from the algebraic fit of Kasa (1976), which
    alone makes arcs too small. With radii (S,) given only the centre is fitted.
    Returns centres (S, 2) m as (lateral, away) from the station, radii (S,) m (NaN where fewer than 5 points), and
    counts of points (S,).
    """
    stations, u, w, at = len(path), section.lateral, section.away, section.station

    def pooled(values: Floats) -> Floats:
        return window_sum(np.bincount(at, weights=values, minlength=stations), path, half)

    count = pooled(np.ones_like(u))
    safe = np.maximum(count, 1e-9)
    center, found = _kasa(u, w, at, pooled, safe)
    radii = np.where(np.isfinite(found), found, 0.0) if radius is None else radius.copy()
    for _ in range(rounds):
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
    radii[count < 5] = np.nan
    return center, radii, count


def _kasa(u: Floats, w: Floats, at: Ints, pooled: Callable[[Floats], Floats], count: Floats) -> tuple[Floats, Floats]:
    """Least squares of u^2 + w^2 = 2 a u + 2 b w + c, in coordinates centred on the station's mean."""
    mean = np.column_stack((pooled(u), pooled(w))) / count[:, None]
    u, w = u - mean[at, 0], w - mean[at, 1]
    q = u * u + w * w
    uu, uw, ww, su, sw, n, uq, wq, sq = map(pooled, (u * u, u * w, w * w, u, w, np.ones_like(u), u * q, w * q, q))
    matrix = np.stack((uu, uw, su, uw, ww, sw, su, sw, n), -1).reshape(-1, 3, 3)
    spread = np.maximum(uu + ww, 1e-18)
    matrix += 1e-6 * spread[:, None, None] * np.diag((1.0, 1.0, 0.0))
    matrix[n < 5] = np.eye(3)
    a, b, c = np.linalg.solve(matrix, np.stack((uq, wq, sq), -1)[..., None])[..., 0].T
    radius = np.sqrt(np.maximum(c + (a * a + b * b) / 4, 0.0))
    radius[n < 5] = np.nan
    return np.where(n[:, None] < 5, mean, mean + np.column_stack((a, b)) / 2), radius
