"""Intersections of polylines in the view, and values along polylines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..types import Floats, Ints


@dataclass(frozen=True)
class Intersections:
    """C intersections of polylines in the view; each is where one segment (column 0 of the arrays) crosses another (column 1).

    Attributes
    ----------
    chain
        (C, 2) int, index of the polyline that each of the two segments belongs to.
    segment
        (C, 2) int, index of each segment in its polyline.
    t
        (C, 2), position of the intersection along each segment, from 0 at its first joint to 1 at its second.
    angle
        (C,) radians between the two segments in the view, 0 to pi / 2.
    point
        (C, 2) position of the intersection in the view, in the unit of the polylines.
    """

    chain: Ints
    segment: Ints
    t: Floats
    angle: Floats
    point: Floats


def find_intersections(lines: Sequence[Floats], closed: Sequence[bool]) -> Intersections:
    """Find every point where two segments of some polylines cross in the view.

    Neighboring segments of one polyline, which share a joint, do not count. Segments with a NaN joint (not visible) are skipped.

    Parameters
    ----------
    lines
        polylines in the view, each (N + 1, 2) for N segments; there may be none.
    closed
        for each polyline, True if its last joint repeats its first, so that its last segment is a neighbor of its first.

    Returns
    -------
    The intersections, each once; `Intersections` with C = 0 if there are none. They are sorted by the first segment (in the
    order of the polylines and along them), then by the second.
    """
    counts = [len(line) - 1 for line in lines]
    chain = np.repeat(np.arange(len(lines)), counts)
    segment = np.concatenate([np.arange(count) for count in counts] or [np.zeros(0, dtype=int)])
    start = np.concatenate([line[:-1] for line in lines] or [np.zeros((0, 2))])
    step = np.concatenate([np.diff(line, axis=0) for line in lines] or [np.zeros((0, 2))])
    i, j = _candidate_pairs(start, step)
    gap = np.abs(segment[i] - segment[j])
    around = np.where(np.array(closed, dtype=bool), counts, np.iinfo(np.int64).max)[chain[i]]
    apart = (chain[i] != chain[j]) | (np.minimum(gap, around - gap) > 1)
    i, j = i[apart], j[apart]
    cross = _cross(step[i], step[j])
    apart = cross != 0
    i, j, cross = i[apart], j[apart], cross[apart]
    offset = start[j] - start[i]
    t = np.column_stack((_cross(offset, step[j]) / cross, _cross(offset, step[i]) / cross))
    hit = np.flatnonzero(((t >= 0) & (t < 1)).all(axis=1))
    hit = hit[np.lexsort((j[hit], i[hit]))]
    i, j, t = i[hit], j[hit], t[hit]
    size = np.linalg.norm(step[i], axis=1) * np.linalg.norm(step[j], axis=1)
    both = np.column_stack((i, j))
    angle = np.arcsin(np.clip(np.abs(cross[hit]) / size, 0, 1))
    return Intersections(chain[both], segment[both], t, angle, start[i] + t[:, :1] * step[i])


def _candidate_pairs(start: Floats, step: Floats) -> tuple[Ints, Ints]:
    """Return the pairs i < j of segments whose midpoints are not farther apart than the longest segment is long."""
    visible = np.flatnonzero(np.isfinite(start).all(axis=1) & np.isfinite(step).all(axis=1))
    if len(visible) < 2:
        return visible[:0], visible[:0]
    reach = float(np.linalg.norm(step[visible], axis=1).max())
    pairs = visible[cKDTree(start[visible] + step[visible] / 2).query_pairs(1.000001 * reach, output_type="ndarray")]
    return pairs.min(axis=1), pairs.max(axis=1)


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products (N,) of vectors (N, 2)."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


@dataclass(frozen=True)
class PolylineSet:
    """Values at the joints of L polylines, for interpolation between the joints.

    Attributes
    ----------
    values
        (J, K), K values at each of the J joints of all polylines, one polyline after the other.
    first
        (L,) int, row of each polyline's first joint in `values`.
    segments
        (L,) int, number of segments of each polyline.
    closed
        (L,) bool, True for a ring, whose last joint repeats the first.
    """

    values: Floats
    first: Ints
    segments: Ints
    closed: Ints

    @staticmethod
    def from_polylines(lines: Sequence[Floats], closed: Sequence[bool]) -> PolylineSet:
        """Return the set of some polylines.

        Parameters
        ----------
        lines
            L >= 1 arrays, each (N + 1, K): K values at each joint of a polyline of N segments.
        closed
            for each polyline, True if it is a ring, whose last joint repeats the first.
        """
        sizes = np.array([len(line) for line in lines])
        first = np.concatenate(([0], np.cumsum(sizes)[:-1]))
        return PolylineSet(np.concatenate(lines), first, sizes - 1, np.array(closed, dtype=bool))

    def interpolate(self, line: Ints, joint: Floats) -> Floats:
        """Interpolate the values linearly at positions along polylines.

        Parameters
        ----------
        line
            int array of any shape, index of the polyline of each position.
        joint
            array of the same shape, position along the polyline counted in joints: 2.5 is half way between joints 2 and 3.

        Returns
        -------
        (..., K), the K values at each position, ... being the shape of `joint`; NaN beyond the ends of an open polyline.
        Positions on a ring wrap around.
        """
        count = self.segments[line]
        inside = self.closed[line] | ((joint >= 0) & (joint <= count))
        joint = np.where(self.closed[line], joint % count, np.clip(joint, 0, count))
        index = np.minimum(joint.astype(int), count - 1)
        t = (joint - index)[..., None]
        row = self.first[line] + index
        return np.where(inside[..., None], self.values[row] * (1 - t) + self.values[row + 1] * t, np.nan)
