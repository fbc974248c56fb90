"""From the skeleton on the seen surface to the axis, with the radius, as equal segments from end to end."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..config import RefineConfig
from ..evidence import Evidence, Seen
from ..geometry import arc_length, equal_chords, resample, smooth_fit, steps, tangents, unit
from ..surface import Frames, Section, axis_depth, circles, frames_towards, sections, silhouette, window_sum
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
    stations = _lay(paths, grid.radius, config, segment_length)
    radius = grid.radius
    for _ in range(config.rounds):
        radius = _to_axis(stations, radius, config, foreground, grid)
    if config.rounds == 0:
        stations.radii[:] = radius
    tree = cKDTree(grid.centroids)
    chains = []
    for p in range(len(paths)):
        chain = _chain(stations, p, radius, config, segment_length, grid, tree)
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
        np.full(size, radius), half,
    )  # fmt: skip


def _to_axis(stations: _Stations, radius: float, config: RefineConfig, foreground: Foreground, grid: VoxelGrid) -> float:
    """Move the stations to the axis, one round; returns the object's radius, m."""
    frames = frames_towards(stations.places, stations.tangents(), foreground.viewpoint)
    if foreground.camera is not None and foreground.mask is not None:
        radius, target, lateral_weight, away_weight = _from_image(stations, frames, radius, config, foreground, grid)
    else:
        radius, target, lateral_weight, away_weight = _from_circles(stations, frames, radius, config, grid)
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
    stations: _Stations, frames: Frames, radius: float, config: RefineConfig, foreground: Foreground, grid: VoxelGrid
) -> _Estimate:
    """Sideways from the mask's middle, in depth from the surface points; the radius from the mask's width."""
    camera, mask = foreground.camera, foreground.mask
    assert camera is not None and mask is not None
    scale = np.maximum(stations.places[:, 2], 1e-6) / camera.fx
    v, u = np.nonzero(mask)
    seen = silhouette(
        stations.places, frames.lateral, stations.path, np.column_stack((u, v)), camera,
        config.reach * radius / scale, stations.half,
    )  # fmt: skip
    measured = seen.width * scale / 2
    usable = ~stations.filled & (seen.width > 0)
    if usable.any():
        radius = float(np.median(measured[usable]))
    stations.radii = _along(measured, (seen.weight > 0.5) & usable, radius, stations)
    sideways = stations.places + (seen.offset * scale)[:, None] * frames.lateral
    moved = np.where((seen.weight > 0.1)[:, None], sideways, stations.places)
    section = _sections(moved, frames, grid, config.reach * radius)
    depth, count = axis_depth(section, stations.path, radius, stations.half)
    usual = float(np.median(count[count > 0])) if (count > 0).any() else 1.0
    away_weight = np.minimum(1.0, count / usual) * np.where(count > 0.1 * usual, 1.0, 0.0)
    away_weight *= np.where(stations.filled, 0.3, 1.0)
    lateral_weight = seen.weight * np.where(stations.filled, 0.3, 1.0)
    return radius, moved + (np.where(away_weight > 0, depth, 0.0))[:, None] * frames.away, lateral_weight, away_weight


def _from_circles(stations: _Stations, frames: Frames, radius: float, config: RefineConfig, grid: VoxelGrid) -> _Estimate:
    """Both ways from the circle through the cross-section, for clouds."""
    section = _sections(stations.places, frames, grid, config.reach * radius)
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


def _sections(places: Floats, frames: Frames, grid: VoxelGrid, reach: float) -> Section:
    return sections(grid.centroids, grid.counts.astype(float), places, frames, reach)


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
    stations: _Stations, p: int, radius: float, config: RefineConfig, length: float, grid: VoxelGrid, tree: cKDTree
) -> Chain | None:
    part = stations.of(p)
    axis, radii = stations.places[part], stations.radii[part]
    if stations.closed[p]:
        joints = equal_ring(axis, length)
    else:
        first = _end_shift(axis[::-1], stations, part.start, radius, config, grid, tree)
        last = _end_shift(axis, stations, part.stop - 1, radius, config, grid, tree)
        joints = equal_segments(_carried(_carried(axis, last)[::-1], first)[::-1], length)
    if len(joints) < 2:
        return None
    along = cKDTree(axis).query(joints)[1]
    return Chain(joints, length, radius, radii[along], closed=stations.closed[p])


def _end_shift(
    axis: Floats, stations: _Stations, end: int, radius: float, config: RefineConfig, grid: VoxelGrid, tree: cKDTree
) -> float:
    """How far the surface goes on beyond the last point of the axis (negative: ends before it), m.

    Surface points near the end tangent count, up to the first empty stretch of a radius; those nearer to another part
    of any path do not.
    """
    if not config.extend:
        return 0.0
    heading = unit(axis[-1] - axis[-min(len(axis), 2 + round(2 * radius / max(float(steps(axis[-2:])[0]), 1e-9)))])
    index = np.array(tree.query_ball_point(axis[-1], config.extend * radius), dtype=np.int64)
    if not len(index):
        return 0.0
    offset = grid.centroids[index] - axis[-1]
    along = offset @ heading
    aside = np.linalg.norm(offset - along[:, None] * heading, axis=1)
    own = np.abs(cKDTree(stations.places).query(grid.centroids[index])[1] - end) <= 3 * stations.half + 3
    reached = np.sort(along[(aside < 1.6 * radius) & (along > -config.extend * radius) & own])
    if not len(reached):
        return 0.0
    gap = np.flatnonzero((np.diff(reached) > max(radius, 2 * grid.size)) & (reached[1:] > 0))
    last = reached[gap[0]] if len(gap) else reached[-1]
    return float(last + grid.size / 2)


def _carried(axis: Floats, shift: float) -> Floats:
    """The polyline made longer by `shift` m straight on at its last point, or shorter."""
    if shift >= 0:
        return np.concatenate((axis, [axis[-1] + shift * unit(axis[-1] - axis[-2])]))
    along = arc_length(axis)
    keep = max(along[-1] + shift, along[1])
    return np.concatenate((axis[along < keep], resample(axis, np.array([keep]))))


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
    for _ in range(5):
        joints, at = equal_chords(np.concatenate((resample(longer, np.array([start + length])), longer[along > start])), length)
        at += start
        if count == 0:
            last = int(np.searchsorted(at, total, side="right")) - 1
            count = max(1, round(last + (total - at[last]) / length))
        count = min(count, len(joints) - 1)
        start = float(np.clip(start - (start + at[count] - total) / 2, -length / 2, length / 2))
    return joints[: count + 1]


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
        joints, _ = equal_chords(loop, chord)
        low, high = (chord, high) if len(joints) - 1 >= count else (low, chord)
    joints = equal_chords(loop, low)[0][: count + 1]
    joints[-1] = joints[0]
    middle = joints[:-1].mean(axis=0)
    return middle + (joints - middle) * (length / low)


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
