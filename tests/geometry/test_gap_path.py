"""Gap paths: the paper's cases with known solutions, tangent at both ends, in the plane and in space."""

from __future__ import annotations

import numpy as np
import pytest
from builders.gap_arcs import arcs_of

from doo3d.geometry.gap_path import gap_path
from doo3d.geometry.polyline import angle, steps, unit

SPACING = 0.01


def tangent_path(e1, d1, e2, d2, spacing, **settings):
    return gap_path(e1, d1, e2, d2, **settings).points(spacing)


def meet_ahead(e1, d1, e2, d2):
    """Tell whether the end lines meet, or are closest, ahead of both ends."""
    return (np.linalg.lstsq(np.column_stack((d1, -d2)), e2 - e1)[0] > 0).all()


def rotation(seed):
    """A random rotation of space."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def towards(degrees):
    return np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])


def lifted(seed, *vectors):
    """Vectors of the plane, in a plane somewhere in space."""
    turn = rotation(seed)
    return [turn @ np.append(vector, 0.0) for vector in vectors]


def apart(path):
    """Without points on top of one another, which a line of no length between two arcs leaves."""
    return path[np.append(steps(path) > 1e-7, True)]


def check_smooth(path, e1, d1, e2, d2, radius, tolerance=1e-6):
    """From e1 along d1 to e2 against d2, nowhere bent more than the radius allows."""
    np.testing.assert_allclose(path[0], e1, atol=1e-12 * max(1, np.abs(e1).max()))
    np.testing.assert_allclose(path[-1], e2, atol=1e-12 * max(1, np.abs(e2).max()))
    assert steps(path).max() <= SPACING * (1 + 1e-9)
    path = apart(path)
    lengths = steps(path)
    edges = np.diff(path, axis=0)
    bend = angle(edges[1:], edges[:-1])
    assert (bend <= (lengths[1:] + lengths[:-1]) / 2 / radius * 1.01 + tolerance).all()
    assert float(angle(edges[0], d1)) <= lengths[0] / 2 / radius * 1.01 + tolerance
    assert float(angle(edges[-1], -np.asarray(d2))) <= lengths[-1] / 2 / radius * 1.01 + tolerance


def on_circle_or_line(path, center, radius, line_from, line_to):
    """How many points lie on the circle; all others must lie on the line."""
    round_ = np.abs(np.linalg.norm(path - center, axis=1) - radius) < 1e-9
    way = unit(line_to - line_from)
    aside = path - line_from - np.outer((path - line_from) @ way, way)
    assert (round_ | (np.linalg.norm(aside, axis=1) < 1e-9)).all()
    return int(round_.sum())


@pytest.mark.parametrize("turn", [20, 60, 90, 150])
@pytest.mark.parametrize(("near", "far"), [(0.6, 1.0), (0.6, 0.6), (0.3, 2.0)])
@pytest.mark.parametrize("swap", [False, True])
def test_one_touching_point_ahead(turn, near, far, swap):
    """The end lines meet `near` ahead of one end and `far` ahead of the other: arc from the nearer, then the line."""
    e1, d1 = np.zeros(2), towards(0)
    corner = near * d1
    e2, d2 = corner + far * towards(turn), -towards(turn)
    radius = near / np.tan(np.radians(turn) / 2)
    center = e1 + radius * towards(90)
    path = tangent_path(e2, d2, e1, d1, SPACING)[::-1] if swap else tangent_path(e1, d1, e2, d2, SPACING)
    touching = corner + near * towards(turn)
    check_smooth(path, e1, d1, e2, d2, radius)
    assert on_circle_or_line(path, center, radius, touching, e2 + d2 * -1e-3) > 5
    assert steps(path).sum() == pytest.approx(radius * np.radians(turn) + far - near, rel=1e-3)
    assert arcs_of(gap_path(e1, d1, e2, d2))[0].radius == pytest.approx(radius)


def test_the_radius_given_is_not_for_the_case_that_has_its_own():
    args = np.zeros(2), towards(0), np.array([0.6, 0.0]) + 1.0 * towards(90), -towards(90)
    np.testing.assert_array_equal(tangent_path(*args, SPACING, radius=0.05), tangent_path(*args, SPACING))


def test_both_touching_points_ahead():
    """Parallel lanes in opposite directions: an S of two arcs of one radius and the line that touches both."""
    e1, d1, e2, d2 = np.zeros(2), towards(0), np.array([2.0, 0.6]), towards(180)
    radius = 0.4
    first, second = radius * towards(90), e2 - radius * towards(90)
    apart = np.linalg.norm(second - first)
    lean = np.arctan2(second[1] - first[1], second[0] - first[0]) + np.arcsin(2 * radius / apart)
    path = tangent_path(e1, d1, e2, d2, SPACING, radius=radius)
    check_smooth(path, e1, d1, e2, d2, radius)
    assert steps(path).sum() == pytest.approx(2 * radius * lean + np.sqrt(apart**2 - 4 * radius**2), rel=1e-3)
    near = np.minimum(np.linalg.norm(path - first, axis=1), np.linalg.norm(path - second, axis=1))
    assert near.min() == pytest.approx(radius, abs=1e-9)


@pytest.mark.parametrize("radius", [0.1, 0.25, 0.3])
def test_none_ahead_round_the_outside(radius):
    """Parallel lanes in one direction: a quarter circle, a line, a quarter circle."""
    e1, d1, e2, d2 = np.zeros(2), towards(0), np.array([0.0, 1.0]), towards(0)
    path = tangent_path(e1, d1, e2, d2, SPACING, radius=radius)
    check_smooth(path, e1, d1, e2, d2, radius)
    assert path[:, 0].max() == pytest.approx(radius, rel=1e-6)
    assert steps(path).sum() == pytest.approx(np.pi * radius + 1 - 2 * radius, rel=1e-3)


def test_a_u_turn_is_half_a_circle():
    e1, d1, e2, d2 = np.zeros(2), towards(0), np.array([0.0, 1.0]), towards(0)
    path = tangent_path(e1, d1, e2, d2, SPACING)
    check_smooth(path, e1, d1, e2, d2, 0.5)
    np.testing.assert_allclose(np.linalg.norm(path - [0, 0.5], axis=1), 0.5, atol=1e-9)


def test_none_ahead_outside_or_inside():
    """Ends that turn away from each other: outside keeps off the straight way across, inside crosses it."""
    e1, d1, e2, d2 = np.zeros(2), towards(120), np.array([1.0, 0.0]), towards(60)
    outside = tangent_path(e1, d1, e2, d2, SPACING, radius=0.1)
    inside = tangent_path(e1, d1, e2, d2, SPACING, radius=0.1, inside=True)
    check_smooth(outside, e1, d1, e2, d2, 0.1)
    check_smooth(inside, e1, d1, e2, d2, 0.1)
    assert outside[:, 1].min() >= -1e-12
    assert inside[:, 1].min() < -0.04
    assert steps(inside).sum() > steps(outside).sum()


def test_inside_is_only_for_ends_that_turn_away():
    args = np.zeros(2), towards(0), np.array([2.0, 0.6]), towards(180)
    np.testing.assert_array_equal(tangent_path(*args, SPACING, inside=True), tangent_path(*args, SPACING))


def csc(e1, d1, e2, d2, radius):
    """Length of the shortest arc + line + arc of a radius in the plane, either way round at either end (Dubins 1957)."""

    def left(vector, side):
        return side * np.array([-vector[1], vector[0]])

    def turn(a, b, side):
        by = side * (np.arctan2(b[1], b[0]) - np.arctan2(a[1], a[0])) % (2 * np.pi)
        return 0.0 if by > 2 * np.pi - 1e-9 else by

    found = []
    for s1 in (1, -1):
        for s2 in (1, -1):
            way = e2 + radius * left(-d2, s2) - e1 - radius * left(d1, s1)
            apart = np.linalg.norm(way)
            if s1 != s2 and apart < 2 * radius:
                continue
            line = apart if s1 == s2 else np.sqrt(apart**2 - 4 * radius**2)
            lean = np.arctan2(way[1], way[0]) - np.arctan2((s2 - s1) * radius, line)
            heading = np.array([np.cos(lean), np.sin(lean)])
            found.append(radius * (turn(d1, heading, s1) + turn(heading, -d2, s2)) + line)
    return min(found)


@pytest.mark.parametrize("seed", range(5))
def test_short_turns_are_the_shortest_way(seed):
    """With a radius far below the gap the family's member is the shortest of the four ways there are in the plane."""
    random = np.random.default_rng(seed)
    for _ in range(20):
        e2, d1, d2 = towards(random.uniform(0, 360)), towards(random.uniform(0, 360)), towards(random.uniform(0, 360))
        if meet_ahead(np.zeros(2), d1, e2, d2):
            continue
        turns = arcs_of(gap_path(np.zeros(2), d1, e2, d2, radius=0.03))
        assert turns is not None
        length = 0.03 * (turns[0].angle + turns[1].angle) + np.linalg.norm(turns[1].end - turns[0].end)
        assert length == pytest.approx(csc(np.zeros(2), d1, e2, d2, 0.03), abs=1e-9)


