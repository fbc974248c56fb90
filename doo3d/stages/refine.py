"""From the skeleton on the seen surface to the axis, with the radius, as equal segments from end to end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from ..config import RefineConfig
from ..evidence import Evidence, Seen
from ..geometry import arc_length, resample, smooth_fit, steps, tangents, unit
from ..kernels.walking import walk
from ..silhouette import mask_pixels
from ..surface import (
    Frames,
    axis_depth,
    circles,
    faces,
    frames_towards,
    sections,
    shell,
    silhouette,
    thinned,
    window_sum,
)
from ..types import Bools, Chain, Floats, Foreground, Ints, Path, VoxelGrid

WRAP = 40
"""Stations by which a ring is continued over its seam before it is smoothed."""


@dataclass
class _Stations:
    """Places (S, 3) along all paths, `path` (S,) the number of each one's path, `filled` (S,) bridging a gap."""

    places: Floats
    path: Ints
    filled: Bools
    closed: list[bool]
    radii: Floats
    half: int
    spacing: float

    @cached_property
    def tree(self) -> cKDTree:
        """Of the places; they must not move any more."""
        return cKDTree(self.places)

    def inside(self, end: int, inwards: int, distance: float) -> Floats:
        """The place `distance` m along the path from its end."""
        path = self.of(int(self.path[end]))
        at = end + inwards * max(1, round(distance / self.spacing))
        return np.asarray(self.places[min(max(at, path.start), path.stop - 1)])

    def of(self, number: int) -> slice:
        return slice(*np.searchsorted(self.path, [number, number + 1]).tolist())

    def tangents(self) -> Floats:
        return np.concatenate([tangents(self.places[self.of(p)], closed) for p, closed in enumerate(self.closed)])


def refine(
    paths: list[Path], config: RefineConfig, segment_length: float, foreground: Foreground, grid: VoxelGrid,
    evidence: Evidence | None = None,
) -> list[Chain]:  # fmt: skip
    """Chains along the axis, equal segments from end to end; longest first.

    paths : on the seen surface, m. grid : the surface, as voxels with centroids. foreground, evidence : mask and camera,
    where there are any: the width of the mask gives the radius and the middle of its sides.
    """
    if not paths:
        return []
    radius = grid.radius
    stations = _lay(paths, radius, config, segment_length)
    stations = _lay(_extended(paths, stations, radius, config, foreground, grid.size), radius, config, segment_length)
    foreground = _with_viewpoint(foreground, stations, radius, config)
    points = thinned(foreground.points)
    for _ in range(config.rounds):
        radius = _to_axis(stations, radius, config, foreground, points)
    if config.rounds == 0:
        stations.radii[:] = radius
    tree = cKDTree(grid.centroids)
    chains = []
    for p in range(len(paths)):
        chain = _chain(stations, p, radius, config, segment_length, foreground, grid)
        if chain is not None:
            chains.append(_flag(chain, paths[p], stations, p, config, tree, grid, evidence))
    return sorted((_directed(chain, foreground) for chain in chains), key=lambda chain: -chain.length)


def _lay(paths: list[Path], radius: float, config: RefineConfig, segment_length: float) -> _Stations:
    spacing = min(config.spacing * radius, segment_length / 2)
    places, numbers, filled = [], [], []
    for p, path in enumerate(paths):
        points = np.concatenate((path.points, path.points[:1])) if path.closed else path.points
        along = arc_length(points)
        count = max(4, round(along[-1] / spacing) + 1)
        at = np.linspace(0, along[-1], count, endpoint=not path.closed)
        places.append(resample(points, at))
        edge = np.clip(np.searchsorted(along, at, side="right") - 1, 0, len(along) - 2)
        filled.append(path.filled[edge] if path.filled is not None else np.zeros(count, dtype=bool))
        numbers.append(np.full(count, p))
    size = sum(len(part) for part in places)
    half = round(config.pool * radius / spacing)
    return _Stations(
        np.concatenate(places), np.concatenate(numbers), np.concatenate(filled), [path.closed for path in paths],
        np.full(size, radius), half, spacing,
    )  # fmt: skip


def _with_viewpoint(foreground: Foreground, stations: _Stations, radius: float, config: RefineConfig) -> Foreground:
    """The foreground; a cloud that does not say where its sensor stood and looks as seen from its origin was seen from there."""
    if foreground.viewpoint is not None:
        return foreground
    frames = frames_towards(stations.places, stations.tangents(), None)
    section = sections(thinned(foreground.points), stations.places, frames, config.reach * radius)
    origin = np.zeros(3)
    seen_from_origin = faces(section, stations.path, stations.places, frames, stations.half, origin)
    return replace(foreground, viewpoint=origin) if seen_from_origin else foreground


