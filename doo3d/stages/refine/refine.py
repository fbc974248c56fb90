"""From the skeleton on the seen surface to the axis, with the radius, as equal segments from end to end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...config import RefineConfig
from ...geometry.equal_segments import equal_ring, equal_segments, extrapolated, sagitta_compensated
from ...geometry.polyline import arc_length
from ...kernels.nearest import nearest
from ...types import Chain, Connection, Floats, Foreground, Path
from ...visibility import Visibility
from .. import FrameContext
from .cross_sections import thinned
from .end_extension import carried_on
from .estimation import infer_viewpoint, to_axis
from .samples import Ahead, Stations, ahead, extended, lay


def refine(paths: list[Path], context: FrameContext, config: RefineConfig) -> list[Chain]:
    """Chains along the axis, equal segments from end to end; longest first.

    paths : on the seen surface, m (in the mask, px, in 2-D). Where there is a mask, its width gives the radius.
    """
    if not paths:
        return []
    foreground, grid, visibility, segment_length = context.foreground, context.grid, context.visibility, context.segment_length
    stations = lay(paths, grid.radius, config, segment_length)
    points = _ascending(foreground.points)
    paths = extended(paths, stations, config, points, grid.size)
    stations = lay(paths, grid.radius, config, segment_length)
    longer = carried_on(paths, stations, config, points, visibility)
    if longer is not paths:
        paths, stations = longer, lay(longer, grid.radius, config, segment_length)
    foreground = infer_viewpoint(foreground, stations, config)
    for _ in range(config.iterations):
        to_axis(stations, config, foreground)
    surface = thinned(grid.centroids)
    chains = []
    for p in range(len(paths)):
        joints = _joints(stations, p, config, segment_length, points, grid.size)
        if len(joints) > 1:
            chain = _chain(joints, stations, p, config, segment_length, surface, grid.size, visibility)
            chains.append(replace(chain, connections=_connections(paths[p], chain, stations.places[stations.of(p)])))
    thickest = max((chain.radius for chain in chains), default=0.0)
    chains = [_directed(chain, foreground) for chain in chains if chain.radius >= config.min_radius_ratio * thickest]
    return sorted(chains, key=lambda chain: -chain.length)


def _ascending(points: Floats) -> Floats:
    """The points (N, D) by their first coordinate."""
    first = points[:, 0]
    return points if (first[1:] >= first[:-1]).all() else points[np.argsort(first, kind="stable")]


def _joints(stations: Stations, p: int, config: RefineConfig, length: float, points: Floats, grain: float) -> Floats:
    """The joints of one path, (N + 1, D), or (0, D) where it is shorter than half a segment."""
    part = stations.of(p)
    axis = stations.places[part]
    if stations.closed[p]:
        return equal_ring(axis, length)
    end = _area_end if axis.shape[1] == 2 else _wall_end
    radius = float(stations.radius[part.start])
    first = end(ahead(stations, part.start, 1, config, points, grain), radius)
    last = end(ahead(stations, part.stop - 1, -1, config, points, grain), radius)
    return equal_segments(extrapolated(extrapolated(sagitta_compensated(axis, length), last)[::-1], first)[::-1], length)


def _wall_end(seen: Ahead, radius: float) -> float:
    """Where the axis ends: where the surface stops being a radius away from it, m ahead of the end.

    For a flat end that is the end, for a round one less than half a radius beyond the middle of the ball.
    """
    wall = seen.along[seen.aside > 0.9 * radius]
    return float(wall[-min(3, len(wall))]) if len(wall) else 0.0


def _area_end(seen: Ahead, radius: float) -> float:
    """Where a flat end would cut the strip so that its area is the same, px ahead of the end."""
    back = 3 * radius
    count = int(((seen.along > -back) & (seen.aside < 1.2 * radius)).sum())
    return count / (2 * radius) - back if count else 0.0


def _chain(
    joints: Floats, stations: Stations, p: int, config: RefineConfig, length: float, surface: Floats, grain: float,
    visibility: Visibility | None,
) -> Chain:  # fmt: skip
    """The chain with its radii, and the segments marked that were filled in, not seen (paper, section III-H)."""
    part = stations.of(p)
    radius = float(stations.radius[part.start])
    middle = (joints[1:] + joints[:-1]) / 2
    occluded = np.ones(len(middle), dtype=bool)
    if config.occluded != "from_depth":
        occluded = stations.filled[part][nearest(middle, stations.places[part], length, False)[1]]
    if config.occluded != "from_gaps" and occluded.any():
        unseen = np.isinf(nearest(middle[occluded], surface, 1.5 * radius + grain, True)[0])
        if visibility is not None:
            unseen &= ~visibility.masked(middle[occluded])
        occluded[occluded] = unseen
    radii = stations.radii[part][nearest(joints, stations.places[part], length, False)[1]]
    return Chain(joints, length, radius, radii, occluded, stations.closed[p])


def _connections(path: Path, chain: Chain, places: Floats) -> tuple[Connection, ...]:
    """The connections of a path at the segments that lie there; places (S, D) : the stations laid along it."""
    if not path.joins:
        return ()
    along = arc_length(np.concatenate((path.points, path.points[:1])) if path.closed else path.points)
    near = nearest((chain.joints[1:] + chain.joints[:-1]) / 2, places, chain.segment_length, False)[1]
    found = []
    for step, confidence in path.joins:
        station = (along[step] + along[step + 1]) / 2 / along[-1] * (len(places) - (not path.closed))
        gap = np.abs(near - station)
        gap = np.minimum(gap, len(places) - gap) if path.closed else gap
        found.append(Connection(int(gap.argmin()), confidence))
    return tuple(sorted(found))


def _directed(chain: Chain, foreground: Foreground) -> Chain:
    """The chain from the end nearer the left edge of the view (ties: nearer the top)."""
    ends = chain.joints[[0, -1]] if not chain.closed else chain.joints[[1, -2]]
    if foreground.camera is not None:
        ends = foreground.camera.project(ends)
    first, last = (tuple(end.tolist()) for end in ends[:, :2])
    if first <= last:
        return chain
    last_segment = len(chain.occluded) - 1
    connections = tuple(Connection(last_segment - segment, confidence) for segment, confidence in chain.connections[::-1])
    return replace(
        chain, joints=chain.joints[::-1], radii=chain.radii[::-1], occluded=chain.occluded[::-1], connections=connections
    )