def random_ends(seed, dim):
    random = np.random.default_rng(seed)
    return random.normal(size=dim), unit(random.normal(size=dim)), random.normal(size=dim), unit(random.normal(size=dim))


@pytest.mark.parametrize("lean", [0.0, 0.1, 1.0, 4.0])
@pytest.mark.parametrize("turn", [30, 90, 140])
@pytest.mark.parametrize("more", [1.0, 1.02, 1.2])
def test_ends_of_an_arc_are_joined_by_about_that_arc(turn, lean, more):
    """The gap in a circle, its end directions off their plane by `lean` degrees, one end a little farther out."""
    e1, d1 = np.zeros(3), unit(np.array([1.0, 0, np.radians(lean)]))
    out, back = np.append(towards(turn), 0.0), np.append(-towards(turn), np.radians(lean))
    e2 = np.array([0.5, 0, 0]) + 0.5 * more * out
    path = tangent_path(e1, d1, e2, unit(back), SPACING)
    radius = 0.5 / np.tan(np.radians(turn) / 2)
    center = np.array([0, radius, 0])
    assert np.abs(np.linalg.norm(path - center, axis=1) - radius).max() < (0.02 + 0.01 * lean + more - 1) * radius
    assert smallest_radius(path) > 0.7 * radius


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(30))
def test_tangent_at_both_ends_wherever_they_are(seed, dim):
    e1, d1, e2, d2 = random_ends(seed, dim)
    turns = arcs_of(gap_path(e1, d1, e2, d2, radius=0.1 * float(np.linalg.norm(e2 - e1))))
    assert turns is not None
    first, second = turns
    way = second.end - first.end
    np.testing.assert_allclose(unit(way), first.end_direction, atol=1e-7)
    np.testing.assert_allclose(unit(way), -second.end_direction, atol=1e-7)
    for end, direction, arc in ((e1, d1, first), (e2, d2, second)):
        np.testing.assert_array_equal(arc.start, end)
        np.testing.assert_allclose(arc.direction, direction, atol=1e-15)
        assert abs(arc.normal @ direction) < 1e-12
        assert 0 <= arc.angle < 2 * np.pi
    for radius in (None, 0.2):
        path = tangent_path(e1, d1, e2, d2, SPACING, radius=radius)
        check_smooth(path, e1, d1, e2, d2, smallest_radius(path), 1e-6)