def _extended(
    paths: list[Path], stations: _Stations, radius: float, config: RefineConfig, foreground: Foreground, size: float
) -> list[Path]:
    """The paths carried on straight at their free ends as far as the surface goes."""
    result = []
    for p, path in enumerate(paths):
        part = stations.of(p)
        points, filled = path.points, path.filled
        for end, inwards in () if path.closed else ((part.start, 1), (part.stop - 1, -1)):
            along, _ = _ahead(stations, end, inwards, radius, config, foreground, size)
            if len(along) and along[-1] > 0:
                tip = stations.places[end]
                tip = tip + along[-1] * unit(tip - stations.inside(end, inwards, 2 * radius))
                points = np.concatenate(([tip], points) if inwards == 1 else (points, [tip]))
                if filled is not None:
                    filled = np.concatenate(([False], filled) if inwards == 1 else (filled, [False]))
        result.append(Path(points, path.closed, filled))
    return result


def _to_axis(stations: _Stations, radius: float, config: RefineConfig, foreground: Foreground, points: Floats) -> float:
    """Move the stations to the axis, one round; returns the object's radius, m."""
    frames = frames_towards(stations.places, stations.tangents(), foreground.viewpoint)
    if foreground.camera is not None and foreground.mask is not None:
        radius, target, lateral_weight, away_weight = _from_image(stations, frames, radius, config, foreground, points)
    elif foreground.viewpoint is not None:
        radius, target, lateral_weight, away_weight = _from_shell(stations, frames, radius, config, points)
    else:
        radius, target, lateral_weight, away_weight = _from_circles(stations, frames, radius, config, points)
    weight = np.einsum("s,si,sj->sij", lateral_weight, frames.lateral, frames.lateral)
    weight += np.einsum("s,si,sj->sij", away_weight, frames.away, frames.away)
    weight += config.prior * np.eye(3)
    spacing = float(np.median(steps(stations.places)[np.diff(stations.path) == 0]))
    strength = (config.smooth * radius / max(spacing, 1e-9)) ** 4
    for p, closed in enumerate(stations.closed):
        part = stations.of(p)
        stations.places[part] = _smoothed(target[part], weight[part], strength, closed)
    return radius


def _smoothed(values: Floats, weight: Floats, strength: float, closed: bool) -> Floats:
    if not closed:
        return smooth_fit(values, weight, strength)
    wrap = min(WRAP, len(values))
    around = np.arange(-wrap, len(values) + wrap) % len(values)
    return smooth_fit(values[around], weight[around], strength)[wrap : wrap + len(values)]


_Estimate = tuple[float, Floats, Floats, Floats]


def _from_image(
    stations: _Stations, frames: Frames, radius: float, config: RefineConfig, foreground: Foreground, points: Floats
) -> _Estimate:
    """Sideways from the mask's middle, in depth from the surface points; the radius from the mask's width."""
    camera, mask = foreground.camera, foreground.mask
    assert camera is not None
    assert mask is not None
    seen = silhouette(stations.places, frames, stations.path, mask_pixels(mask), camera, config.reach * radius, stations.half)
    usable = ~stations.filled & (seen.radius > 0)
    if usable.any():
        radius = float(np.median(seen.radius[usable]))
    stations.radii = _along(seen.radius, (seen.weight > 0.5) & usable, radius, stations)
    sideways = stations.places + seen.offset[:, None] * frames.lateral
    moved = np.where((seen.weight > 0.1)[:, None], sideways, stations.places)
    section = sections(points, moved, frames, config.reach * radius)
    depth, count = axis_depth(section, stations.path, radius, stations.half)
    usual = float(np.median(count[count > 0])) if (count > 0).any() else 1.0
    away_weight = np.minimum(1.0, count / usual) * np.where(count > 0.1 * usual, 1.0, 0.0)
    away_weight *= np.where(stations.filled, 0.3, 1.0) * config.depth_weight
    lateral_weight = seen.weight * np.where(stations.filled, 0.3, 1.0)
    return radius, moved + (np.where(away_weight > 0, depth, 0.0))[:, None] * frames.away, lateral_weight, away_weight


def _from_shell(stations: _Stations, frames: Frames, radius: float, config: RefineConfig, points: Floats) -> _Estimate:
    """Sideways from the middle of the points, in depth from them; the radius from their spread: clouds of one view."""
    section = sections(points, stations.places, frames, config.reach * radius)
    middle, radii, count = shell(section, stations.path, stations.half)
    usable = np.isfinite(radii) & ~stations.filled
    if usable.any():
        radius = float(np.median(radii[usable]))
    stations.radii = _along(radii, usable & (np.abs(radii / radius - 1) < 0.4), radius, stations)
    usual = float(np.median(count[count > 0])) if (count > 0).any() else 1.0
    weight = np.minimum(1.0, count / usual) * (count >= 5) * np.where(stations.filled, 0.3, 1.0)
    width = np.where(np.isfinite(radii), radii, 0.0) / radius
    lateral_weight = weight * np.exp(-(((width - 1) / 0.3) ** 2))
    moved = stations.places + np.where(lateral_weight > 0.1, middle, 0.0)[:, None] * frames.lateral
    depth, seen = axis_depth(sections(points, moved, frames, config.reach * radius), stations.path, radius, stations.half)
    away_weight = weight * (seen > 0.1 * usual) * config.depth_weight
    return radius, moved + np.where(away_weight > 0, depth, 0.0)[:, None] * frames.away, lateral_weight, away_weight


