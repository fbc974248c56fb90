"""One line walked along on others: the likeliest place of each of its points there, and where their order breaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import minimum_filter1d
from scipy.spatial.distance import cdist

from ..types import Array, Floats, Ints

STEP = 2.0  # px from point to point of a line
SEAM = 3.0  # times what open lines are carried on by, that a closed one is followed into its second round
MISFIT, JUMP = 1.0, 20.0  # cost of a point at the edge of its tolerance, and of a jump
SLACK, SLACK_RUN = 2.0, 0.5  # tolerances, and share of the way, by which the ways along two lines may differ without a jump


@dataclass(frozen=True)
class Line:
    """A chain in the image as points STEP apart.

    points : (M, 2) px. arcs : (M,) px from the first. half : (M,) px, half the width, 0 where it is not known.
    closed : the last point is the first again.
    """

    points: Floats
    arcs: Floats
    half: Floats
    closed: bool = False


@dataclass(frozen=True)
class Walk:
    """A line along others.

    distance, tolerance : (M,) px, of each point to its place, or to the nearest where it has none; infinite where there
    are no others. line : (M,) the line that it goes along on; -1 where it has no place. arc : (M,) px along that.
    jumps : pairs of points, one after the other but for those without a place, that are not so on the others.
    """

    distance: Floats
    tolerance: Floats
    line: Ints
    arc: Floats
    jumps: tuple[tuple[int, int], ...]


def resampled(joints: Floats, half: Floats, closed: bool = False) -> Line:
    """(N + 1, 2) px and (N + 1,) px as a line."""
    if len(joints) < 2:
        return Line(joints, np.zeros(len(joints)), half, closed)
    arcs = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(joints, axis=0), axis=1))))
    at = np.linspace(0, arcs[-1], int(np.ceil(arcs[-1] / STEP)) + 1)
    points = np.column_stack([np.interp(at, arcs, column) for column in joints.T])
    return Line(points, at, np.interp(at, arcs, half), closed)


def walk(line: Line, others: Sequence[Line], beyond: float, least: float) -> Walk:
    """Walk `line` along on `others`.

    beyond : px by which the open ones are carried straight on at their ends. least : px, the tolerance, or half the width
    of either line where that is more.
    """
    walker = _round(line, SEAM * beyond) if line.closed else line
    tracks = [_round(other, float(other.arcs[-1])) if other.closed else _longer(other, beyond) for other in others]
    gaps = [cdist(walker.points, track.points) for track in tracks]
    allowed = [np.maximum(least, np.maximum(walker.half[:, None], track.half)) for track in tracks]
    distance, tolerance = _nearest(walker.points, tracks, gaps, allowed, least)
    on, arc = np.full(len(walker.points), -1), np.full(len(walker.points), np.nan)
    jumps: list[tuple[int, int]] = []
    places = _Places.of(walker, tracks, gaps, allowed)
    if len(places.point):
        chosen = _likeliest(places, walker.arcs)
        point = places.point[chosen]
        distance[point], tolerance[point] = places.distance[chosen], places.tolerance[chosen]
        on[point], arc[point] = places.track[chosen], places.arc[chosen]
        broken = _change(places, walker.arcs, chosen[:-1], chosen[1:]) >= JUMP
        jumps = [(int(point[i]), int(point[i + 1])) for i in np.flatnonzero(broken)]
    count = len(line.points)
    rounds = np.array([other.arcs[-1] if other.closed else np.inf for other in others] + [np.inf])
    arc = np.where(np.isfinite(rounds[on]), np.mod(arc, rounds[on]), arc)
    return Walk(distance[:count], tolerance[:count], on[:count], arc[:count], tuple((a % count, b % count) for a, b in jumps))


def _nearest(
    points: Floats, tracks: Sequence[Line], gaps: Sequence[Floats], allowed: Sequence[Floats], least: float
) -> tuple[Floats, Floats]:
    """(M,) px from each point to the nearest track, and the tolerance there; gaps, allowed : per track (M, T) px."""
    nearest, tolerance = np.full(len(points), np.inf), np.full(len(points), least)
    rows = np.arange(len(points))
    for track, gap, limit in zip(tracks, gaps, allowed, strict=True):
        if gap.size:
            place = gap.argmin(axis=1)
            _, distance = _beside(points, track, place)
            tolerance = np.where(distance < nearest, limit[rows, place], tolerance)
            nearest = np.minimum(distance, nearest)
    return nearest, tolerance


def _round(line: Line, length: float) -> Line:
    """A closed line and `length` px of its next round."""
    more = slice(1, 1 + int(np.ceil(length / STEP)))
    return Line(
        np.concatenate((line.points, line.points[more])),
        np.concatenate((line.arcs, line.arcs[-1] + line.arcs[more])),
        np.concatenate((line.half, line.half[more])),
        True,
    )


def _longer(line: Line, length: float) -> Line:
    """An open line carried straight on by `length` px at both ends."""
    if len(line.points) < 2:
        return line
    at = STEP * np.arange(1, round(length / STEP) + 1)
    back = min(len(line.points) - 1, max(1, len(at)))
    first, last = (line.points[0] - line.points[back]), (line.points[-1] - line.points[-1 - back])
    before = line.points[0] + np.outer(at[::-1], first / max(float(np.linalg.norm(first)), 1e-9))
    after = line.points[-1] + np.outer(at, last / max(float(np.linalg.norm(last)), 1e-9))
    half = np.ones(len(at))
    return Line(
        np.concatenate((before, line.points, after)),
        np.concatenate((-at[::-1], line.arcs, line.arcs[-1] + at)),
        np.concatenate((half * line.half[0], line.half, half * line.half[-1])),
    )


@dataclass(frozen=True)
class _Places:
    """Places that points may have, in the order of the points, (C,) each; every one twice, for it may be followed either way.

    sign : 1 where the track is followed forwards, -1 where backwards.
    """

    point: Ints
    track: Ints
    sign: Ints
    arc: Floats
    distance: Floats
    tolerance: Floats

    @staticmethod
    def of(walker: Line, tracks: Sequence[Line], gaps: Sequence[Floats], allowed: Sequence[Floats]) -> _Places:
        """All places on the tracks within the tolerances; gaps, allowed : per track (M, T) px."""
        columns: list[tuple[Array, ...]] = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0), np.zeros(0))]
        for number, (track, gap, limit) in enumerate(zip(tracks, gaps, allowed, strict=True)):
            if not gap.size:
                continue
            window = 2 * int(np.ceil(np.median(limit) / STEP)) + 1
            lowest = gap == minimum_filter1d(gap, window, axis=1, mode="nearest")
            point, place = np.nonzero(lowest & (gap <= limit + STEP))
            arc, distance = _beside(walker.points[point], track, place)
            limits = limit[point, place]
            near = distance <= limits
            columns.append(tuple(part[near] for part in (point, np.full(len(point), number), arc, distance, limits)))
        points, numbers, arcs, distances, tolerances = (np.tile(np.concatenate(parts), 2) for parts in zip(*columns, strict=True))
        order = np.argsort(points, kind="stable")
        signs = np.repeat((1, -1), len(points) // 2)[order]
        return _Places(points[order], numbers[order], signs, arcs[order], distances[order], tolerances[order])


def _beside(points: Floats, track: Line, place: Ints) -> tuple[Floats, Floats]:
    """px along the track, and px off it, of points near its points `place`."""
    tangent = np.gradient(track.points, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    offset = points - track.points[place]
    back, on = np.where(place == 0, 0.0, -STEP), np.where(place == len(track.points) - 1, 0.0, STEP)
    along = np.clip(np.einsum("ij,ij->i", offset, tangent[place]), back, on)
    return track.arcs[place] + along, np.linalg.norm(offset - along[:, None] * tangent[place], axis=1)


def _likeliest(places: _Places, arcs: Floats) -> Ints:
    """The place chosen for each point that has any.

    A point near a crossing has places on both strands: all are chosen together (Viterbi).
    """
    groups = np.split(np.arange(len(places.point)), np.flatnonzero(np.diff(places.point)) + 1)
    total = MISFIT * (places.distance / places.tolerance) ** 2
    before = np.full(len(total), -1)
    for last, this in pairwise(groups):
        sums = total[last][:, None] + _change(places, arcs, last[:, None], this[None])
        best = sums.argmin(axis=0)
        before[this] = last[best]
        total[this] += sums[best, np.arange(len(this))]
    chosen = [int(groups[-1][total[groups[-1]].argmin()])]
    while before[chosen[-1]] >= 0:
        chosen.append(int(before[chosen[-1]]))
    return np.array(chosen[::-1])


def _change(places: _Places, arcs: Floats, a: Ints, b: Ints) -> Floats:
    """The cost of going from place a to place b, up to JUMP, which is one."""
    run = arcs[places.point[b]] - arcs[places.point[a]]
    more = np.abs(places.sign[a] * (places.arc[b] - places.arc[a]) - run)
    slack = SLACK_RUN * run + SLACK * np.maximum(places.tolerance[a], places.tolerance[b])
    other = (places.track[a] != places.track[b]) | (places.sign[a] != places.sign[b])
    return np.asarray(JUMP * np.where(other, 1.0, np.minimum((more / slack) ** 2, 1.0)))
