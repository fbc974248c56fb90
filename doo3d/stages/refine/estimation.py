"""From the seen surface to the axis: the stations moved to where mask, points or circles say it is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...config import RefineConfig
from ...geometry.mask import mask_pixels
from ...geometry.polyline import steps, whittaker_smooth
from ...types import Bools, Floats, Foreground
from .cross_sections import (
    Frames,
    axis_depth,
    circles,
    faces,
    flat_frames,
    frames_towards,
    sections,
    shell,
    silhouette,
    thinned,
    window_sum,
)
from .multiview import look_at, median_radius
from .samples import Stations

WRAP = 40
"""Stations by which a ring is continued over its seam before it is smoothed."""

IN_A_GAP = 0.3
"""How far to believe a measurement at a station that lies in a gap, beside 1 elsewhere: it may be of something in front."""


MAX_SURFACE_DISTANCE = 2.2
"""Radii round the path within which surface points belong to it."""

SMOOTHING_RADII = 1.2
"""Radii; details of the axis shorter than about 2 pi times this are smoothed."""

PATH_WEIGHT = 0.01
"""Weight of the filled path where nothing was seen, beside 1 where the surface was seen."""

DEPTH_WEIGHT = 0.06
"""Weight of depth, which a stereo camera measures with errors in waves along a strand, beside 1 for sideways."""

DEPTH_NOISE_RADII = 0.15
"""Radii; depth that is less exact than this weighs less, by the square of how much."""


@dataclass(frozen=True)
class _Estimate:
    """Where the axis is by one measurement, (S, D), and the weights of that, (S, D, D)."""

    target: Floats
    weight: Floats

    @staticmethod
    def along(frames: Frames, target: Floats, lateral: Floats, away: Floats) -> _Estimate:
        """With the weights (S,) sideways and in depth."""
        weight = np.einsum("s,si,sj->sij", lateral, frames.lateral, frames.lateral)
        return _Estimate(target, weight + np.einsum("s,si,sj->sij", away, frames.away, frames.away))


def infer_viewpoint(foreground: Foreground, stations: Stations, config: RefineConfig) -> Foreground:
    """The foreground; a cloud that does not say where its sensor stood and looks as seen from its origin was seen from there."""
    if foreground.viewpoint is not None or foreground.points.shape[1] == 2:
        return foreground
    frames = frames_towards(stations.places, stations.tangents(), None)
    section = sections(thinned(foreground.points), stations.places, frames, MAX_SURFACE_DISTANCE * stations.radius)
    origin = np.zeros(3)
    seen_from_origin = faces(section, stations.path, stations.places, frames, stations.half, origin)
    return replace(foreground, viewpoint=origin) if seen_from_origin else foreground


def to_axis(stations: Stations, config: RefineConfig, foreground: Foreground) -> None:
    """Move the stations to the axis, one round, and set their radii."""
    flat = stations.places.shape[1] == 2
    tangent = stations.tangents()
    frames = flat_frames(tangent) if flat else frames_towards(stations.places, tangent, foreground.viewpoint)
    if foreground.mask is not None:
        found = _from_mask(stations, frames, config, foreground)
    elif foreground.views:
        found = _from_sights(stations, frames, config, foreground)
    elif foreground.viewpoint is not None:
        found = _from_shell(stations, frames, config, thinned(foreground.points))
    else:
        found = _from_circles(stations, frames, config, thinned(foreground.points))
    weight = found.weight + PATH_WEIGHT * np.eye(stations.places.shape[1])
    for p, closed in enumerate(stations.closed):
        part = stations.of(p)
        spacing = float(np.median(steps(stations.places[part])))
        strength = (SMOOTHING_RADII * float(stations.radius[part.start]) / max(spacing, 1e-9)) ** 4
        stations.places[part] = _smoothed(found.target[part], weight[part], strength, closed)


def _smoothed(values: Floats, weight: Floats, strength: float, closed: bool) -> Floats:
    if not closed:
        return whittaker_smooth(values, weight, strength)
    wrap = min(WRAP, len(values))
    around = np.arange(-wrap, len(values) + wrap) % len(values)
    return whittaker_smooth(values[around], weight[around], strength)[wrap : wrap + len(values)]


def _from_mask(stations: Stations, frames: Frames, config: RefineConfig, foreground: Foreground) -> _Estimate:
    """Sideways from the mask's middle, in depth from the surface points; the radius from the mask's width."""
    assert foreground.mask is not None
    reach = MAX_SURFACE_DISTANCE * stations.radius
    pixels = mask_pixels(foreground.mask) if foreground.camera is not None else foreground.points
    seen = silhouette(stations.places, frames, stations.path, pixels, foreground.camera, reach, stations.half)
    _set_radius(stations, seen.radius, ~stations.filled & (seen.radius > 0))
    trust = np.exp(-(((seen.radius / stations.radius - 1) / 0.3) ** 2)) * (seen.radius > 0)
    stations.radii = _along(seen.radius, (trust > 0.5) & ~stations.filled, stations)
    moved = stations.places + np.where(trust > 0.1, seen.offset, 0.0)[:, None] * frames.lateral
    lateral_weight = trust * np.where(stations.filled, IN_A_GAP, 1.0)
    if foreground.camera is None:
        return _Estimate.along(frames, moved, lateral_weight, np.zeros(len(moved)))
    depth, away_weight = _depth(stations, moved, frames, config, thinned(foreground.points))
    return _Estimate.along(frames, moved + depth[:, None] * frames.away, lateral_weight, away_weight)


def _depth(stations: Stations, moved: Floats, frames: Frames, config: RefineConfig, points: Floats) -> tuple[Floats, Floats]:
    """How far behind places in the middle of the silhouette the axis lies, m, and the weight of that: (S,) and (S,)."""
    section = sections(points, moved, frames, MAX_SURFACE_DISTANCE * stations.radius)
    depth, count = axis_depth(section, stations.path, stations.radius, stations.half)
    usual = _usual(count)
    weight = np.minimum(1.0, count / usual) * np.where(count > 0.1 * usual, 1.0, 0.0)
    weight *= np.where(stations.filled, IN_A_GAP, 1.0) * DEPTH_WEIGHT
    depth = np.where(weight > 0, depth, 0.0)
    noise = unrest(moved + depth[:, None] * frames.away, frames.away, (weight > 0) & ~stations.filled, stations)
    return depth, weight * min(1.0, DEPTH_NOISE_RADII / max(noise, 1e-9)) ** 2


def unrest(places: Floats, away: Floats, known: Bools, stations: Stations) -> float:
    """The usual error in depth of places (S, 3) measured along paths, in radii, from the second difference along `away` (S, 3).

    Places as far apart as measurements are pooled over are independent, and the second difference of independent errors has
    six times their variance. The median sees little of the bends, which are the smaller part of an object. known : (S,).
    """
    step = 2 * stations.half + 1
    first, middle, last = slice(None, -2 * step), slice(step, -step), slice(2 * step, None)
    change = np.abs(np.einsum("ij,ij->i", places[last] - 2 * places[middle] + places[first], away[middle]))
    usable = known[first] & known[middle] & known[last] & (stations.path[first] == stations.path[last])
    relative = (change / stations.radius[middle])[usable]
    return float(1.4826 * np.median(relative) / np.sqrt(6)) if len(relative) else 0.0


def _from_shell(stations: Stations, frames: Frames, config: RefineConfig, points: Floats) -> _Estimate:
    """Sideways from the middle of the points, in depth from them; the radius from their spread: clouds of one view."""
    section = sections(points, stations.places, frames, MAX_SURFACE_DISTANCE * stations.radius)
    middle, radii, count = shell(section, stations.path, stations.half)
    usable = np.isfinite(radii) & ~stations.filled
    _set_radius(stations, radii, usable)
    stations.radii = _along(radii, usable & (np.abs(radii / stations.radius - 1) < 0.4), stations)
    weight = np.minimum(1.0, count / _usual(count)) * (count >= 5) * np.where(stations.filled, IN_A_GAP, 1.0)
    width = np.where(np.isfinite(radii), radii, 0.0) / stations.radius
    lateral_weight = weight * np.exp(-(((width - 1) / 0.3) ** 2))
    moved = stations.places + np.where(lateral_weight > 0.1, middle, 0.0)[:, None] * frames.lateral
    depth, away_weight = _depth(stations, moved, frames, config, points)
    return _Estimate.along(frames, moved + depth[:, None] * frames.away, lateral_weight, away_weight)


def _from_circles(stations: Stations, frames: Frames, config: RefineConfig, points: Floats) -> _Estimate:
    """Both ways from the circle through the cross-section, for clouds of many views."""
    section = sections(points, stations.places, frames, MAX_SURFACE_DISTANCE * stations.radius)
    _, radii, _ = circles(section, stations.path, None, stations.half)
    usable = np.isfinite(radii) & ~stations.filled & (radii < 3 * stations.radius) & (radii > stations.radius / 3)
    _set_radius(stations, radii, usable)
    stations.radii = _along(radii, usable & (np.abs(radii / stations.radius - 1) < 0.4), stations)
    center, _, count = circles(section, stations.path, stations.radius, stations.half)
    weight = np.minimum(1.0, count / _usual(count)) * (count >= 5) * np.where(stations.filled, IN_A_GAP, 1.0)
    weight *= np.linalg.norm(center, axis=1) < MAX_SURFACE_DISTANCE * stations.radius
    offset = center[:, :1] * frames.lateral + center[:, 1:] * frames.away
    return _Estimate.along(frames, stations.places + np.where(weight[:, None] > 0, offset, 0.0), weight, weight)


def _from_sights(stations: Stations, frames: Frames, config: RefineConfig, foreground: Foreground) -> _Estimate:
    """Sideways from the masks of all views, which together tell depth too; the circle as far as depth is to be believed."""
    looks = [
        look for view in foreground.views if (look := look_at(stations, frames.tangent, view, MAX_SURFACE_DISTANCE)) is not None
    ]
    radii = median_radius(looks, len(stations.places))
    usable = np.isfinite(radii) & ~stations.filled
    _set_radius(stations, radii, usable)
    stations.radii = _along(radii, usable & (np.abs(radii / stations.radius - 1) < 0.4), stations)
    section = sections(thinned(foreground.points), stations.places, frames, MAX_SURFACE_DISTANCE * stations.radius)
    center, _, count = circles(section, stations.path, stations.radius, stations.half)
    believed = DEPTH_WEIGHT * np.minimum(1.0, count / _usual(count)) * (count >= 5)
    believed *= np.linalg.norm(center, axis=1) < MAX_SURFACE_DISTANCE * stations.radius
    across = np.einsum("si,sj->sij", frames.lateral, frames.lateral) + np.einsum("si,sj->sij", frames.away, frames.away)
    weight = believed[:, None, None] * across
    pull = believed[:, None] * (center[:, :1] * frames.lateral + center[:, 1:] * frames.away)
    for look in looks:
        trust = np.exp(-(((look.radius / stations.radius[look.station] - 1) / 0.3) ** 2)) * (look.radius > 0)
        weight[look.station] += np.einsum("s,si,sj->sij", trust, look.lateral, look.lateral)
        pull[look.station] += (trust * look.offset)[:, None] * look.lateral
    share = np.where(stations.filled, IN_A_GAP, 1.0)[:, None]
    moved = np.linalg.solve(weight + 1e-9 * np.eye(3), pull[..., None])[..., 0]
    return _Estimate(stations.places + moved, share[..., None] * weight)


def _usual(count: Floats) -> float:
    return float(np.median(count[count > 0])) if (count > 0).any() else 1.0


def _set_radius(stations: Stations, measured: Floats, usable: Bools) -> None:
    """Give every path the median of what was measured along it."""
    for p in range(len(stations.closed)):
        part = stations.of(p)
        if usable[part].any():
            stations.radius[part] = float(np.median(measured[part][usable[part]]))


def _along(measured: Floats, good: Bools, stations: Stations) -> Floats:
    """The radius at each station: the pooled measurement where it is good, interpolated along the path elsewhere."""
    result = stations.radius.copy()
    half = 2 * stations.half
    count = window_sum(good.astype(float), stations.path, half)
    mean = window_sum(np.where(good, measured, 0.0), stations.path, half) / np.maximum(count, 1.0)
    for p in range(len(stations.closed)):
        part = stations.of(p)
        index = np.flatnonzero(count[part] > 0)
        if len(index):
            result[part] = np.interp(np.arange(part.stop - part.start), index, mean[part][index])
    return result
