"""Places along all paths of a frame, close together, at which the object is measured."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...config import RefineConfig
from ...geometry.polyline import arc_length, resample, tangents, unit
from ...kernels.nearest import nearest, points_near_line
from ...types import Bools, Floats, Ints, Path

SAMPLE_SPACING_RADII = 0.4
"""Radii between the samples at which the axis is estimated."""

WINDOW_RADII = 1.0
"""Radii on either side of a sample from which its estimate is taken."""

MAX_END_EXTENSION = 6.0
"""Radii by which an end may be extended to the last surface point."""


@dataclass
class Stations:
    """Places (S, D) along all paths, one path after the other.

    path : (S,) the number of each one's path. filled : (S,) bool, in a gap that was filled. closed : per path.
    radius : (S,) of the object each belongs to; radii : (S,) where each is. half : stations that are pooled on either side.
    spacing : m (px in 2-D), the steps along the paths.
    """

    places: Floats
    path: Ints
    filled: Bools
    closed: list[bool]
    radius: Floats
    half: int
    spacing: float
    radii: Floats = field(init=False)

    def __post_init__(self) -> None:
        self.radii = self.radius.copy()

    def of(self, number: int) -> slice:
        """The stations of one path."""
        return slice(*np.searchsorted(self.path, [number, number + 1]).tolist())

    def inside(self, end: int, inwards: int, distance: float) -> Floats:
        """The place `distance` m along the path from its end."""
        path = self.of(int(self.path[end]))
        at = end + inwards * max(1, round(distance / self.spacing))
        return np.asarray(self.places[min(max(at, path.start), path.stop - 1)])

    def tangents(self) -> Floats:
        """(S, D) unit tangents."""
        return np.concatenate([tangents(self.places[self.of(p)], closed) for p, closed in enumerate(self.closed)])


def lay(paths: list[Path], radius: float, config: RefineConfig, segment_length: float) -> Stations:
    """Stations along paths of an object of this radius, at equal arc length on each."""
    spacing = min(SAMPLE_SPACING_RADII * radius, segment_length / 2)
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
    half = round(WINDOW_RADII * radius / spacing)
    return Stations(
        np.concatenate(places), np.concatenate(numbers), np.concatenate(filled), [path.closed for path in paths],
        np.full(size, radius), half, spacing,
    )  # fmt: skip


@dataclass(frozen=True)
class Ahead:
    """The surface along the tangent at a free end: how far ahead of the end each point is, ascending, and how far from the
    tangent, (N,) and (N,) m; and the tangent (D,) unit, outwards.
    """

    along: Floats
    aside: Floats
    heading: Floats


def ahead(stations: Stations, end: int, inwards: int, config: RefineConfig, points: Floats, grain: float) -> Ahead:
    """The surface points (N, D), ascending in their first coordinate, ahead of a free end, up to the first empty stretch of a
    radius.

    end : the end's station. inwards : 1 where the path goes on to higher stations, -1 to
    lower. grain : m, how far apart the points may lie anyway. What lies nearer to another part of any path does not count.
    """
    tip, radius = stations.places[end], float(stations.radius[end])
    heading = unit(tip - stations.inside(end, inwards, 2 * radius))
    reach = MAX_END_EXTENSION * radius
    low, high = np.searchsorted(points[:, 0], [tip[0] - reach, tip[0] + reach])
    near, along, aside = points_near_line(points[low:high], tip, heading, reach, 1.6 * radius)
    if not len(near):
        return Ahead(np.zeros(0), np.zeros(0), heading)
    own = np.abs(nearest(near, stations.places, 2 * radius, False)[1] - end) <= 3 * stations.half + 3
    along, aside = along[own], aside[own]
    order = np.argsort(along)
    along, aside = along[order], aside[order]
    gap = np.flatnonzero((np.diff(along) > max(radius, 2 * grain)) & (along[1:] > 0))
    stop = gap[0] + 1 if len(gap) else len(along)
    return Ahead(along[:stop], aside[:stop], heading)


def extended(paths: list[Path], stations: Stations, config: RefineConfig, points: Floats, grain: float) -> list[Path]:
    """The paths carried on straight at their free ends as far as the surface goes: points as for `ahead`."""
    result = []
    for p, path in enumerate(paths):
        part = stations.of(p)
        places, filled, joins = path.points, path.filled, path.joins
        for end, inwards in () if path.closed else ((part.start, 1), (part.stop - 1, -1)):
            seen = ahead(stations, end, inwards, config, points, grain)
            if len(seen.along) and seen.along[-1] > 0:
                tip = stations.places[end] + seen.along[-1] * seen.heading
                places = np.concatenate(([tip], places) if inwards == 1 else (places, [tip]))
                joins = tuple((step + (inwards == 1), confidence) for step, confidence in joins)
                if filled is not None:
                    filled = np.concatenate(([False], filled) if inwards == 1 else (filled, [False]))
        result.append(Path(places, path.closed, filled, joins))
    return result
