"""Align a chain in the image with other chains: the position of each of its points on them, and where their order breaks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from ...geometry.curve_alignment import JUMP, Candidates, nearest_samples
from ...types import Array, Floats, Ints

SAMPLE_SPACING_PX = 2.0
"""Distance in px between the points of a line."""

CLOSED_OVERLAP_FACTOR = 3.0
"""Length by which a closed line is continued into its second round, in multiples of the extension of open lines."""

SLACK_TOLERANCES = 2.0
"""Allowed difference between the lengths of a step along two lines, in tolerances, in addition to a fraction of the step."""


@dataclass(frozen=True)
class Line:
    """A chain in the image as M points at most 2 px apart.

    Attributes
    ----------
    points
        (M, 2) px.
    arcs
        (M,) px, length along the line from its first point.
    half_width
        (M,) px, half the object's width at each point; 0 if unknown.
    closed
        whether the line is a ring; its last point then repeats the first.
    """

    points: Floats
    arcs: Floats
    half_width: Floats
    closed: bool = False


@dataclass(frozen=True)
class LineAlignment:
    """The position on other lines of each of the M points of a line.

    Attributes
    ----------
    distance
        (M,) px from the point to its position on another line, or to the nearest line if it has no position; infinite if there
        are no other lines.
    tolerance
        (M,) px, the distance allowed at each point.
    line
        (M,) int, index of the other line that the position is on; -1 if the point has no position.
    arc
        (M,) px, length along the other line from its first point to the position; NaN if the point has no position.
    jumps
        (i, j) for each jump: indices of successive points of this line whose positions are not successive on another line.
    """

    distance: Floats
    tolerance: Floats
    line: Ints
    arc: Floats
    jumps: tuple[tuple[int, int], ...]


def resample_line(joints: Floats, half_width: Floats, closed: bool = False) -> Line:
    """Return a polyline in the image as evenly spaced points, at most 2 px apart.

    Parameters
    ----------
    joints
        (N + 1, 2) px, the points of a polyline of N segments; a ring repeats its first joint at the end.
    half_width
        (N + 1,) px, half the object's width at each joint; 0 if unknown.
    closed
        whether the polyline is a ring.

    Returns
    -------
    Line
        the points, with arc lengths and interpolated half widths; the joints as they are if there are fewer than two.
    """
    if len(joints) < 2:
        return Line(joints, np.zeros(len(joints)), half_width, closed)
    arcs = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(joints, axis=0), axis=1))))
    sample_arcs = np.linspace(0, arcs[-1], int(np.ceil(arcs[-1] / SAMPLE_SPACING_PX)) + 1)
    points = np.column_stack([np.interp(sample_arcs, arcs, column) for column in joints.T])
    return Line(points, sample_arcs, np.interp(sample_arcs, arcs, half_width), closed)


def align_line(line: Line, others: Sequence[Line], extension: float, min_tolerance: float) -> LineAlignment:
    """Match each point of a line to a position on one of several other lines, and find where the match jumps.

    The match jumps where it goes to another line, or to another place on the same line.

    Parameters
    ----------
    line
        the line whose M points are matched.
    others
        the lines that they are matched to.
    extension
        length in px by which each open line in `others` is extended straight at both ends.
    min_tolerance
        least tolerance in px. The distance allowed between a point and its match is the largest of this and the half-widths of
        the two lines there.

    Returns
    -------
    LineAlignment
        distance, tolerance, line index and arc length for each point of `line`, and the jumps.

    Notes
    -----
    The matches of all points are chosen together, at the least total cost (Viterbi), so that they follow each other along the
    other lines, forwards or backwards.
    """
    path = _with_second_round(line, CLOSED_OVERLAP_FACTOR * extension) if line.closed else line
    curves = [
        _with_second_round(other, float(other.arcs[-1])) if other.closed else _extended(other, extension) for other in others
    ]
    distances = [cdist(path.points, curve.points) for curve in curves]
    tolerances = [np.maximum(min_tolerance, np.maximum(path.half_width[:, None], curve.half_width)) for curve in curves]
    distance, tolerance = _nearest_curve(path.points, curves, distances, tolerances, min_tolerance)
    curve_index, arc = np.full(len(path.points), -1), np.full(len(path.points), np.nan)
    jumps: list[tuple[int, int]] = []
    candidates = _candidates(path, curves, distances, tolerances)
    if len(candidates.point):
        chosen = candidates.choose()
        point = candidates.point[chosen]
        distance[point], tolerance[point] = candidates.distance[chosen], candidates.tolerance[chosen]
        curve_index[point], arc[point] = candidates.curve[chosen], candidates.arc[chosen]
        broken = candidates.step_cost(chosen[:-1], chosen[1:]) >= JUMP
        jumps = [(int(point[i]), int(point[i + 1])) for i in np.flatnonzero(broken)]
    count = len(line.points)
    rounds = np.array([other.arcs[-1] if other.closed else np.inf for other in others] + [np.inf])
    arc = np.where(np.isfinite(rounds[curve_index]), np.mod(arc, rounds[curve_index]), arc)
    return LineAlignment(
        distance[:count], tolerance[:count], curve_index[:count], arc[:count], tuple((a % count, b % count) for a, b in jumps)
    )


def _nearest_curve(
    points: Floats, curves: Sequence[Line], distances: Sequence[Floats], tolerances: Sequence[Floats], min_tolerance: float
) -> tuple[Floats, Floats]:
    """Return the distance (M,) px of each point from the nearest curve, and the tolerance (M,) px there.

    distances, tolerances : for each curve of T points (M, T) px.
    """
    nearest, tolerance = np.full(len(points), np.inf), np.full(len(points), min_tolerance)
    rows = np.arange(len(points))
    for curve, gap, limit in zip(curves, distances, tolerances, strict=True):
        if gap.size:
            sample = gap.argmin(axis=1)
            _, distance = _project(points, curve, sample)
            tolerance = np.where(distance < nearest, limit[rows, sample], tolerance)
            nearest = np.minimum(distance, nearest)
    return nearest, tolerance


def _with_second_round(line: Line, length: float) -> Line:
    """Return a closed line, continued into its next round by `length` px."""
    more = slice(1, 1 + int(np.ceil(length / SAMPLE_SPACING_PX)))
    return Line(
        np.concatenate((line.points, line.points[more])),
        np.concatenate((line.arcs, line.arcs[-1] + line.arcs[more])),
        np.concatenate((line.half_width, line.half_width[more])),
        True,
    )


def _extended(line: Line, length: float) -> Line:
    """Return an open line extended straight on by `length` px at both ends."""
    if len(line.points) < 2:
        return line
    arcs = SAMPLE_SPACING_PX * np.arange(1, round(length / SAMPLE_SPACING_PX) + 1)
    back = min(len(line.points) - 1, max(1, len(arcs)))
    first, last = (line.points[0] - line.points[back]), (line.points[-1] - line.points[-1 - back])
    before = line.points[0] + np.outer(arcs[::-1], first / max(float(np.linalg.norm(first)), 1e-9))
    after = line.points[-1] + np.outer(arcs, last / max(float(np.linalg.norm(last)), 1e-9))
    ones = np.ones(len(arcs))
    return Line(
        np.concatenate((before, line.points, after)),
        np.concatenate((-arcs[::-1], line.arcs, line.arcs[-1] + arcs)),
        np.concatenate((ones * line.half_width[0], line.half_width, ones * line.half_width[-1])),
    )


def _candidates(path: Line, curves: Sequence[Line], distances: Sequence[Floats], tolerances: Sequence[Floats]) -> Candidates:
    """Return all positions on the curves within the tolerances, each in both directions.

    distances, tolerances : for each curve of T points (M, T) px.
    """
    columns: list[tuple[Array, ...]] = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0), np.zeros(0))]
    for number, (curve, gap, limit) in enumerate(zip(curves, distances, tolerances, strict=True)):
        if not gap.size:
            continue
        half_window = int(np.ceil(np.median(limit) / SAMPLE_SPACING_PX))
        point, sample = nearest_samples(gap, limit + SAMPLE_SPACING_PX, half_window)
        arc, distance = _project(path.points[point], curve, sample)
        limits = limit[point, sample]
        near = distance <= limits
        columns.append(tuple(part[near] for part in (point, np.full(len(point), number), arc, distance, limits)))
    points, numbers, arcs, distance, tolerance = (np.tile(np.concatenate(parts), 2) for parts in zip(*columns, strict=True))
    order = np.argsort(points, kind="stable")
    return Candidates(
        point=points[order],
        curve=numbers[order],
        arc=arcs[order],
        distance=distance[order],
        tolerance=tolerance[order],
        slack=SLACK_TOLERANCES * tolerance[order],
        direction=np.repeat((1, -1), len(points) // 2)[order],
        period=np.full(len(points), np.inf),
        path_position=path.arcs[points[order]],
    )


def _project(points: Floats, curve: Line, samples: Ints) -> tuple[Floats, Floats]:
    """Return the arc length along a curve of points near its samples, px, and their distance from the curve, px."""
    tangent = np.gradient(curve.points, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    offset = points - curve.points[samples]
    low = np.where(samples == 0, 0.0, -SAMPLE_SPACING_PX)
    high = np.where(samples == len(curve.points) - 1, 0.0, SAMPLE_SPACING_PX)
    along = np.clip(np.einsum("ij,ij->i", offset, tangent[samples]), low, high)
    return curve.arcs[samples] + along, np.linalg.norm(offset - along[:, None] * tangent[samples], axis=1)
