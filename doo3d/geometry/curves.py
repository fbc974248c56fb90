"""Hold several curves in flat arrays, one curve after another."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import kernels
from ..types import Bools, Floats, Ints
from .polyline import arc_length, steps, unit
from .projection import Projection


@dataclass(frozen=True, eq=False)
class Curves:
    """K curves as polylines of N points in all; derived arrays are cached.

    Attributes
    ----------
    points
        (N, D), the points of all curves, one curve after another: positions, m (px in 2-D), or D values at each. The array
        becomes read-only.
    bounds
        (K + 1,) int, row of the first point of each curve, and N.
    closed
        (K,) bool, True for a ring: its last point is followed by its first, or repeats it.
    """

    points: Floats
    bounds: Ints
    closed: Bools

    def __post_init__(self) -> None:
        self.points.flags.writeable = False

    @classmethod
    def of(cls, lines: Sequence[Floats], closed: Sequence[bool] | None = None) -> Curves:
        """Return curves through the points (P, D) of each line.

        Without `closed` all are open; without lines D is 2.
        """
        points = np.ascontiguousarray(np.concatenate(lines), dtype=float) if len(lines) else np.zeros((0, 2))
        is_ring = np.zeros(len(lines), dtype=bool) if closed is None else np.array(closed, dtype=bool)
        return cls(points, np.cumsum([0, *map(len, lines)]), is_ring)

    def __len__(self) -> int:
        return len(self.closed)

    def __getitem__(self, number: int) -> Floats:
        """Return the points of one curve, (P, D), a view of the array of all."""
        return self.points[self.parts[number]]

    def __iter__(self) -> Iterator[Floats]:
        """Yield the points of each curve."""
        return (self.points[part] for part in self.parts)

    @cached_property
    def parts(self) -> list[slice]:
        """For each curve the slice of its points in arrays over the points of all."""
        return [slice(*both) for both in itertools.pairwise(self.bounds.tolist())]

    def of_numbers(self, numbers: Sequence[int]) -> Curves:
        """Return the curves of given numbers."""
        return Curves.of([self[number] for number in numbers], self.closed[numbers].tolist())

    def with_points(self, points: Floats) -> Curves:
        """Return the same curves through other points, (N, E)."""
        return Curves(points, self.bounds, self.closed)

    @cached_property
    def counts(self) -> Ints:
        """The number of points of each curve, (K,)."""
        return np.diff(self.bounds)

    @cached_property
    def owner(self) -> Ints:
        """The index of the curve of each point, (N,)."""
        return np.repeat(np.arange(len(self.closed)), np.diff(self.bounds))

    @cached_property
    def lengths(self) -> Floats:
        """The length of each curve from its first point to its last, (K,)."""
        lengths = steps(self.points)[self.segments]
        return np.asarray(np.bincount(self.owner[self.segments], lengths, minlength=len(self)), dtype=float)

    @cached_property
    def tangents(self) -> Floats:
        """The unit tangents at the points by central differences, (N, D).

        They point along the curve, and are one-sided at the ends of an open curve.
        """
        rows, first, last = np.arange(len(self.points)), self.bounds[self.owner], self.bounds[self.owner + 1] - 1
        is_ring = self.closed[self.owner]
        before = np.where(rows > first, rows - 1, np.where(is_ring, last, first))
        after = np.where(rows < last, rows + 1, np.where(is_ring, first, last))
        return unit(self.points[after] - self.points[before])

    @cached_property
    def tips(self) -> Ints:
        """The rows of the first and the last point of each curve, (2 K,)."""
        return np.column_stack((self.bounds[:-1], self.bounds[1:] - 1)).ravel()

    @cached_property
    def segments(self) -> Ints:
        """The rows of the first points of all segments, (N - K,)."""
        return np.flatnonzero(self.owner[1:] == self.owner[:-1])

    @cached_property
    def segment_bounds(self) -> Ints:
        """The bounds of each curve's segments in arrays over all segments, (K + 1,)."""
        return self.segments.searchsorted(self.bounds)

    def ends(self, window: float) -> Floats:
        """Return the outward unit tangents at both ends of each curve, (2 K, D).

        window : length of curve at the end to which a parabola is fitted; at least the last segment is used.
        """
        return kernels.end_tangents(self.points, self.bounds, float(window))

    def sampled(self, spacing: Floats, counts: Ints, to_end: Bools) -> tuple[Curves, Ints]:
        """Return evenly spaced samples along the curves, from the first point of each.

        Parameters
        ----------
        spacing, counts
            (K,) arc length between neighboring samples of each curve, and number of samples on it.
        to_end
            (K,) bool, True if the last of two samples or more is the last point of the curve exactly.

        Returns
        -------
        samples : as curves of `counts` points, S in all.
        segment : (S,) int, index within its curve of the segment of each sample.
        """
        starts, along = np.append(0, np.cumsum(counts)), arc_length(self.points)
        owner = np.repeat(np.arange(len(self)), counts)
        first, last = self.bounds[owner], self.bounds[owner + 1] - 1
        number = np.arange(len(owner)) - starts[owner]
        at = np.minimum(along[first] + number * spacing[owner], along[last])
        at = np.where(to_end[owner] & (number > 0) & (number == counts[owner] - 1), along[last], at)
        points = np.column_stack([np.interp(at, along, values) for values in self.points.T])
        row = np.clip(along.searchsorted(at, side="right") - 1, first, np.maximum(last - 1, first))
        return Curves(points, starts, self.closed), row - first

    def interpolate(self, curve: Ints, at: Floats) -> Floats:
        """Interpolate the points linearly at positions along curves.

        Parameters
        ----------
        curve
            int array of any shape, index of the curve of each position.
        at
            array of the same shape, position along the curve counted in points: 2.5 is half way between points 2 and 3.

        Returns
        -------
        (..., D), ... being the shape of `at`; NaN beyond the ends of an open curve. Positions on a ring, whose
        last point must repeat its first, wrap around.
        """
        count, at = self.counts[curve] - 1, np.where(np.isfinite(at), at, np.nan)
        at = np.where(self.closed[curve], at % np.maximum(count, 1), at)
        known = (count > 0) & (at >= 0) & (at <= count)
        number = np.where(known, np.minimum(at, count - 1), 0).astype(np.int64)
        row, t = self.bounds[curve] + number, (at - number)[..., None]
        between = self.points[row] * (1 - t) + self.points[np.minimum(row + 1, len(self.points) - 1)] * t
        return np.asarray(np.where(known[..., None], between, np.nan))

    def seen_in(self, view: Projection) -> Curves:
        """Return the curves projected to a view: (u, v, distance), NaN behind the camera."""
        return self.with_points(np.column_stack((view.project(self.points), view.distance(self.points))))


def runs(values: Bools) -> list[tuple[int, int]]:
    """Return the bounds (first, end) of each run of True: values[first:end] are True.

    values : (N,) bool.
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([False], values, [False])).astype(np.int8))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