def smallest_radius(path):
    """Of the circles through three points in a row."""
    path = apart(path)
    a, b, c = path[:-2], path[1:-1], path[2:]
    sides = np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - b, axis=1) * np.linalg.norm(c - a, axis=1)
    u, v = b - a, c - a
    twice = np.sqrt(np.maximum((u**2).sum(1) * (v**2).sum(1) - (u * v).sum(1) ** 2, 0))
    bent = twice > 1e-9 * np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    found = float((sides[bent] / (2 * twice[bent])).min()) if bent.any() else np.inf
    assert found > 0.02
    return found


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(("radius", "inside"), [(None, False), (0.15, False), (0.15, True)])
def test_a_plane_in_space_is_the_plane(seed, radius, inside):
    ends = random_ends(seed, 2)
    flat = tangent_path(*ends, SPACING, radius=radius, inside=inside)
    space = tangent_path(*lifted(seed, *ends), SPACING, radius=radius, inside=inside)
    assert len(space) == len(flat)
    np.testing.assert_allclose(space, np.array(lifted(seed, *flat)), atol=1e-7)
    level = tangent_path(*(np.append(vector, 0.0) for vector in ends), SPACING, radius=radius, inside=inside)
    np.testing.assert_allclose(level[:, :2], flat, atol=1e-12)
    assert not level[:, 2].any()


@pytest.mark.parametrize("seed", range(8))
def test_skew_ends_bend_in_planes_of_their_own(seed):
    """Each arc lies in the plane of its end direction and the line."""
    e1, d1, e2, d2 = random_ends(seed, 3)
    first, second = arcs_of(gap_path(e1, d1, e2, d2, radius=0.1))
    way = second.end - first.end
    for arc in (first, second):
        assert abs(np.linalg.det([arc.direction, arc.normal, unit(way)])) < 1e-7
    assert abs(np.linalg.det([d1, d2, unit(e2 - e1)])) > 1e-3


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    ("d1", "d2", "e2"),
    [
        (0, 180, [1.0, 0.0]),  # facing on one line
        (0, 0, [1.0, 0.0]),  # one behind the other, heading the same way
        (180, 180, [1.0, 0.0]),
        (180, 0, [1.0, 0.0]),  # back to back on one line
        (90, 90, [1.0, 0.0]),  # side by side, heading the same way
        (90, 270, [1.0, 0.0]),  # side by side, heading opposite ways
        (0, 180, [1.0, 0.3]),  # parallel lanes, facing
        (180, 0, [1.0, 0.3]),  # parallel lanes, back to back
        (0, 90, [1.0, 1.0]),
        (0, 270, [0.5, 0.5]),
        (10, 10, [1.0, 0.0]),
    ],
)
def test_degenerate_ends(d1, d2, e2, dim):
    e1, d1, e2, d2 = (np.pad(vector, (0, dim - 2)) for vector in (np.zeros(2), towards(d1), np.array(e2), towards(d2)))
    path = tangent_path(e1, d1, e2, d2, SPACING)
    check_smooth(path, e1, d1, e2, d2, smallest_radius(path), 1e-6)


