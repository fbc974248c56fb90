"""Arc, straight line, arc of one radius between two ends: what `doo3d.geometry.arcs` is made of.

Vectors are tuples of three numbers; in the plane, `flat`, the third is 0. A turn is where it starts, its direction there, the
normal it bends towards, its angle in radians, and its radius.
"""

from __future__ import annotations

import math

import numba
import numpy as np

ROUNDS = 200
CONVERGED = 1e-13
BISECTIONS = 3
"""Of the step of sqrt 2 in which a radius is searched for: to 5 percent."""
TINY = 1e-12

_inner = numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""For what kernels alone call: a third less to compile."""


@_inner
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@_inner
def _norm(a):  # type: ignore[no-untyped-def]
    return math.sqrt(_dot(a, a))


@_inner
def _plus(a, b, times):  # type: ignore[no-untyped-def]
    return (a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2])


@_inner
def _unit(a):  # type: ignore[no-untyped-def]
    norm = _norm(a)
    return (a[0] / norm, a[1] / norm, a[2] / norm) if norm > 0 else a


@_inner
def _angle(a, b):  # type: ignore[no-untyped-def]
    """As `geometry.angle`."""
    a, b = _unit(a), _unit(b)
    return 2 * math.atan2(_norm(_plus(a, b, -1.0)), _norm(_plus(a, b, 1.0)))


@_inner
def _perpendicular(direction, flat):  # type: ignore[no-untyped-def]
    """As `geometry.perpendicular`."""
    x, y, z = abs(direction[0]), abs(direction[1]), abs(direction[2])
    axis = (1.0, 0.0, 0.0)
    if y < x and (flat or y <= z):
        axis = (0.0, 1.0, 0.0)
    elif not flat and z < x and z < y:
        axis = (0.0, 0.0, 1.0)
    return _unit(_plus(axis, direction, -_dot(axis, direction)))


@_inner
def _at(turn, turned):  # type: ignore[no-untyped-def]
    """The place on an arc after turning by so much."""
    start, direction, normal, _, radius = turn
    along, across = math.sin(turned), 1 - math.cos(turned)
    return (
        start[0] + radius * (along * direction[0] + across * normal[0]),
        start[1] + radius * (along * direction[1] + across * normal[1]),
        start[2] + radius * (along * direction[2] + across * normal[2]),
    )


@_inner
def _end(turn):  # type: ignore[no-untyped-def]
    return _at(turn, turn[3])


@_inner
def _heading(turn):  # type: ignore[no-untyped-def]
    c, s, d, n = math.cos(turn[3]), math.sin(turn[3]), turn[1], turn[2]
    return (c * d[0] + s * n[0], c * d[1] + s * n[1], c * d[2] + s * n[2])


@numba.njit(cache=True)
def turn_towards(start, direction, target, radius, inside, flat):  # type: ignore[no-untyped-def]
    """Whether there is an arc that leaves `start` in `direction` and ends heading for `target`, and it."""
    way = _plus(target, start, -1.0)
    x = _dot(way, direction)
    across = _plus(way, direction, -x)
    y = _norm(across)
    if y <= TINY * max(_norm(way), 1e-300):
        normal = _perpendicular(direction, flat)
        if x >= 0:
            return True, (start, direction, normal, 0.0, radius)
        y = 0.0
    else:
        normal = (across[0] / y, across[1] / y, across[2] / y)
    if inside:
        normal, y = (-normal[0], -normal[1], -normal[2]), -y
    reach2 = x * x + (y - radius) ** 2 - radius * radius
    if reach2 < 0:
        return False, (start, direction, normal, 0.0, radius)
    theta = (math.atan2(y - radius, x) + math.atan2(radius, math.sqrt(reach2))) % (2 * math.pi)
    return True, (start, direction, normal, 0.0 if theta > 2 * math.pi - 1e-9 else theta, radius)


@_inner
def _length(first, second):  # type: ignore[no-untyped-def]
    return first[4] * (first[3] + second[3]) + _norm(_plus(_end(second), _end(first), -1.0))


@_inner
def _aimed(e1, d1, e2, d2, radius, inside, flat):  # type: ignore[no-untyped-def]
    """The member of the family found by aiming each arc at the end of the other in turn: whether there is one, and it.

    It finds turns of any angle, but not members whose first arc reaches round the end that it is aimed at first.
    """
    scale = _norm(_plus(e2, e1, -1.0))
    target = e2
    moved = math.inf
    first = second = (e1, d1, d1, 0.0, radius)
    for _ in range(ROUNDS):
        found, first = turn_towards(e1, d1, target, radius, inside, flat)
        if not found:
            return False, first, second
        found, second = turn_towards(e2, d2, _end(first), radius, inside, flat)
        if not found:
            return False, first, second
        end = _end(second)
        moved = _norm(_plus(end, target, -1.0))
        target = end
        if moved <= CONVERGED * scale:
            break
    heading = _heading(first)
    straight = moved <= 1e-6 * scale and _dot(heading, _heading(second)) <= 1e-9 - 1
    return straight and _dot(_plus(target, _end(first), -1.0), heading) >= -1e-9 * scale, first, second


@_inner
def _bent(start, direction, heading, radius, flat):  # type: ignore[no-untyped-def]
    """The arc from `start` that turns from one unit direction to another."""
    across = _plus(heading, direction, -_dot(heading, direction))
    if across[0] == 0 and across[1] == 0 and across[2] == 0:
        return (start, direction, _perpendicular(direction, flat), 0.0, radius)
    return (start, direction, _unit(across), _angle(direction, heading), radius)


@_inner
def _cornered(e1, d1, e2, d2, radius, flat):  # type: ignore[no-untyped-def]
    """The member of the family found by its two corners, where the end lines meet the line, in turn with its direction.

    A corner lies r tan(turn / 2) ahead of its end. It finds members with large arcs, but no turns of nearly 180 degrees.
    """
    none = (e1, d1, d1, 0.0, radius)
    way = _plus(e2, e1, -1.0)
    scale = _norm(way)
    line, length, ahead = (way[0] / scale, way[1] / scale, way[2] / scale), scale, 0.0
    moved = math.inf
    for _ in range(ROUNDS):
        cosine1, cosine2 = _dot(d1, line), -_dot(d2, line)
        if min(cosine1, cosine2) < -0.999:
            return False, none, none
        ahead1 = radius * math.sqrt(max(0.0, 1 - cosine1) / (1 + cosine1))
        ahead2 = radius * math.sqrt(max(0.0, 1 - cosine2) / (1 + cosine2))
        between = _plus(_plus(way, d2, ahead2), d1, -ahead1)
        length, ahead = _norm(between), ahead1 + ahead2
        if length <= TINY * scale:
            return False, none, none
        before, line = line, (between[0] / length, between[1] / length, between[2] / length)
        moved = _norm(_plus(line, before, -1.0))
        if moved <= CONVERGED:
            break
    if moved > 1e-10 or length < ahead - 1e-9 * scale:
        return False, none, none
    return True, _bent(e1, d1, line, radius, flat), _bent(e2, d2, (-line[0], -line[1], -line[2]), radius, flat)


@numba.njit(cache=True)
def connect(e1, d1, e2, d2, radius, inside, flat):  # type: ignore[no-untyped-def]
    """Whether there are an arc, a line and an arc of one radius between two ends, and the arcs."""
    there, first, second = _aimed(e1, d1, e2, d2, radius, inside, flat)
    back, last, before = _aimed(e2, d2, e1, d1, radius, inside, flat)
    if there and (not back or _length(first, second) <= _length(last, before) * (1 + 1e-9)):
        return True, first, second
    if back or inside:
        return back, before, last
    return _cornered(e1, d1, e2, d2, radius, flat)


@numba.njit(cache=True)
def corner_radius(e1, d1, e2, d2):  # type: ignore[no-untyped-def]
    """Radius of the largest circle that touches both end lines ahead of the ends; -1 where they do not meet there."""
    cosine = _dot(d1, d2)
    sine2 = 1 - cosine * cosine
    if sine2 < 1e-12:
        return -1.0
    way = _plus(e2, e1, -1.0)
    a = (_dot(way, d1) - cosine * _dot(way, d2)) / sine2
    b = (cosine * _dot(way, d1) - _dot(way, d2)) / sine2
    if a <= 0 or b <= 0:
        return -1.0
    return min(a, b) / math.tan(_angle(d1, (-d2[0], -d2[1], -d2[2])) / 2)


@_inner
def _member(e1, d1, e2, d2, radius, deviation, inside, flat):  # type: ignore[no-untyped-def]
    """The member of a radius, if its line turns away from the straight way across by no more than so much."""
    found, first, second = connect(e1, d1, e2, d2, radius, inside, flat)
    if found:
        line, way = _plus(_end(second), _end(first), -1.0), _plus(e2, e1, -1.0)
        found = _norm(line) <= 1e-9 * _norm(way) or _angle(line, way) <= deviation
    return found, first, second


@_inner
def _largest(e1, d1, e2, d2, radius, deviation, inside, flat):  # type: ignore[no-untyped-def]
    """The member with about the largest radius up to `radius` that exists and keeps its direction."""
    found, first, second = _member(e1, d1, e2, d2, radius, deviation, inside, flat)
    if found:
        return found, first, second
    for _ in range(40):
        radius /= math.sqrt(2.0)
        found, first, second = _member(e1, d1, e2, d2, radius, deviation, inside, flat)
        if found:
            break
    step = 2**0.25
    for _ in range(BISECTIONS):
        larger, one, other = _member(e1, d1, e2, d2, radius * step, deviation, inside, flat)
        if larger:
            found, first, second, radius = True, one, other, radius * step
        step = math.sqrt(step)
    return found, first, second


@_inner
def _steps(turn, spacing):  # type: ignore[no-untyped-def]
    return max(1, math.ceil(turn[3] * turn[4] / spacing)) if turn[3] > 0 else 0


@numba.njit(cache=True)
def solve_gap(ends, radius, deviation, inside):  # type: ignore[no-untyped-def]
    """Return the arcs of the gap path between two ends, both pointing into the gap.

    Parameters
    ----------
    ends : (4, D) float64, m (px in 2-D): an end, its unit tangent, the other end, its unit tangent.
    radius : of the arcs where it is free, m (px in 2-D); 0 chooses it.
    deviation : largest angle between the line and the straight connection where the radius is chosen, radians.
    inside : lead the path of ends that turn away from each other through the inside of the gap.

    Returns
    -------
    Whether the ends touch, whether there are arcs (there are none where the straight connection is all that is left), and
    the two arcs.
    """
    dim = ends.shape[1]
    flat = dim == 2
    e1 = (ends[0, 0], ends[0, 1], 0.0 if flat else ends[0, dim - 1])
    d1 = _unit((ends[1, 0], ends[1, 1], 0.0 if flat else ends[1, dim - 1]))
    e2 = (ends[2, 0], ends[2, 1], 0.0 if flat else ends[2, dim - 1])
    d2 = _unit((ends[3, 0], ends[3, 1], 0.0 if flat else ends[3, dim - 1]))
    way = _plus(e2, e1, -1.0)
    gap = _norm(way)
    if gap < TINY:
        return True, False, (e1, d1, d1, 0.0, gap), (e2, d2, d2, 0.0, gap)
    corner = corner_radius(e1, d1, e2, d2)
    inside = inside and max(_dot(d1, way), -_dot(d2, way)) < 0
    if corner > 0:
        radius, deviation, inside = corner, math.pi, False
    elif radius > 0:
        deviation = math.pi
    else:
        radius = gap / 2
    found, first, second = _largest(e1, d1, e2, d2, radius, deviation, inside, flat)
    return False, found, first, second


@numba.njit(cache=True)
def sample_gap(first, second, spacing, dim):  # type: ignore[no-untyped-def]
    """Return points along arc, line and arc, (P, D), P >= 2, at most `spacing` apart, both ends included.

    first, second : the arcs, as `solve_gap` returns them. dim : D.
    """
    out, back = _end(first), _end(second)
    before, after = _steps(first, spacing), _steps(second, spacing)
    between = max(1, math.ceil(_norm(_plus(back, out, -1.0)) / spacing))
    points = np.empty((before + between + after + 1, dim))
    for i in range(len(points)):
        if i < before:
            place = _at(first, i * (first[3] / before))
        elif i == before:
            place = out
        elif i < before + between:
            place = _plus(out, _plus(back, out, -1.0), (i - before) / between)
        elif i == before + between:
            place = back
        else:
            place = _at(second, (len(points) - 1 - i) * (second[3] / after))
        for d in range(dim):
            points[i, d] = place[d]
    return points