def _from_circles(stations: _Stations, frames: Frames, radius: float, config: RefineConfig, points: Floats) -> _Estimate:
    """Both ways from the circle through the cross-section, for clouds."""
    section = sections(points, stations.places, frames, config.reach * radius)
    _, radii, count = circles(section, stations.path, None, stations.half)
    usable = np.isfinite(radii) & ~stations.filled & (radii < 3 * radius) & (radii > radius / 3)
    if usable.any():
        radius = float(np.median(radii[usable]))
    stations.radii = _along(radii, usable & (np.abs(radii / radius - 1) < 0.4), radius, stations)
    center, _, count = circles(section, stations.path, radius, stations.half)
    usual = float(np.median(count[count > 0])) if (count > 0).any() else 1.0
    weight = np.minimum(1.0, count / usual) * (count >= 5) * np.where(stations.filled, 0.3, 1.0)
    weight *= np.linalg.norm(center, axis=1) < config.reach * radius
    offset = center[:, :1] * frames.lateral + center[:, 1:] * frames.away
    return radius, stations.places + np.where(weight[:, None] > 0, offset, 0.0), weight, weight


def _along(measured: Floats, good: Bools, radius: float, stations: _Stations) -> Floats:
    """The radius at each station: the pooled measurement where it is good, interpolated along the path elsewhere."""
    result = np.full(len(measured), radius)
    half = 2 * stations.half
    count = window_sum(good.astype(float), stations.path, half)
    mean = window_sum(np.where(good, measured, 0.0), stations.path, half) / np.maximum(count, 1.0)
    for p in range(len(stations.closed)):
        part = stations.of(p)
        index = np.flatnonzero(count[part] > 0)
        if len(index):
            result[part] = np.interp(np.arange(part.stop - part.start), index, mean[part][index])
    return result


def _chain(
    stations: _Stations, p: int, radius: float, config: RefineConfig, length: float, foreground: Foreground, grid: VoxelGrid
) -> Chain | None:
    part = stations.of(p)
    axis, radii = stations.places[part], stations.radii[part]
    if stations.closed[p]:
        joints = equal_ring(axis, length)
    else:
        first = _wall(*_ahead(stations, part.start, 1, radius, config, foreground, grid.size), radius)
        last = _wall(*_ahead(stations, part.stop - 1, -1, radius, config, foreground, grid.size), radius)
        joints = equal_segments(_carried(_carried(_bulged(axis, length), last)[::-1], first)[::-1], length)
    if len(joints) < 2:
        return None
    along = cKDTree(axis).query(joints)[1]
    return Chain(joints, length, radius, radii[along], closed=stations.closed[p])


def _ahead(
    stations: _Stations, end: int, inwards: int, radius: float, config: RefineConfig, foreground: Foreground, size: float
) -> tuple[Floats, Floats]:
    """The surface along the tangent at a free end, up to the first empty stretch of a radius.

    end : the end's station. inwards : 1 where the path goes on to higher stations, -1 to lower. What lies nearer to
    another part of any path does not count. Returns how far ahead of the end each point is, ascending, and how far
    from the tangent, (N,) and (N,) m.
    """
    tip = stations.places[end]
    reach = config.extend * radius
    points = foreground.points[(np.abs(foreground.points - tip) < reach).all(axis=1)]
    if not reach or not len(points):
        return np.zeros(0), np.zeros(0)
    heading = unit(tip - stations.inside(end, inwards, 2 * radius))
    along = (points - tip) @ heading
    aside = np.linalg.norm(points - tip - along[:, None] * heading, axis=1)
    near = aside < 1.6 * radius
    own = np.abs(stations.tree.query(points[near])[1] - end) <= 3 * stations.half + 3
    along, aside = along[near][own], aside[near][own]
    order = np.argsort(along)
    along, aside = along[order], aside[order]
    gap = np.flatnonzero((np.diff(along) > max(radius, 2 * size)) & (along[1:] > 0))
    return (along[: gap[0] + 1], aside[: gap[0] + 1]) if len(gap) else (along, aside)


def _wall(along: Floats, aside: Floats, radius: float) -> float:
    """Where the axis ends: where the surface stops being a radius away from it, m ahead of the end.

    For a flat end that is the end, for a round one less than half a radius beyond the middle of the ball.
    """
    wall = along[aside > 0.9 * radius]
    return float(wall[-min(3, len(wall))]) if len(wall) else 0.0


