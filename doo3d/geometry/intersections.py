"""Where polylines in the view meet, and the places along them on both sides of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..types import Floats, Ints


@dataclass(frozen=True)
class Intersections:
    """C places where two strands meet in the view, first and second strand of each: (C, 2) arrays.

    chain : which. segment : of the chain. part : how far along the segment, 0 to 1. angle : (C,) radians between the two in
    the view, 0 to pi / 2. place : (C, 2) in the view.
    """

    chain: Ints
    segment: Ints
    t: Floats
    angle: Floats
    point: Floats


def find_intersections(lines: Sequence[Floats], closed: Sequence[bool]) -> Intersections:
    """Every proper intersection of polylines (N + 1, 2), in their order and along them; neighbours along one do not count.

    closed : per line, whether its last segment is followed by its first. Joints that are NaN cannot be seen.
    """
    counts = [len(line) - 1 for line in lines]
    chain = np.repeat(np.arange(len(lines)), counts)
    segment = np.concatenate([np.arange(count) for count in counts] or [np.zeros(0, dtype=int)])
    start = np.concatenate([line[:-1] for line in lines] or [np.zeros((0, 2))])
    step = np.concatenate([np.diff(line, axis=0) for line in lines] or [np.zeros((0, 2))])
    i, j = _near(start, step)
    gap = np.abs(segment[i] - segment[j])
    around = np.where(np.array(closed, dtype=bool), counts, np.iinfo(np.int64).max)[chain[i]]
    apart = (chain[i] != chain[j]) | (np.minimum(gap, around - gap) > 1)
    i, j = i[apart], j[apart]
    turn = _turn(step[i], step[j])
    apart = turn != 0
    i, j, turn = i[apart], j[apart], turn[apart]
    offset = start[j] - start[i]
    part = np.column_stack((_turn(offset, step[j]) / turn, _turn(offset, step[i]) / turn))
    hit = np.flatnonzero(((part >= 0) & (part < 1)).all(axis=1))
    hit = hit[np.lexsort((j[hit], i[hit]))]
    i, j, part = i[hit], j[hit], part[hit]
    size = np.linalg.norm(step[i], axis=1) * np.linalg.norm(step[j], axis=1)
    both = np.column_stack((i, j))
    angle = np.arcsin(np.clip(np.abs(turn[hit]) / size, 0, 1))
    return Intersections(chain[both], segment[both], part, angle, start[i] + part[:, :1] * step[i])


def _near(start: Floats, step: Floats) -> tuple[Ints, Ints]:
    """Pairs i < j of segments that may meet, for their middles are not farther apart than the longest of them is long."""
    known = np.flatnonzero(np.isfinite(start).all(axis=1) & np.isfinite(step).all(axis=1))
    if len(known) < 2:
        return known[:0], known[:0]
    reach = float(np.linalg.norm(step[known], axis=1).max())
    pairs = known[cKDTree(start[known] + step[known] / 2).query_pairs(1.000001 * reach, output_type="ndarray")]
    return pairs.min(axis=1), pairs.max(axis=1)


def _turn(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


@dataclass(frozen=True)
class PolylineSet:
    """Polylines one after the other, to be looked up at fractional joints.

    values : (J, K) at the joints of all. first : (L,) the row of each line's first joint. segments : (L,) how many each has.
    closed : (L,) bool.
    """

    values: Floats
    first: Ints
    segments: Ints
    closed: Ints

    @staticmethod
    def from_polylines(lines: Sequence[Floats], closed: Sequence[bool]) -> PolylineSet:
        """Of polylines (N + 1, K)."""
        sizes = np.array([len(line) for line in lines])
        first = np.concatenate(([0], np.cumsum(sizes)[:-1]))
        return PolylineSet(np.concatenate(lines), first, sizes - 1, np.array(closed, dtype=bool))

    def interpolate(self, line: Ints, joint: Floats) -> Floats:
        """Values (..., K) at places counted in joints (...); NaN beyond a line's ends, round and round where it is closed."""
        count = self.segments[line]
        inside = self.closed[line] | ((joint >= 0) & (joint <= count))
        joint = np.where(self.closed[line], joint % count, np.clip(joint, 0, count))
        index = np.minimum(joint.astype(int), count - 1)
        part = (joint - index)[..., None]
        row = self.first[line] + index
        return np.where(inside[..., None], self.values[row] * (1 - part) + self.values[row + 1] * part, np.nan)
