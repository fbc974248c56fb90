"""Gap paths of an arc, a straight line and an arc (Dubins path, CSC): the loops of `doo3d.geometry.gap_path`.

Inside, a vector is a tuple of three numbers; in 2-D, `planar`, the third is 0. An arc is a tuple of its start, the unit direction
there, the unit normal it bends towards, its angle in radians, and its radius. Outside, vectors are arrays, and an arc is a row of
3 D + 2 numbers in that order.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from ._jit import helper

MAX_ITERATIONS = 200
"""Iterations of the fixed points at most."""

TOLERANCE = 1e-13
"""Change, relative to the gap, below which a fixed point counts as reached."""

BISECTIONS = 3
"""Of the step of sqrt 2 in which a radius is searched for: to 5 percent."""

MAX_RADIUS_STEPS = 40
"""Steps of sqrt 2 by which a radius is made smaller at most: to a millionth."""

TINY = 1e-12
"""Length, relative to the gap, that counts as none."""


@helper
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@helper
def _norm(a):  # type: ignore[no-untyped-def]
    return math.sqrt(_dot(a, a))


@helper
def _add(a, b, factor):  # type: ignore[no-untyped-def]
    """Return a + factor b."""
    return (a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2])


@helper
def _unit(a):  # type: ignore[no-untyped-def]
    norm = _norm(a)
    return (a[0] / norm, a[1] / norm, a[2] / norm) if norm > 0 else a


@helper
def _angle(a, b):  # type: ignore[no-untyped-def]
    """As `geometry.polyline.angle`."""
    a, b = _unit(a), _unit(b)
    return 2 * math.atan2(_norm(_add(a, b, -1.0)), _norm(_add(a, b, 1.0)))


@helper
def _perpendicular(direction, planar):  # type: ignore[no-untyped-def]
    """As `geometry.polyline.perpendicular`."""
    x, y, z = abs(direction[0]), abs(direction[1]), abs(direction[2])
    axis = (1.0, 0.0, 0.0)
    if y < x and (planar or y <= z):
        axis = (0.0, 1.0, 0.0)
    elif not planar and z < x and z < y:
        axis = (0.0, 0.0, 1.0)
    return _unit(_add(axis, direction, -_dot(axis, direction)))


@helper
def _vector(array):  # type: ignore[no-untyped-def]
    """Return an array (D,) as a tuple of three."""
    return (array[0], array[1], array[2] if array.size == 3 else 0.0)


@helper
def _write_arc(arc, row):  # type: ignore[no-untyped-def]
    """Write an arc into a row of 3 D + 2 numbers."""
    start, direction, normal, angle, radius = arc
    dim = row.size // 3
    for d in range(dim):
        row[d], row[dim + d], row[2 * dim + d] = start[d], direction[d], normal[d]
    row[3 * dim], row[3 * dim + 1] = angle, radius


@helper
def _point_at(arc, angle):  # type: ignore[no-untyped-def]
    """Return the point of an arc after turning by an angle."""
    start, direction, normal, _, radius = arc
    along, across = math.sin(angle), 1 - math.cos(angle)
    return (
        start[0] + radius * (along * direction[0] + across * normal[0]),
        start[1] + radius * (along * direction[1] + across * normal[1]),
        start[2] + radius * (along * direction[2] + across * normal[2]),
    )


@helper
def _end(arc):  # type: ignore[no-untyped-def]
    return _point_at(arc, arc[3])


@helper
def _end_direction(arc):  # type: ignore[no-untyped-def]
    c, s, d, n = math.cos(arc[3]), math.sin(arc[3]), arc[1], arc[2]
    return (c * d[0] + s * n[0], c * d[1] + s * n[1], c * d[2] + s * n[2])


@helper
def _arc_towards(start, direction, target, radius, opposite, planar):  # type: ignore[no-untyped-def]
    """Return whether there is an arc that leaves `start` in `direction` and ends pointing at `target`, and the arc."""
    step = _add(target, start, -1.0)
    x = _dot(step, direction)
    across = _add(step, direction, -x)
    y = _norm(across)
    if y <= TINY * max(_norm(step), 1e-300):
        normal = _perpendicular(direction, planar)
        if x >= 0:
            return True, (start, direction, normal, 0.0, radius)
        y = 0.0
    else:
        normal = (across[0] / y, across[1] / y, across[2] / y)
    if opposite:
        normal, y = (-normal[0], -normal[1], -normal[2]), -y
    tangent2 = x * x + (y - radius) ** 2 - radius * radius
    if tangent2 < 0:
        return False, (start, direction, normal, 0.0, radius)
    theta = (math.atan2(y - radius, x) + math.atan2(radius, math.sqrt(tangent2))) % (2 * math.pi)
    return True, (start, direction, normal, 0.0 if theta > 2 * math.pi - 1e-9 else theta, radius)


@numba.njit(cache=True)
def arc_towards(start, direction, target, radius, opposite):  # type: ignore[no-untyped-def]
    """Find the arc that leaves a point in a direction and ends pointing straight at a target.

    Parameters
    ----------
    start, direction, target
        (D,) float64; the direction is a unit vector
    radius
        of the arc, in the unit of the points
    opposite
        bool, whether the arc bends to the side where the target is not

    Returns
    -------
    (A, 3 D + 2) float64, A in {0, 1}: start, direction, normal, angle, radius; none if the target is inside the circle
    """
    dim = start.size
    found, arc = _arc_towards(_vector(start), _vector(direction), _vector(target), radius, opposite, dim == 2)
    rows = np.empty((1 if found else 0, 3 * dim + 2))
    if found:
        _write_arc(arc, rows[0])
    return rows


@helper
def _length(first, second):  # type: ignore[no-untyped-def]
    """Return the length of an arc, a line and an arc."""
    return first[4] * (first[3] + second[3]) + _norm(_add(_end(second), _end(first), -1.0))


@helper
def _by_aiming(e1, d1, e2, d2, radius, inside, planar):  # type: ignore[no-untyped-def]
    """Find two arcs by aiming each at the end of the other in turn; return whether there are any, and the arcs.

    The iteration finds arcs of any angle, but no paths whose first arc reaches around the end that it is aimed at first.
    """
    scale = _norm(_add(e2, e1, -1.0))
    target = e2
    change = math.inf
    first = second = (e1, d1, d1, 0.0, radius)
    for _ in range(MAX_ITERATIONS):
        found, first = _arc_towards(e1, d1, target, radius, inside, planar)
        if not found:
            return False, first, second
        found, second = _arc_towards(e2, d2, _end(first), radius, inside, planar)
        if not found:
            return False, first, second
        end = _end(second)
        change = _norm(_add(end, target, -1.0))
        target = end
        if change <= TOLERANCE * scale:
            break
    direction = _end_direction(first)
    straight = change <= 1e-6 * scale and _dot(direction, _end_direction(second)) <= 1e-9 - 1
    return straight and _dot(_add(target, _end(first), -1.0), direction) >= -1e-9 * scale, first, second


@helper
def _arc_between(start, direction, end_direction, radius, planar):  # type: ignore[no-untyped-def]
    """Return the arc from `start` that turns from one unit direction to another."""
    across = _add(end_direction, direction, -_dot(end_direction, direction))
    if across[0] == 0 and across[1] == 0 and across[2] == 0:
        return (start, direction, _perpendicular(direction, planar), 0.0, radius)
    return (start, direction, _unit(across), _angle(direction, end_direction), radius)


@helper
def _by_corners(e1, d1, e2, d2, radius, planar):  # type: ignore[no-untyped-def]
    """Find two arcs by the corners where the end lines meet the straight line; return whether there are any, and the arcs.

    A corner lies r tan(angle / 2) ahead of its end. Corners and direction of the line are computed from each other in turn. The
    iteration finds paths with large arcs, but no angles of nearly 180 degrees.
    """
    none = (e1, d1, d1, 0.0, radius)
    gap = _add(e2, e1, -1.0)
    scale = _norm(gap)
    line, length, ahead = (gap[0] / scale, gap[1] / scale, gap[2] / scale), scale, 0.0
    change = math.inf
    for _ in range(MAX_ITERATIONS):
        cosine1, cosine2 = _dot(d1, line), -_dot(d2, line)
        if min(cosine1, cosine2) < -0.999:
            return False, none, none
        ahead1 = radius * math.sqrt(max(0.0, 1 - cosine1) / (1 + cosine1))
        ahead2 = radius * math.sqrt(max(0.0, 1 - cosine2) / (1 + cosine2))
        between = _add(_add(gap, d2, ahead2), d1, -ahead1)
        length, ahead = _norm(between), ahead1 + ahead2
        if length <= TINY * scale:
            return False, none, none
        before, line = line, (between[0] / length, between[1] / length, between[2] / length)
        change = _norm(_add(line, before, -1.0))
        if change <= TOLERANCE:
            break
    if change > 1e-10 or length < ahead - 1e-9 * scale:
        return False, none, none
    back = (-line[0], -line[1], -line[2])
    return True, _arc_between(e1, d1, line, radius, planar), _arc_between(e2, d2, back, radius, planar)


@helper
def _arc_line_arc(e1, d1, e2, d2, radius, inside, planar):  # type: ignore[no-untyped-def]
    """Return whether an arc, a line and an arc of a radius join two ends, and the arcs; the shorter path of both orders."""
    forward, first, second = _by_aiming(e1, d1, e2, d2, radius, inside, planar)
    backward, last, before = _by_aiming(e2, d2, e1, d1, radius, inside, planar)
    if forward and (not backward or _length(first, second) <= _length(last, before) * (1 + 1e-9)):
        return True, first, second
    if backward or inside:
        return backward, before, last
    return _by_corners(e1, d1, e2, d2, radius, planar)


@helper
def _rows(found, first, second, dim):  # type: ignore[no-untyped-def]
    """Return two arcs as rows (2, 3 D + 2), or (0, 3 D + 2) if none were found."""
    rows = np.empty((2 if found else 0, 3 * dim + 2))
    if found:
        _write_arc(first, rows[0])
        _write_arc(second, rows[1])
    return rows


@numba.njit(cache=True)
def arc_line_arc(ends, radius, inside):  # type: ignore[no-untyped-def]
    """Join two ends by an arc, a straight line and an arc of one radius.

    Parameters
    ----------
    ends
        (4, D) float64: an end, its outward unit direction, the other end, its outward unit direction
    radius
        of both arcs, in the unit of the ends
    inside
        bool, whether the arcs bend to the side where their targets are not

    Returns
    -------
    (A, 3 D + 2) float64, A in {0, 2}: start, direction, normal, angle, radius of the arc at either end, both pointing into the
    gap, with the line between the ends of the arcs; none if no path of this radius was found
    """
    dim = ends.shape[1]
    e1, d1, e2, d2 = _vector(ends[0]), _vector(ends[1]), _vector(ends[2]), _vector(ends[3])
    found, first, second = _arc_line_arc(e1, d1, e2, d2, radius, inside, dim == 2)
    return _rows(found, first, second, dim)


@helper
def _corner_radius(e1, d1, e2, d2):  # type: ignore[no-untyped-def]
    cosine = _dot(d1, d2)
    sine2 = 1 - cosine * cosine
    if sine2 < 1e-12:
        return -1.0
    gap = _add(e2, e1, -1.0)
    a = (_dot(gap, d1) - cosine * _dot(gap, d2)) / sine2
    b = (cosine * _dot(gap, d1) - _dot(gap, d2)) / sine2
    if a <= 0 or b <= 0:
        return -1.0
    return min(a, b) / math.tan(_angle(d1, (-d2[0], -d2[1], -d2[2])) / 2)


@numba.njit(cache=True)
def corner_radius(ends):  # type: ignore[no-untyped-def]
    """Return the radius of the largest circle that touches both end lines ahead of the ends; -1 if they do not meet there.

    ends : (4, D) float64, as for `arc_line_arc`. Lines that are skew meet where they are closest.
    """
    return _corner_radius(_vector(ends[0]), _vector(ends[1]), _vector(ends[2]), _vector(ends[3]))


@helper
def _within_deviation(e1, d1, e2, d2, radius, max_deviation, inside, planar):  # type: ignore[no-untyped-def]
    """Join two ends as `_arc_line_arc` does, if the line deviates from the straight connection by at most `max_deviation`."""
    found, first, second = _arc_line_arc(e1, d1, e2, d2, radius, inside, planar)
    if found:
        line, gap = _add(_end(second), _end(first), -1.0), _add(e2, e1, -1.0)
        found = _norm(line) <= 1e-9 * _norm(gap) or _angle(line, gap) <= max_deviation
    return found, first, second


@helper
def _with_largest_radius(e1, d1, e2, d2, radius, max_deviation, inside, planar):  # type: ignore[no-untyped-def]
    """Join two ends with about the largest radius up to `radius` for which there is a path within `max_deviation`."""
    found, first, second = _within_deviation(e1, d1, e2, d2, radius, max_deviation, inside, planar)
    if found:
        return found, first, second
    for _ in range(MAX_RADIUS_STEPS):
        radius /= math.sqrt(2.0)
        found, first, second = _within_deviation(e1, d1, e2, d2, radius, max_deviation, inside, planar)
        if found:
            break
    factor = 2**0.25
    for _ in range(BISECTIONS):
        larger, one, other = _within_deviation(e1, d1, e2, d2, radius * factor, max_deviation, inside, planar)
        if larger:
            found, first, second, radius = True, one, other, radius * factor
        factor = math.sqrt(factor)
    return found, first, second


@numba.njit(cache=True)
def solve_gap(ends, radius, max_deviation, inside):  # type: ignore[no-untyped-def]
    """Return the arcs of the path across a gap: an arc, a straight line, an arc, tangent to both ends.

    The radius is that of `corner_radius` where the end lines meet ahead of both ends; elsewhere it is the given one, or the
    largest, up to half the gap, whose line keeps within `max_deviation`. A radius for which there is no path is made smaller in
    steps of sqrt 2 until there is one, and then larger again by bisection.

    Parameters
    ----------
    ends
        (4, D) float64: an end, its outward direction, the other end, its outward direction
    radius
        of the arcs where it is free, in the unit of the ends; 0 to choose it
    max_deviation
        rad, between the line and the straight connection of the ends, where the radius is chosen
    inside
        bool, whether ends that point away from each other are joined through the inside of the gap

    Returns
    -------
    touch : bool, whether the ends touch
    arcs : (A, 3 D + 2) float64, A in {0, 2}, as for `arc_line_arc`; none where only the straight connection is left
    """
    dim = ends.shape[1]
    e1, d1, e2, d2 = _vector(ends[0]), _unit(_vector(ends[1])), _vector(ends[2]), _unit(_vector(ends[3]))
    step = _add(e2, e1, -1.0)
    gap = _norm(step)
    if gap < TINY:
        return True, np.empty((0, 3 * dim + 2))
    corner = _corner_radius(e1, d1, e2, d2)
    inside = inside and max(_dot(d1, step), -_dot(d2, step)) < 0
    if corner > 0:
        radius, max_deviation, inside = corner, math.pi, False
    elif radius > 0:
        max_deviation = math.pi
    else:
        radius = gap / 2
    found, first, second = _with_largest_radius(e1, d1, e2, d2, radius, max_deviation, inside, dim == 2)
    return False, _rows(found, first, second, dim)


@helper
def _read_arc(row):  # type: ignore[no-untyped-def]
    """Return the arc in a row of 3 D + 2 numbers."""
    dim = row.size // 3
    start, direction, normal = _vector(row[:dim]), _vector(row[dim : 2 * dim]), _vector(row[2 * dim : 3 * dim])
    return (start, direction, normal, row[3 * dim], row[3 * dim + 1])


@helper
def _count_steps(arc, spacing):  # type: ignore[no-untyped-def]
    return max(1, math.ceil(arc[3] * arc[4] / spacing)) if arc[3] > 0 else 0


@numba.njit(cache=True)
def sample_gap(arcs, spacing):  # type: ignore[no-untyped-def]
    """Return points along an arc, a line and an arc, at most `spacing` apart on each, both ends included.

    arcs : (2, 3 D + 2) float64, as `solve_gap` returns them. spacing : in the unit of the arcs. Returns (P, D) float64, P >= 2.
    """
    first, second, dim = _read_arc(arcs[0]), _read_arc(arcs[1]), arcs.shape[1] // 3
    out, back = _end(first), _end(second)
    before, after = _count_steps(first, spacing), _count_steps(second, spacing)
    between = max(1, math.ceil(_norm(_add(back, out, -1.0)) / spacing))
    points = np.empty((before + between + after + 1, dim))
    for i in range(len(points)):
        if i < before:
            point = _point_at(first, i * (first[3] / before))
        elif i == before:
            point = out
        elif i < before + between:
            point = _add(out, _add(back, out, -1.0), (i - before) / between)
        elif i == before + between:
            point = back
        else:
            point = _point_at(second, (len(points) - 1 - i) * (second[3] / after))
        for d in range(dim):
            points[i, d] = point[d]
    return points