def _carried(axis: Floats, shift: float) -> Floats:
    """The polyline made longer by `shift` m straight on at its last point, or shorter."""
    if shift >= 0:
        return np.concatenate((axis, [axis[-1] + shift * unit(axis[-1] - axis[-2])]))
    along = arc_length(axis)
    keep = max(along[-1] + shift, along[1])
    return np.concatenate((axis[along < keep], resample(axis, np.array([keep]))))


def _bulged(points: Floats, length: float) -> Floats:
    """The curve moved outwards by length^2 / 12 of its curvature, so that chords of `length` lie about it and not inside.

    The sagitta of a chord is length^2 / 8R, two thirds of it the mean distance of the chord from the arc. Bends of less than
    two segments' radius are left as they are.
    """
    spacing = float(np.median(steps(points)))
    bend = np.zeros_like(points)
    bend[1:-1] = (points[2:] - 2 * points[1:-1] + points[:-2]) / spacing**2
    curvature = np.linalg.norm(bend, axis=1, keepdims=True)
    return np.asarray(points - length**2 / 12 * bend / np.maximum(1.0, 2 * length * curvature))


def equal_segments(points: Floats, length: float) -> Floats:
    """Joints exactly `length` apart from end to end of a polyline (P, D); what is over is shared by both ends.

    The polyline is carried straight on at its ends, and the whole number of segments that fits best is laid so that
    the chain is as much too long, or too short, at one end as at the other. Returns (N + 1, D), or (0, D) for a
    polyline of less than half a segment.
    """
    total = float(arc_length(points)[-1])
    if total < length / 2:
        return points[:0]
    before, after = points[0] - length * unit(points[1] - points[0]), points[-1] + length * unit(points[-1] - points[-2])
    longer = np.concatenate(([before], points, [after]))
    along = arc_length(longer) - length
    start, count = 0.0, 0
    for _ in range(4):
        joints, at = walk(np.concatenate((resample(longer, np.array([start + length])), longer[along > start])), length)
        at += start
        if count == 0:
            last = int(np.searchsorted(at, total, side="right")) - 1
            count = max(1, round(last + (total - at[last]) / length))
        count = min(count, len(joints) - 1)
        start = float(np.clip(start - (start + at[count] - total) / 2, -length / 2, length / 2))
    return np.asarray(joints[: count + 1])


def equal_ring(points: Floats, length: float) -> Floats:
    """A closed chain of segments of exactly `length` round a closed polyline (P, D), whose last joint is its first.

    The whole number of segments that fits best is laid as equal chords, and the ring scaled about its middle to their
    length: by at most half a segment over the whole way round. Returns (N + 1, D), N >= 3, or (0, D).
    """
    loop = np.concatenate((points, points[:1]))
    count = round(float(arc_length(loop)[-1]) / length)
    if count < 3:
        return points[:0]
    low, high = 0.5 * length, 1.5 * length
    for _ in range(60):
        chord = (low + high) / 2
        joints, _ = walk(loop, chord)
        low, high = (chord, high) if len(joints) - 1 >= count else (low, chord)
    joints = walk(loop, low)[0][: count + 1]
    joints[-1] = joints[0]
    middle = joints[:-1].mean(axis=0)
    return np.asarray(middle + (joints - middle) * (length / low))


def _flag(
    chain: Chain, path: Path, stations: _Stations, p: int, config: RefineConfig, tree: cKDTree, grid: VoxelGrid,
    evidence: Evidence | None,
) -> Chain:  # fmt: skip
    """Mark the segments that were filled in, not seen (paper, section III-H, both of its ways)."""
    middle = (chain.joints[1:] + chain.joints[:-1]) / 2
    part = stations.of(p)
    carried = stations.filled[part][cKDTree(stations.places[part]).query(middle)[1]]
    seen = tree.query(middle)[0] < 1.5 * chain.radius + grid.size
    if evidence is not None:
        seen |= evidence.classify(middle) == Seen.MASKED
    occluded = {"carried": carried, "mapped": ~seen, "both": carried & ~seen}[config.occluded]
    return replace(chain, occluded=occluded)


def _directed(chain: Chain, foreground: Foreground) -> Chain:
    """The chain from the end nearer the left edge of the view (ties: nearer the top)."""
    ends = chain.joints[[0, -1]] if not chain.closed else chain.joints[[1, -2]]
    if foreground.camera is not None:
        ends = foreground.camera.project(ends)
    first, last = (tuple(end.tolist()) for end in ends[:, :2])
    if first <= last:
        return chain
    return replace(chain, joints=chain.joints[::-1], radii=chain.radii[::-1], occluded=chain.occluded[::-1])