def test_ends_that_face_each_other_are_joined_straight():
    path = tangent_path(np.zeros(3), np.array([0.0, 0, 1]), np.array([0.0, 0, 2]), np.array([0.0, 0, -1]), SPACING)
    assert not path[:, :2].any()
    assert steps(path).sum() == pytest.approx(2)


@pytest.mark.parametrize("dim", [2, 3])
def test_ends_that_touch(dim):
    e = np.arange(dim, dtype=float)
    for d2 in (np.eye(dim)[0], -np.eye(dim)[0], np.eye(dim)[1]):
        np.testing.assert_array_equal(tangent_path(e, np.eye(dim)[0], e, d2, SPACING), e[None])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1e4])
@pytest.mark.parametrize("seed", range(6))
def test_any_scale(seed, scale, dim):
    e1, d1, e2, d2 = random_ends(seed, dim)
    path = tangent_path(e1, d1, e2, d2, SPACING)
    scaled = tangent_path(scale * e1, d1, scale * e2, d2, scale * SPACING)
    if scale * np.linalg.norm(e2 - e1) >= 1e-12:
        assert len(scaled) == pytest.approx(len(path), abs=3)
        np.testing.assert_allclose(steps(scaled).sum(), scale * steps(path).sum(), rtol=1e-6)


def test_a_radius_too_large_for_the_gap_is_made_smaller():
    e1, d1, e2, d2 = np.zeros(2), towards(180), np.array([1.0, 0.0]), towards(0)
    path = tangent_path(e1, d1, e2, d2, SPACING, radius=100.0)
    check_smooth(path, e1, d1, e2, d2, smallest_radius(path))


def test_a_radius_too_large_becomes_about_the_largest():
    """Between parallel lanes in one direction the largest is half their distance."""
    for radius in (0.51, 0.6, 0.7, 1.3):
        path = tangent_path(np.zeros(2), towards(0), np.array([0.0, 1.0]), towards(0), SPACING, radius=radius)
        assert 0.47 < path[:, 0].max() < 0.5 + 1e-9


@pytest.mark.parametrize("limit", [5.0, 20.0, 60.0])
@pytest.mark.parametrize("seed", range(6))
def test_the_line_keeps_its_direction(monkeypatch, seed, limit):
    """With the radius left free the line deviates by at most so much from the straight way across."""
    random = np.random.default_rng(seed)
    e1, e2 = np.zeros(3), np.array([1.0, 0.0, 0.0])
    d1, d2 = unit(random.normal(size=3) * [-1, 1, 1]), unit(random.normal(size=3))
    if meet_ahead(e1, d1, e2, d2):
        d2 = -d2
    monkeypatch.setattr("doo3d.geometry.gap_path.MAX_DEVIATION_DEG", limit)
    edges = np.diff(tangent_path(e1, d1, e2, d2, SPACING), axis=0)
    bend = angle(edges[1:], edges[:-1])
    straight = edges[1:][bend < 1e-7]
    if len(straight):
        assert np.degrees(angle(straight, e2 - e1)).max() <= limit + 1e-6


@pytest.mark.parametrize("dim", [2, 3])
def test_one_gap_path_at_any_spacing(dim):
    """Finer points of a path lie on the same arcs and the same line."""
    random = np.random.default_rng(dim)
    e1, e2, d1, d2 = *random.uniform(0, 1, (2, dim)), *unit(random.normal(size=(2, dim)))
    path = gap_path(e1, d1, e2, d2)
    coarse, fine = path.points(0.1), path.points(0.001)
    assert len(coarse) < len(fine)
    assert max(np.linalg.norm(fine - point, axis=1).min() for point in coarse) < 0.001
    np.testing.assert_array_equal(path.ends, [e1, e2])


@pytest.mark.parametrize("dim", [2, 3])
def test_the_gap_path_back_is_the_same_curve(dim):
    random = np.random.default_rng(10 + dim)
    for _ in range(20):
        e1, e2, d1, d2 = *random.uniform(0, 1, (2, dim)), *unit(random.normal(size=(2, dim)))
        there, back = gap_path(e1, d1, e2, d2), gap_path(e2, d2, e1, d1)
        np.testing.assert_allclose(there.points(SPACING), back.points(SPACING)[::-1], atol=1e-6)
